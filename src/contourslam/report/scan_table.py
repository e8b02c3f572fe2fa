"""A run's per-scan record as a plain table, so that it can be evaluated and drawn again without its recording."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.atomic import write_text
from contourslam.report.csv_table import numbers_of, read_lines, wrong_header
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import RunResult

_POSE = ("x", "y", "theta")
_COVARIANCE = ("xx", "xy", "xtheta", "yy", "ytheta", "thetatheta")
_COUNTS = ("nis_dof", "matched", "corners", "walls")
_TRUTH = tuple(f"true_{name}" for name in _POSE)
_QUALITY = ("quality",)
_ONLINE = tuple(f"online_{name}" for name in _POSE)
_READINGS = ("readings_before",)
COLUMNS = (
    "stamp",
    *_POSE,
    *(f"cov_{name}" for name in _COVARIANCE),
    *(f"odometry_{name}" for name in _POSE),
    "nis",
    *_COUNTS,
)
"""Columns of the table in m, rad, s.

Where known, there follow the true pose, the quality of the contour matching, the pose as known at the time, and how
many odometry readings came before the scan."""
_OPTIONAL = (_TRUTH, _QUALITY, _ONLINE, _READINGS)
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
    quality = None if result.quality is None else result.quality[:, None]
    known = (result.truth, quality, result.online_poses, _before(result))
    for group, values in zip(_OPTIONAL, known, strict=True):
        if values is not None:
            columns, names = [*columns, values], names + group
    line = ",".join(["{!r}", *["{:.10g}"] * (len(names) - 1)]).format  # one call a line: there may be some ten thousand
    rows = np.concatenate([result.stamps[:, None], *columns], axis=1).tolist()
    write_text(path, "\n".join([",".join(names), *(line(*row) for row in rows)]) + "\n")


def _before(result: RunResult) -> NDArray[np.float64] | None:
    """Odometry readings before each scan; None where they are not known."""
    if result.readings is None:
        return None
    scans = np.arange(len(result.stamps))
    return np.searchsorted(result.readings.scans_before, scans, side="right")[:, None].astype(np.float64)


def read_scan_table(path: Path) -> tuple[RunResult, NDArray[np.float64] | None]:
    """Read the table back.

    Returns
    -------
    result : RunResult
        With its per-scan arrays; the map is empty and the detector has no name.
    readings_before : ndarray, shape (t,), or None
        How many odometry readings came before each scan, where the table says so.

    Raises
    ------
    ResultError
        If the file is missing, or a line of it is not as it was written; the message names the line.
    """
    lines = read_lines(path, "scans")
    names = tuple(lines[0]) if lines else ()
    if names != COLUMNS + tuple(name for group in _OPTIONAL if group[0] in names for name in group):
        raise wrong_header(path, "scans")
    values = numbers_of(path, lines)
    table = dict(zip(names, values.T, strict=True))
    return _result(table), table.get(_READINGS[0])


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
        truth=_poses(table, _TRUTH),
        nis=table["nis"],
        nis_dof=nis_dof,
        matched_count=matched,
        corner_count=corners,
        wall_count=walls,
        corner_map=EMPTY_CORNERS,
        wall_map=EMPTY_WALLS,
        online_poses=_poses(table, _ONLINE),
        quality=table.get(_QUALITY[0]),
    )


def _poses(table: dict[str, NDArray[np.float64]], names: tuple[str, ...]) -> NDArray[np.float64] | None:
    return np.stack([table[name] for name in names], axis=-1) if names[0] in table else None
