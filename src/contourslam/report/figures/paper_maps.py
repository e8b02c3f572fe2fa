"""Maps and trajectories as a paper takes them: no titles, as wide as a column."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contourslam.report.figures.paper import legend_below, line_style, verbatim
from contourslam.report.figures.style import BLUE, FAINT, GREY, INK, SINGLE, VERMILION, for_paper
from contourslam.report.figures.world import corner_ellipses, thinned
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]


@for_paper
def map_figure(result: RunResult, *, width: float = SINGLE) -> Figure:
    """Draw the map of a run: walls, corners with their ellipses, the way driven and, where known, the true one.

    Parameters
    ----------
    result : RunResult
        With one scan or more.
    width : float
        Inches.

    Returns
    -------
    Figure
    """
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    _draw_map(axes, result.wall_map, result.corner_map, result.poses)
    if result.truth is not None:
        axes.plot(*thinned(result.truth)[:, :2].T, color=GREY, linewidth=1.6, zorder=1.9, label="true path")
    axes.set(xlabel="x (m)", ylabel="y (m)")
    _fit_plane(figure, [axes], width)
    return legend_below(figure, axes, 3 if width > 5.0 else 2)


@for_paper
def maps_figure(
    maps: Mapping[str, tuple[WallMap, CornerMap, Floats]], *, width: float = SINGLE, columns: int = 2
) -> Figure:
    """Draw maps side by side, all to one scale.

    Parameters
    ----------
    maps : mapping of str to (WallMap, CornerMap, ndarray of shape (t, 3))
        Walls, corners and poses per run, all in one world.
    width : float
        Inches.
    columns : int
        How many stand side by side.

    Returns
    -------
    Figure
    """
    rows = math.ceil(len(maps) / columns)
    figure = Figure(layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    panels = list(grid.flat)
    for axes, (name, (walls, corners, poses)) in zip(panels, maps.items(), strict=False):
        _draw_map(axes, walls, corners, poses, small=True)
        axes.set_title(verbatim(name))
    for axes in panels[len(maps) :]:
        axes.set_visible(False)
    for axes in grid[-1]:
        axes.set_xlabel("x (m)")
    for axes in grid[:, 0]:
        axes.set_ylabel("y (m)")
    _fit_plane(figure, panels, width, rows, columns)
    return figure


@for_paper
def ways_figure(ways: Mapping[str, Floats], walls: Floats, *, width: float = SINGLE) -> Figure:
    """Lay trajectories over one another.

    Parameters
    ----------
    ways : mapping of str to ndarray, shape (t, 3)
        Poses per run, all in one world.
    walls : ndarray, shape (w, 2, 2)
        Ends of walls, drawn faintly, for the eye to hold on to.
    width : float
        Inches.

    Returns
    -------
    Figure
    """
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    axes.add_collection(LineCollection(list(walls), colors=FAINT, linewidths=0.6, zorder=1.5))
    for i, (name, poses) in enumerate(ways.items()):
        axes.plot(
            *thinned(poses)[:, :2].T, **(line_style(i) | {"linewidth": 0.7}), zorder=2 + 0.01 * i, label=verbatim(name)
        )
    axes.set(xlabel="x (m)", ylabel="y (m)")
    _fit_plane(figure, [axes], width)
    return legend_below(figure, axes, 2)


def _draw_map(axes: Axes, walls: WallMap, corners: CornerMap, poses: Floats, *, small: bool = False) -> None:
    points = np.concatenate([poses[:, :2], walls.end_points.reshape(-1, 2), corners.positions])
    width = 0.3 if small else 0.5
    axes.plot(*thinned(poses)[:, :2].T, color=BLUE, linewidth=width, alpha=0.8, zorder=2, label="path")
    lines = LineCollection(list(walls.end_points), colors=INK, linewidths=0.7 if small else 1.1, zorder=3)
    lines.set_label("wall")
    axes.add_collection(lines)
    if not len(corners.ids):
        return
    if not small:
        largest = max(0.25, 0.012 * float(np.ptp(points, axis=0).max()))
        ellipses, enlarged = corner_ellipses(axes, corners, largest=largest, width=0.6)
        axes.add_collection(ellipses)
        name = "corner, 2σ" + (f" × {enlarged}" if enlarged > 1 else "")
        axes.plot([], [], "o", markersize=5, markerfacecolor="none", markeredgecolor=VERMILION, label=name)
    for filled, name in ((True, "corner, convex"), (False, "corner, concave")):
        chosen = corners.convex == filled
        if chosen.any():
            axes.plot(
                *corners.positions[chosen].T,
                linestyle="none",
                marker="s",
                markersize=1.2 if small else 2.2,
                markeredgewidth=width,
                markeredgecolor=VERMILION,
                markerfacecolor=VERMILION if filled else "white",
                zorder=4.1,
                label=name,
            )


def _fit_plane(figure: Figure, panels: Sequence[Axes], width: float, rows: int = 1, columns: int = 1) -> None:
    """Give axes of one scale the height that their width leaves them."""
    for axes in panels:
        axes.set_aspect("equal")
        axes.autoscale_view()
    (left, right), (bottom, top) = panels[0].get_xlim(), panels[0].get_ylim()
    beside = 0.5 + 0.12 * (columns - 1)  # inches that labels take
    height = (width - beside) / columns * (top - bottom) / (right - left)
    figure.set_size_inches(width, float(np.clip(rows * (height + 0.2 * (rows > 1)) + 0.75, 1.5, 9.0)))
