"""A run's per-scan record as a plain table, so that it can be evaluated and drawn again without its recording."""

import csv
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ResultError
from contourslam.report.atomic import write_text
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import RunResult

_POSE = ("x", "y", "theta")
_COVARIANCE = ("xx", "xy", "xtheta", "yy", "ytheta", "thetatheta")
_COUNTS = ("nis_dof", "matched", "corners", "walls")
_TRUTH = tuple(f"true_{name}" for name in _POSE)
_QUALITY = ("quality",)
COLUMNS = (
    "stamp",
    *_POSE,
    *(f"cov_{name}" for name in _COVARIANCE),
    *(f"odometry_{name}" for name in _POSE),
    "nis",
    *_COUNTS,
)
"""Columns of the table in m, rad, s; the true pose and the quality of the contour matching follow where known."""
_UPPER = np.triu_indices(3)

_NONE = np.zeros(0, dtype=np.int64)
EMPTY_CORNERS = CornerMap(
    _NONE, np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.bool_), _NONE, _NONE
)
EMPTY_WALLS = WallMap(
    _NONE, np.zeros((0, 2, 2)), np.zeros((0, 2, 2, 2)), np.zeros(0), np.zeros((0, 2, 2)), _NONE, _NONE
)


def write_scan_table(path: Path, result: RunResult) -> None:
    """Write one line per scan: stamp, pose, covariance, raw odometry, innovation, counts, and what else is known.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    upper = result.covariances[:, _UPPER[0], _UPPER[1]]
    columns = [result.poses, upper, result.odometry, result.nis[:, None]]
    counts = [result.nis_dof, result.matched_count, result.corner_count, result.wall_count]
    columns += [count[:, None].astype(np.float64) for count in counts]
    names = COLUMNS
    if result.truth is not None:
        columns, names = [*columns, result.truth], names + _TRUTH
    if result.quality is not None:
        columns, names = [*columns, result.quality[:, None]], names + _QUALITY
    text = io.StringIO()
    text.write(",".join(names) + "\n")
    for stamp, row in zip(result.stamps, np.concatenate(columns, axis=1), strict=True):
        text.write(",".join([repr(float(stamp)), *(f"{value:.10g}" for value in row)]) + "\n")
    write_text(path, text.getvalue())


def read_scan_table(path: Path) -> RunResult:
    """Read the table back.

    Returns
    -------
    RunResult
        With its per-scan arrays, but for the online poses; the map is empty and the detector has no name.

    Raises
    ------
    ResultError
        If the file is missing, or a line of it is not as it was written; the message names the line.
    """
    try:
        lines = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8"))))
    except OSError as error:
        raise ResultError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise ResultError(f"{path}: is not a table of scans ({error})") from error
    names = tuple(lines[0]) if lines else ()
    if names not in (COLUMNS, COLUMNS + _TRUTH, COLUMNS + _QUALITY, COLUMNS + _TRUTH + _QUALITY):
        raise ResultError(
            f"{path}: line 1 is not the header of a table of scans; write it again with `contourslam run`"
        )
    values = np.empty((len(lines) - 1, len(names)))
    for number, line in enumerate(lines[1:]):
        try:
            values[number] = [float(field) for field in line]
        except ValueError as error:
            raise ResultError(f"{path}: line {number + 2} must hold {len(names)} numbers") from error
    return _result(dict(zip(names, values.T, strict=True)))


def _result(table: dict[str, NDArray[np.float64]]) -> RunResult:
    covariances = np.empty((len(table["stamp"]), 3, 3))
    for row, column, name in zip(*_UPPER, _COVARIANCE, strict=True):
        covariances[:, row, column] = covariances[:, column, row] = table[f"cov_{name}"]
    nis_dof, matched, corners, walls = (table[name].astype(np.int64) for name in _COUNTS)
    return RunResult(
        detector="",
        stamps=table["stamp"],
        poses=np.stack([table[name] for name in _POSE], axis=-1),
        covariances=covariances,
        odometry=np.stack([table[f"odometry_{name}"] for name in _POSE], axis=-1),
        truth=np.stack([table[name] for name in _TRUTH], axis=-1) if _TRUTH[0] in table else None,
        nis=table["nis"],
        nis_dof=nis_dof,
        matched_count=matched,
        corner_count=corners,
        wall_count=walls,
        corner_map=EMPTY_CORNERS,
        wall_map=EMPTY_WALLS,
        quality=table.get(_QUALITY[0]),
    )
