"""Files that are either whole or not there: written beside their place, then moved into it."""

import contextlib
import glob
import os
import secrets
import time
from collections.abc import Iterator
from pathlib import Path

from contourslam.errors import ResultError

ABANDONED = 3600.0  # s after its last change until a temporary file counts as left behind


def make_folder(folder: Path) -> None:
    """Make a folder and those above it, where needed.

    Raises
    ------
    ResultError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultError(f"{folder}: cannot be made ({error.strerror or error}); choose another folder") from error


def remove(path: Path) -> None:
    """Remove a file, where there is one.

    Raises
    ------
    ResultError
        If it cannot be removed.
    """
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        raise ResultError(f"{path}: cannot be removed ({error.strerror or error})") from error


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path to write to, and move it to `path` once the block has ended well.

    A reader never sees half a file, and a failure, a process that is killed or a power cut leaves what stood at `path`
    before as it was. Of two writers at once the later one wins, whole. What a killed writer left behind is removed
    by the next one after an hour.

    Parameters
    ----------
    path : Path
        Where the file will stand; its folder is made where needed.

    Yields
    ------
    Path
        A file in the same folder, with the same suffix.

    Raises
    ------
    ResultError
        If the file cannot be written (no permission, disk full, the folder is a file).
    """
    temporary = path.with_name(f".{path.stem}.{secrets.token_hex(8)}{path.suffix}")
    make_folder(path.parent)
    _sweep(path)
    try:
        yield temporary
        _settle(temporary)  # else a power cut after the move may leave an empty file under the name
        temporary.replace(path)
        with contextlib.suppress(OSError):  # some file systems cannot; the file is whole all the same
            _settle(path.parent)
    except OSError as error:
        raise ResultError(
            f"{path}: cannot be written ({error.strerror or error}); free space or choose another folder"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def _settle(path: Path) -> None:
    """Wait until the disk has it."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _sweep(path: Path) -> None:
    """Remove temporary files of this one whose writers were killed."""
    pattern = f".{glob.escape(path.stem)}.{'[0-9a-f]' * 16}{glob.escape(path.suffix)}"
    for left in path.parent.glob(pattern):
        with contextlib.suppress(OSError):
            if time.time() - left.stat().st_mtime > ABANDONED:
                left.unlink()


def write_bytes(path: Path, content: bytes) -> None:
    """Write a whole file at once.

    Raises
    ------
    ResultError
        As :func:`replacing`.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def write_text(path: Path, content: str) -> None:
    """Write a whole UTF-8 file at once.

    Raises
    ------
    ResultError
        As :func:`replacing`.
    """
    write_bytes(path, content.encode())
