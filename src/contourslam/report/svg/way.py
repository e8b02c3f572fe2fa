"""The way driven through a building: over its map with the closed loops, and with the errors at their places."""

import numpy as np
from numpy.typing import NDArray

from contourslam.report.svg.axes import Axes
from contourslam.report.svg.colours import (
    BLUE,
    FAINT,
    GREEN,
    GREY,
    INK,
    ORANGE,
    SHADES,
    SHEET,
    SKY,
    VERMILION,
    shades,
)  # fmt: skip
from contourslam.report.svg.drawing import SCALE_WIDTH, Drawing, drawing
from contourslam.slam.result import Loop, RunResult

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_WIDTH, _HEIGHT, _LEAST = 840.0, 700.0, 180.0  # px, of the axes
_MAX_POINTS = 2000
SIGMAS = 2.0
"""Standard deviations to which a corner's ellipse is drawn."""


def poses_at(result: RunResult, stamps: Floats) -> Floats:
    """Poses nearest in time; stamps may run backwards.

    Parameters
    ----------
    result : RunResult
        With one scan or more.
    stamps : ndarray, shape (n,)
        s.

    Returns
    -------
    ndarray, shape (n, 3)
    """
    order = np.argsort(result.stamps, kind="stable")
    known = result.stamps[order]
    after = np.clip(np.searchsorted(known, stamps), min(1, len(known) - 1), len(known) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(stamps - known[before] <= known[after] - stamps, before, after)
    return np.asarray(result.poses[order[nearest]])


def sampled(scans: int) -> Indices:
    """Give the scans whose poses are drawn: the eye cannot tell more."""
    return np.arange(0, scans, -(-scans // _MAX_POINTS))


def corner_order(result: RunResult) -> Indices:
    """Give the corners' rows in the order in which they are drawn, the convex ones first."""
    return np.argsort(~result.corner_map.convex, kind="stable")


def loop_order(result: RunResult) -> list[Loop]:
    """Give the loops in the order in which they are drawn, the largest on top."""
    return sorted(result.loops, key=_shift)


def _shift(loop: Loop) -> float:
    return float(np.hypot(*loop.shift[:2]))


def map_drawing(result: RunResult, *, layers: bool = False) -> Drawing:
    """Draw walls, corners and the way, with a line from pose to pose for each loop, coloured by how far it moved them.

    Parameters
    ----------
    result : RunResult
        With one scan or more.
    layers : bool
        With all that can be shown on the page: ellipses, the true way, and hidden the other ways.
    """
    axes = _axes(result)
    legend: list[tuple[str, str, str, bool]] = []
    at = sampled(len(result.poses))
    if layers:
        _draw_other_ways(axes, legend, result, at)
    legend.append(("way driven", SKY, "way", True))
    with axes.layer("way"):
        axes.trace(result.poses[at], SKY, 1.1)
    if len(result.wall_map.ids):
        legend.append(("wall", BLUE, "walls", True))
        with axes.layer("walls"):
            axes.segments(result.wall_map.end_points, BLUE, 1.6)
    if len(result.corner_map.ids):
        _draw_corners(axes, legend, result, ellipses=layers)
    if result.loops:
        legend.append(("loop closed", SHADES[6], "loops", True))
        with axes.layer("loops"):
            _draw_loops(axes, result)
    legend.append(("start", INK, "start", True))
    with axes.layer("start"):
        axes.dots(result.poses[:1, :2], INK, 7.0)
    axes.legend(legend)
    return drawing([axes], beside=SCALE_WIDTH if result.loops else 0.0)


def _draw_other_ways(axes: Axes, legend: list[tuple[str, str, str, bool]], result: RunResult, at: Indices) -> None:
    ways = (
        ("raw odometry", ORANGE, "odometry", result.odometry, 1.0, False),
        ("true way", INK, "truth", result.truth, 2.6, True),
        ("as known at the time", GREEN, "online", result.online_poses, 1.0, False),
    )
    for name, colour, layer, poses, width, shown in ways:
        if poses is not None and np.isfinite(poses[at]).any():
            legend.append((name, colour, layer, shown))
            with axes.layer(layer, shown=shown):
                axes.trace(poses[at], colour, width)


def _draw_corners(axes: Axes, legend: list[tuple[str, str, str, bool]], result: RunResult, *, ellipses: bool) -> None:
    corners, order = result.corner_map, corner_order(result)
    if ellipses:
        legend.append((f"{SIGMAS:g}σ of corners", VERMILION, "ellipses", True))
        with axes.layer("ellipses"):
            axes.ellipses(corners.positions[order], corners.covariances[order], SIGMAS, VERMILION)
    legend.append(("corner", VERMILION, "corners", True))
    with axes.layer("corners"):
        for convex, fill in ((True, VERMILION), (False, SHEET)):
            chosen = corners.positions[order[corners.convex[order] == convex]]
            if len(chosen):
                axes.squares(chosen, fill, VERMILION)


def _draw_loops(axes: Axes, result: RunResult) -> None:
    loops = loop_order(result)
    stamps = np.array([(loop.earlier_stamp, loop.later_stamp) for loop in loops])
    ends = np.stack([poses_at(result, stamps[:, 0])[:, :2], poses_at(result, stamps[:, 1])[:, :2]], axis=1)
    colours, low, high = shades(np.array([_shift(loop) for loop in loops]))
    axes.segments(ends, colours, 1.6)
    axes.dots(ends[:, 1], colours, 3.0)  # a loop's two poses may lie too near each other for a line to be seen
    axes.scale("loops", "loop shift (m)", low, high)


def error_map_drawing(result: RunResult, stamps: Floats, errors: Floats) -> Drawing:
    """Draw each relation's error as a dot where the robot was at its second time, the largest on top.

    Parameters
    ----------
    result : RunResult
        With one scan or more.
    stamps : ndarray, shape (n,)
        Second time of each relation, s.
    errors : ndarray, shape (n,)
        m; n is 1 or more.
    """
    axes = _axes(result)
    with axes.layer("way"):
        axes.trace(result.poses[sampled(len(result.poses))], FAINT, 0.9)
    with axes.layer("walls"):
        axes.segments(result.wall_map.end_points, GREY, 0.9)
    order = error_order(stamps, errors)
    colours, low, high = shades(errors[order])
    with axes.layer("errors"):
        axes.dots(poses_at(result, stamps[order])[:, :2], colours, 4.4)
    axes.scale("errors", "error (m)", low, high)
    return drawing([axes], beside=SCALE_WIDTH)


def error_order(stamps: Floats, errors: Floats) -> Indices:
    """Give the order in which errors are drawn: by shade, the largest on top, and in each by time."""
    colours, _, _ = shades(errors)
    return np.lexsort((stamps, np.array([SHADES.index(colour) for colour in colours])))


def _axes(result: RunResult) -> Axes:
    """Axes of one scale that hold the way and the map."""
    points = np.concatenate(
        [result.poses[:, :2], result.wall_map.end_points.reshape(-1, 2), result.corner_map.positions]
    )
    return axes_around(points)


def axes_around(points: Floats) -> Axes:
    """Axes of one scale that hold all points, shape (n, 2), m."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.03 * float((high - low).max()) + 0.05
    span = high - low + 2.0 * margin
    per_px = max(span[0] / _WIDTH, span[1] / _HEIGHT)
    missing = np.maximum(np.array([2.0 * _LEAST, _LEAST]) * per_px - span, 0.0)  # room for the legend and the scale
    low, high = low - margin - 0.5 * missing, high + margin + 0.5 * missing
    width, height = (high - low) / per_px
    return Axes((low[0], high[0]), (low[1], high[1]), width, height, labels=("x (m)", "y (m)"), unit="m", digits=2)
