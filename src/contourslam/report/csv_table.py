"""Tables of a result folder, read back from CSV."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ResultError
from contourslam.nearest import unreadable


def read_lines(path: Path, what: str) -> list[list[str]]:
    """Read the lines of a table, its header first.

    Parameters
    ----------
    path : Path
    what : str
        What it is a table of, for the message.

    Raises
    ------
    ResultError
        If the file cannot be read or is no table; the message names it.
    """
    try:
        return list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))
    except OSError as error:
        raise ResultError(unreadable(path, error)) from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise ResultError(f"{path}: is not a table of {what} ({error})") from error


def wrong_header(path: Path, what: str) -> ResultError:
    """Make the error for a table whose first line is another one."""
    return ResultError(f"{path}: line 1 is not the header of a table of {what}; write it again with `contourslam run`")


def numbers_of(path: Path, lines: Sequence[Sequence[str]]) -> NDArray[np.float64]:
    """Give the numbers below the header, shape (n, columns).

    Raises
    ------
    ResultError
        If a line does not hold as many numbers as the header has names; the message names the line.
    """
    columns = len(lines[0])
    values = np.empty((len(lines) - 1, columns))
    for number, line in enumerate(lines[1:]):
        try:
            values[number] = [float(field) for field in line]
        except ValueError as error:
            raise ResultError(f"{path}: line {number + 2} must hold {columns} numbers") from error
    return values
