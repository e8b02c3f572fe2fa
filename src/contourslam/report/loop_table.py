"""The closed loops of a run as a plain table, each with its evidence."""

import csv
import io
from pathlib import Path

import numpy as np

from contourslam.atomic import write_text
from contourslam.errors import ResultError
from contourslam.report.csv_table import read_lines, wrong_header
from contourslam.slam.result import Loop

_POSE = ("x", "y", "theta")
COLUMNS = (
    "earlier_stamp",
    "later_stamp",
    *_POSE,
    *(f"cov_{name}" for name in ("xx", "xy", "xtheta", "yy", "ytheta", "thetatheta")),
    *(f"shift_{name}" for name in _POSE),
    "method",
    "pairs",
    "residual",
    "overlap",
    "runner_up",
)
"""Columns of the table in m, rad, s: the fields of :class:`contourslam.slam.result.Loop`."""
_UPPER = np.triu_indices(3)
_METHOD, _PAIRS = COLUMNS.index("method"), COLUMNS.index("pairs")


def write_loop_table(path: Path, loops: tuple[Loop, ...]) -> None:
    """Write one line per loop, in the order in which they were closed.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for loop in loops:
        numbers = [*loop.relative_pose, *loop.covariance[_UPPER], *loop.shift]
        evidence = [loop.residual, loop.overlap, loop.runner_up]
        table.writerow(
            [
                *(repr(float(stamp)) for stamp in (loop.earlier_stamp, loop.later_stamp)),
                *(f"{number:.10g}" for number in numbers),
                loop.method,
                int(loop.pairs),
                *(f"{number:.10g}" for number in evidence),
            ]
        )
    write_text(path, text.getvalue())


def read_loop_table(path: Path) -> tuple[Loop, ...]:
    """Read the table back; where there is none, no loop was closed.

    Raises
    ------
    ResultError
        If a line of the file is not as it was written; the message names the line.
    """
    if not path.exists():
        return ()
    lines = read_lines(path, "loops")
    if not lines or tuple(lines[0]) != COLUMNS:
        raise wrong_header(path, "loops")
    loops = []
    for number, line in enumerate(lines[1:], start=2):
        try:
            loops.append(_loop(line))
        except ValueError as error:
            raise ResultError(f"{path}: line {number} is not a loop of {len(COLUMNS)} values") from error
    return tuple(loops)


def _loop(line: list[str]) -> Loop:
    if len(line) != len(COLUMNS):
        raise ValueError(f"{len(line)} values")
    values = np.array([float(field) for field in line[:_METHOD]])
    covariance = np.empty((3, 3))
    covariance[_UPPER] = covariance.T[_UPPER] = values[5:11]
    residual, overlap, runner_up = (float(field) for field in line[_PAIRS + 1 :])
    return Loop(
        float(values[0]),
        float(values[1]),
        values[2:5],
        covariance,
        values[11:14],
        line[_METHOD],
        int(line[_PAIRS]),
        residual,
        overlap,
        runner_up,
    )
