"""The way driven through a building: over its map with the closed loops, and with the errors at their places."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contourslam.report.figures.style import BLUE, FAINT, GREY, INK, PURPLE, VERMILION, styled
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

_WIDTH, _HEIGHT = 10.0, 8.0  # inches, at most
_MAX_POINTS = 2500
_WAY = "#7cc4f0"
_SHADES = "plasma_r"


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


@styled
def map_figure(result: RunResult) -> Figure:
    """Draw walls, corners and the way, with a line from pose to pose for each loop, coloured by how far it moved them.

    Parameters
    ----------
    result : RunResult
        With one scan or more.

    Returns
    -------
    Figure
    """
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    walls, corners = result.wall_map, result.corner_map
    if len(walls.ids):
        axes.add_collection(LineCollection(list(walls.end_points), colors=BLUE, linewidths=1.5, zorder=3, label="wall"))
    for convex, fill in ((True, VERMILION), (False, "white")):
        chosen = corners.positions[corners.convex == convex]
        name = "corner, convex" if convex else "corner, concave"
        if len(chosen):
            style: dict[str, Any] = {
                "marker": "s",
                "markersize": 3.2,
                "markeredgewidth": 0.8,
                "markeredgecolor": VERMILION,
            }
            axes.plot(*chosen.T, linestyle="none", markerfacecolor=fill, zorder=4, label=name, **style)
    axes.plot(*_thinned(result.poses)[:, :2].T, color=_WAY, linewidth=0.9, zorder=2, label="way driven")
    axes.plot(*result.poses[0, :2], marker="o", markersize=6, color=INK, linestyle="none", zorder=6, label="start")
    if result.loops:
        _draw_loops(figure, axes, result)
    _fit(figure, axes)
    figure.legend(loc="outside lower left", ncols=5)
    return figure


def _draw_loops(figure: Figure, axes: Axes, result: RunResult) -> None:
    shifts = np.array([np.hypot(*loop.shift[:2]) for loop in result.loops])
    ends = np.stack(
        [
            poses_at(result, np.array([loop.earlier_stamp for loop in result.loops]))[:, :2],
            poses_at(result, np.array([loop.later_stamp for loop in result.loops]))[:, :2],
        ],
        axis=1,
    )
    order = np.argsort(shifts)  # the largest on top
    colours = _shades(shifts)
    shades = colours.to_rgba(shifts[order])
    axes.add_collection(LineCollection(list(ends[order]), colors=shades, linewidths=1.6, zorder=5))
    # A loop's two poses may lie too near each other for a line to be seen.
    axes.scatter(ends[order, 1, 0], ends[order, 1, 1], s=9, color=shades, zorder=5.1)
    axes.plot([], [], ".-", color=PURPLE, label="loop closed")
    figure.colorbar(colours, ax=axes, label="shift of the pose by the loop (m)", shrink=0.6, pad=0.01, format="{x:g}")


@styled
def error_map_figure(result: RunResult, stamps: Floats, errors: Floats) -> Figure:
    """Draw each relation's error as a dot where the robot was at its second time, the largest on top.

    Parameters
    ----------
    result : RunResult
        With one scan or more.
    stamps : ndarray, shape (n,)
        Second time of each relation, s.
    errors : ndarray, shape (n,)
        m; n is 1 or more.

    Returns
    -------
    Figure
    """
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    if len(result.wall_map.ids):
        axes.add_collection(LineCollection(list(result.wall_map.end_points), colors=GREY, linewidths=0.9, zorder=2))
    axes.plot(*_thinned(result.poses)[:, :2].T, color=FAINT, linewidth=0.8, zorder=1)
    order = np.argsort(errors)
    places = poses_at(result, stamps[order])
    colours = _shades(errors)
    shades = colours.to_rgba(errors[order])
    axes.scatter(places[:, 0], places[:, 1], s=14, color=shades, linewidths=0, zorder=3, rasterized=True)
    figure.colorbar(colours, ax=axes, label="relation error (m)", shrink=0.6, pad=0.01, format="{x:g}")
    _fit(figure, axes)
    return figure


def _shades(values: Floats) -> ScalarMappable:
    """Colours on a logarithmic scale between the values' own bounds."""
    low, high = np.quantile(values, [0.02, 1.0])
    low = max(float(low), 1e-3)
    norm: Normalize = LogNorm(low, max(float(high), 1.1 * low))
    return ScalarMappable(norm, _SHADES)


def _thinned(points: Floats) -> Floats:
    return points[:: max(1, len(points) // _MAX_POINTS)]


def _fit(figure: Figure, axes: Axes) -> None:
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set(xlabel="x (m)", ylabel="y (m)")
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    height = 1.2 + 8.2 * (top - bottom) / (right - left)
    width = _WIDTH if height <= _HEIGHT else max(5.0, 1.8 + (_HEIGHT - 1.2) * (right - left) / (top - bottom))
    figure.set_size_inches(width, float(np.clip(height, 3.0, _HEIGHT)))
