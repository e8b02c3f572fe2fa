"""The way driven through a building: over its map with the closed loops, and with the errors at their places."""

import numpy as np
from numpy.typing import NDArray

from contourslam.report.svg.axes import BLUE, FAINT, GREY, INK, PURPLE, SKY, VERMILION, Axes, shades
from contourslam.report.svg.drawing import SCALE_WIDTH, Drawing, drawing
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

_WIDTH, _HEIGHT, _LEAST = 840.0, 700.0, 180.0  # px, of the axes
_MAX_POINTS = 2500


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


def map_drawing(result: RunResult) -> Drawing:
    """Draw walls, corners and the way, with a line from pose to pose for each loop, coloured by how far it moved them.

    Parameters
    ----------
    result : RunResult
        With one scan or more.
    """
    axes = _axes(result)
    legend = [("way driven", SKY)]
    _draw_way(axes, result, SKY)
    if len(result.wall_map.ids):
        legend.append(("wall", BLUE))
        axes.segments(result.wall_map.end_points, BLUE, 1.6)
    for convex, fill in ((True, VERMILION), (False, "white")):
        chosen = result.corner_map.positions[result.corner_map.convex == convex]
        if len(chosen):
            legend.append((f"corner, {'convex (filled)' if convex else 'concave'}", VERMILION))
            axes.squares(chosen, fill, VERMILION)
    if result.loops:
        legend.append(("loop closed", PURPLE))
        _draw_loops(axes, result)
    legend.append(("start", INK))
    axes.dots(result.poses[:1, :2], INK, 7.0)
    axes.legend(legend)
    return drawing([axes], beside=SCALE_WIDTH if result.loops else 0.0)


def _draw_loops(axes: Axes, result: RunResult) -> None:
    shifts = np.array([np.hypot(*loop.shift[:2]) for loop in result.loops])
    order = np.argsort(shifts, kind="stable")  # the largest on top
    stamps = np.array([(loop.earlier_stamp, loop.later_stamp) for loop in result.loops])[order]
    ends = np.stack([poses_at(result, stamps[:, 0])[:, :2], poses_at(result, stamps[:, 1])[:, :2]], axis=1)
    colours, low, high = shades(shifts[order])
    axes.segments(ends, colours, 1.6)
    axes.dots(ends[:, 1], colours, 3.0)  # a loop's two poses may lie too near each other for a line to be seen
    axes.scale("shift by the loop (m)", low, high)


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
    _draw_way(axes, result, FAINT)
    axes.segments(result.wall_map.end_points, GREY, 0.9)
    order = np.argsort(errors, kind="stable")
    colours, low, high = shades(errors[order])
    axes.dots(poses_at(result, stamps[order])[:, :2], colours, 4.4)
    axes.scale("relation error (m)", low, high)
    return drawing([axes], beside=SCALE_WIDTH)


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
    return Axes((low[0], high[0]), (low[1], high[1]), width, height, labels=("x (m)", "y (m)"))


def _draw_way(axes: Axes, result: RunResult, colour: str) -> None:
    way = result.poses[:: max(1, len(result.poses) // _MAX_POINTS)]
    axes.line(way[:, 0], way[:, 1], colour, 0.9)
