"""Text files, plain or compressed, line by line; what comes before a damaged place is still read."""

import gzip
import io
import lzma
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import RecordingError
from contourslam.nearest import unreadable

_GZIP_MAGIC = b"\x1f\x8b"
_XZ_MAGIC = b"\xfd7zXZ\x00"
# A scan of 10,000 beams takes some 60 kB; a longer line is no text, and must not fill the memory.
_LONGEST_LINE = 2**20


def first_bytes(path: Path, count: int) -> bytes:
    """Read the first bytes of a file.

    Raises
    ------
    RecordingError
        If the file is missing, is a folder, is empty or may not be read.
    """
    try:
        with path.open("rb") as file:
            head = file.read(count)
    except OSError as error:
        raise RecordingError(unreadable(path, error)) from error
    if not head:
        raise RecordingError(f"{path}: the file is empty")
    return head


def open_text(path: Path) -> BinaryIO:
    """Open a plain, gzip or xz file for reading; the content tells which, not the suffix.

    Raises
    ------
    RecordingError
        As :func:`first_bytes`.
    """
    head = first_bytes(path, 6)
    if head.startswith(_GZIP_MAGIC):
        return cast(BinaryIO, gzip.open(path, "rb"))
    if head == _XZ_MAGIC:
        return cast(BinaryIO, lzma.open(path, "rb"))
    return io.BufferedReader(io.FileIO(path))


def text_lines(path: Path) -> Iterator[tuple[int, bytes]]:
    r"""Yield each line with its number, from 1; every line but a cut last one ends in ``\n``.

    Raises
    ------
    RecordingError
        If the file cannot be opened, its compressed data is cut or corrupt, or a line is too long for text; the lines
        before are yielded first.
    """
    number = 0
    with open_text(path) as file:
        while True:
            try:
                line = file.readline(_LONGEST_LINE)
            except EOFError as error:
                raise RecordingError(f"{path}: the compressed file is cut short after line {number}") from error
            except (OSError, zlib.error, lzma.LZMAError) as error:
                raise RecordingError(f"{path}: damaged after line {number}: {error}") from error
            if not line:
                return
            number += 1
            if len(line) >= _LONGEST_LINE:
                raise RecordingError(f"{path}: line {number} is longer than {_LONGEST_LINE} bytes: not a text file?")
            yield number, line


def number_rows(path: Path, columns: tuple[int, ...]) -> tuple[NDArray[np.float64], list[int]]:
    """Read rows of numbers; empty lines and lines that start with ``#`` are left out.

    Parameters
    ----------
    path : Path
        Plain, gzip or xz.
    columns : tuple of int
        Numbers of values that a row may have; all rows have as many as the first.

    Returns
    -------
    rows : ndarray, shape (n, columns)
    lines : list of int
        Line of each row in the file, from 1.

    Raises
    ------
    RecordingError
        If the file cannot be read, or a row has another number of values or one that is not a finite number (the
        message names the line), or there is no row.
    """
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in text_lines(path):
        words = line.split()
        if not words or words[0].startswith(b"#"):
            continue
        if len(words) not in columns or (rows and len(words) != len(rows[0])):
            expected = str(len(rows[0])) if rows else " or ".join(map(str, columns))
            raise RecordingError(f"{path}: line {number} has {len(words)} values, expected {expected}")
        try:
            row = [float(word) for word in words]
        except ValueError as error:
            raise RecordingError(f"{path}: line {number}: {error}") from error
        if not np.isfinite(row).all():
            raise RecordingError(f"{path}: line {number} has a value that is not finite")
        rows.append(row)
        lines.append(number)
    if not rows:
        raise RecordingError(f"{path}: holds no row of numbers")
    return np.array(rows), lines
