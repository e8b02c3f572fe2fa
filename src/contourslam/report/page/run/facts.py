"""What the page tells of each thing on its maps when asked; their places are in the drawing.

Lists, in the order in which :mod:`contourslam.report.svg.way` draws, of numbers with no more digits than are shown.
Lengths are in mm, angles in degrees, and times are steps from one to the next in s.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.report.page.run.values import RunValues
from contourslam.report.svg.series import position_sigmas
from contourslam.report.svg.way import corner_order, error_order, loop_order, sampled
from contourslam.slam.landmark_map import WallMap
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]


def map_facts(values: RunValues, poses: Floats) -> dict[str, Any]:
    """Give what is known of the corners, walls and loops of a run, and of the poses that are drawn, shape (t, 3)."""
    result = values.result
    return {
        "corners": _corners(result),
        "walls": _walls(result.wall_map),
        "way": _way(values, poses),
        "loops": _loops(result, values.begin),
    }


def error_facts(values: RunValues, later: Floats, errors: Floats) -> dict[str, Any]:
    """Give the second times and the errors of relations, shape (n,), s and m."""
    order = error_order(later, errors)
    return {"errors": {"dt": _steps(later[order] - values.begin, 1), "error": _digits(1000.0 * errors[order], 3)}}


def _way(values: RunValues, poses: Floats) -> dict[str, Any]:
    result, at = values.result, sampled(len(values.result.poses))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = result.nis[at] / result.nis_dof[at]
    facts: dict[str, Any] = {
        "dt": _steps(result.stamps[at] - values.begin, 2),
        "heading": np.degrees(poses[at, 2]).round(1).tolist(),
        "sigma": _digits(1000.0 * position_sigmas(result)[at], 2),
        "turn": _digits(np.degrees(np.sqrt(np.maximum(result.covariances[at, 2, 2], 0.0))), 2),
    }
    if (result.nis_dof > 0).any():
        facts["nis"] = _digits(ratios, 2)
    return facts


def _corners(result: RunResult) -> dict[str, Any]:
    corners, order = result.corner_map, corner_order(result)
    variances, directions = np.linalg.eigh(corners.covariances[order])
    sigmas = np.sqrt(np.maximum(variances, 0.0))
    return {
        "id": corners.ids[order].tolist(),
        "major": _digits(1000.0 * sigmas[:, 1]),
        "minor": _digits(1000.0 * sigmas[:, 0]),
        "tilt": (np.degrees(np.arctan2(directions[:, 1, 1], directions[:, 0, 1])) % 180.0).round().tolist(),
        "opening": np.degrees(corners.openings[order]).round(1).tolist(),
        "convex": corners.convex[order].astype(int).tolist(),
        "o": corners.observed[order].tolist(),
        "f": corners.failed[order].tolist(),
    }


def _walls(walls: WallMap) -> dict[str, Any]:
    sigmas = np.sqrt(np.maximum(walls.line_covariances[:, (0, 1), (0, 1)], 0.0))
    return {
        "id": walls.ids.tolist(),
        "turn": _digits(np.degrees(sigmas[:, 0])),
        "shift": _digits(1000.0 * sigmas[:, 1]),
        "o": walls.observed.tolist(),
        "f": walls.failed.tolist(),
    }


def _loops(result: RunResult, begin: float) -> dict[str, Any]:
    loops = loop_order(result)
    return {
        "from": [round(loop.earlier_stamp - begin, 1) for loop in loops],
        "to": [round(loop.later_stamp - begin, 1) for loop in loops],
        "shift": _digits([1000.0 * float(np.hypot(*loop.shift[:2])) for loop in loops]),
        "turn": _digits([float(np.degrees(loop.shift[2])) for loop in loops]),
        "method": [loop.method for loop in loops],
        "pairs": [loop.pairs for loop in loops],
        "residual": _digits([1000.0 * loop.residual for loop in loops]),
        "overlap": _digits([loop.overlap for loop in loops]),
        "runner": _digits([loop.runner_up for loop in loops]),
    }


def _steps(times: Floats, decimals: int) -> list[float]:
    """Give the first time and the steps to each next one, s; rounding does not add up."""
    return [float(step) for step in np.diff(times.round(decimals), prepend=0.0).round(decimals)]


def _digits(values: Floats | list[float], digits: int = 3) -> list[float | None]:
    """So many digits of each; null where it is not finite."""
    listed = np.asarray(values, dtype=np.float64).tolist()
    return [_shortest(float(f"{value:.{digits}g}")) if np.isfinite(value) else None for value in listed]


def _shortest(value: float) -> float:
    return int(value) if value.is_integer() else value
