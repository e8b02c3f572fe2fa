"""Recordings wherever they lie: found by patterns, told apart by their content, fetched to where they are read."""

import contextlib
import hashlib
import tempfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from contourslam.errors import ConfigError, MissingExtraError, RecordingError
from contourslam.evaluation.extras import require

UNREADABLE = "cannot be read"
"""With this begins the identity of what is not there."""
_BLOCK = 1 << 20  # bytes


def open_place(url: str) -> tuple[Any, str]:
    """Give the file system behind a path or URL, and the path on it.

    Parameters
    ----------
    url : str

    Raises
    ------
    ConfigError
        If the kind of URL is unknown.
    MissingExtraError
        If the library for it is not installed.
    """
    fsspec = require("fsspec", "sweep")
    try:
        system, path = fsspec.core.url_to_fs(url)
    except ImportError as error:
        raise MissingExtraError(f"{url}: {error}") from error
    except ValueError as error:
        raise ConfigError(f"{url}: {error}") from error
    return system, str(path)


def protocols(system: Any) -> set[str]:
    """Names by which URLs call a file system."""
    return set(system.protocol) if isinstance(system.protocol, tuple) else {system.protocol}


def is_local(system: Any) -> bool:
    """Whether a file system is this machine's own."""
    return "file" in protocols(system)


def matching(pattern: str, folder: Path) -> list[str]:
    """Find the recordings that a path, URL or pattern of either stands for.

    Parameters
    ----------
    pattern : str
        A pattern has ``*``, ``?`` or ``[``; without one, the place is taken whether something is there or not.
    folder : Path
        Relative paths start here.

    Returns
    -------
    list of str
        Paths and URLs, in alphabetical order.

    Raises
    ------
    ConfigError
        If nothing matches a pattern.
    """
    url = pattern if "://" in pattern else str(folder.resolve() / pattern)
    if not any(sign in pattern for sign in "*?["):
        return [url]
    system, path = open_place(url)
    found = sorted(_url(system, str(each)) for each in system.glob(path))
    if not found:
        raise ConfigError(f"{pattern!r}: no file matches; take the pattern out, or mend it")
    return found


def relations_beside(url: str) -> str | None:
    """Find the known relative poses that belong to a recording.

    They are named as the recording up to the first dot, then ``.relations`` and any suffix.
    """
    system, path = open_place(url)
    stem = PurePosixPath(path).name.partition(".")[0]
    found = sorted(system.glob(f"{PurePosixPath(path).parent}/{stem}.relations*"))
    return _url(system, str(found[0])) if found else None


def identity(url: str) -> str:
    """Tell a file or folder by its content: size and SHA-256; one elsewhere by what the store says of it.

    Parameters
    ----------
    url : str

    Returns
    -------
    str
        Where it cannot be read: that, with the place.
    """
    system, path = open_place(url)
    try:
        if not is_local(system):
            parts = sorted(system.find(path)) or [path]
            said = [f"{part} {system.size(part)} {system.ukey(part)}" for part in parts]
            return f"{len(parts)} files {hashlib.sha256(' '.join(said).encode()).hexdigest()}"
        place, digest, size = Path(path), hashlib.sha256(), 0
        for file in sorted(part for part in place.rglob("*") if part.is_file()) if place.is_dir() else [place]:
            digest.update(file.relative_to(place).as_posix().encode() + b"\0")
            with file.open("rb") as stream:
                while block := stream.read(_BLOCK):
                    digest.update(block)
                    size += len(block)
    except OSError:
        return f"{UNREADABLE}: {url}"
    return f"{size} bytes {digest.hexdigest()}"


@contextlib.contextmanager
def fetched(url: str) -> Iterator[Path]:
    """Have a file or folder on this machine while it is read.

    Parameters
    ----------
    url : str

    Yields
    ------
    Path
        The place itself, or a copy that is removed afterwards.

    Raises
    ------
    RecordingError
        If it cannot be fetched.
    """
    system, path = open_place(url)
    if is_local(system):
        yield Path(path)
        return
    with tempfile.TemporaryDirectory(prefix="contourslam-") as folder:
        copy = Path(folder) / PurePosixPath(path).name
        try:
            system.get(path, str(copy), recursive=bool(system.isdir(path)))
        except OSError as error:
            raise RecordingError(f"{url}: cannot be fetched ({error})") from error
        yield copy


def _url(system: Any, path: str) -> str:
    return path if is_local(system) else str(system.unstrip_protocol(path))
