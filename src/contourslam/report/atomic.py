"""Files that are either whole or not there: written beside their place, then moved into it."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from contourslam.errors import ResultError


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

    A reader never sees half a file, and a failure leaves what stood at `path` before as it was.

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
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    make_folder(path.parent)
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise ResultError(
            f"{path}: cannot be written ({error.strerror or error}); free space or choose another folder"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_bytes(path: Path, content: bytes) -> None:
    """Write a whole file at once.

    Raises
    ------
    ResultError
        As :func:`replacing`.
    """
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())  # without it, a full disk or a power cut may show only after the move


def write_text(path: Path, content: str) -> None:
    """Write a whole UTF-8 file at once.

    Raises
    ------
    ResultError
        As :func:`replacing`.
    """
    write_bytes(path, content.encode())
