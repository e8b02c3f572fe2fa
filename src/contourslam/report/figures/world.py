"""The constructed map (the paper's Fig. 5): corners, walls and the way driven, over the true room where it is known."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contourslam.report.figures.style import BLUE, FAINT, GREY, INK, ORANGE, VERMILION, label, styled
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

_WIDTH = 6.0  # inches
_MAX_POINTS = 2000
"""A line of more points than this is thinned: the eye cannot tell, the file can."""


@styled
def world_figure(
    result: RunResult,
    *,
    segments: Floats | None = None,
    circles: Floats | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the map of a run.

    Parameters
    ----------
    result : RunResult
        The run; one that was interrupted is marked in the title.
    segments : ndarray, shape (n, 2, 2), optional
        End points of the true room's surfaces at the lidar's height, m.
    circles : ndarray, shape (m, 3), optional
        Centre and radius of its round columns, m.
    title : str, optional
        In place of the detector's name.

    Returns
    -------
    Figure
    """
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    _draw_room(axes, segments, circles)
    if len(result.stamps):
        _draw_way(axes, result)
    draw_walls(axes, result.wall_map)
    draw_corners(axes, result.corner_map)
    axes.set_aspect("equal")
    axes.autoscale_view()
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    figure.set_size_inches(_WIDTH, float(np.clip(1.7 + 5.3 * (top - bottom) / (right - left), 2.6, 9.0)))
    axes.set(xlabel="x (m)", ylabel="y (m)")
    axes.set_title((title or label(result.detector)) + ("" if result.complete else "  (INCOMPLETE RUN)"))
    if axes.get_legend_handles_labels()[0]:
        figure.legend(loc="outside lower left", ncols=3)
    return figure


def thinned(points: Floats) -> Floats:
    """Leave out points of a line that no one would see."""
    return points[:: max(1, len(points) // _MAX_POINTS)]


def _draw_room(axes: Axes, segments: Floats | None, circles: Floats | None) -> None:
    style: dict[str, Any] = {"colors": FAINT, "linewidths": 5.0, "zorder": 1.5}
    if segments is not None and len(segments):
        axes.add_collection(LineCollection(list(segments), label="true room", capstyle="round", **style))
    if circles is not None and len(circles):
        turn = np.linspace(0.0, 2.0 * np.pi, 60)
        round_edges = circles[:, None, :2] + circles[:, None, 2:] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        axes.add_collection(LineCollection(list(round_edges), **style))


def _draw_way(axes: Axes, result: RunResult) -> None:
    axes.plot(*thinned(result.odometry)[:, :2].T, color=ORANGE, linestyle=(0, (4, 2)), label="raw odometry", zorder=2)
    if result.truth is not None:
        axes.plot(*thinned(result.truth)[:, :2].T, color=INK, linewidth=2.6, label="true path", zorder=2.1)
    axes.plot(*thinned(result.poses)[:, :2].T, color="#7cc4f0", linewidth=1.1, label="estimated path", zorder=2.2)
    axes.plot(*result.poses[0, :2], marker="o", markersize=5, color=INK, zorder=2.3)


def draw_walls(axes: Axes, walls: WallMap) -> None:
    """Draw the walls of a map."""
    if len(walls.ids):
        lines = LineCollection(list(walls.end_points), colors=BLUE, linewidths=1.8, zorder=3, label="mapped walls")
        axes.add_collection(lines)


def corner_ellipses(
    axes: Axes, corners: CornerMap, *, largest: float = 0.25, width: float = 0.9
) -> tuple[EllipseCollection, int]:
    """Two-sigma ellipses of corners, enlarged by a round factor so that they can be seen.

    Parameters
    ----------
    axes : Axes
        In which they will be drawn.
    corners : CornerMap
        One or more.
    largest : float
        What a typical ellipse's half axis may become, m.
    width : float
        Of the lines, points.

    Returns
    -------
    ellipses : EllipseCollection
    enlarged : int
        The factor.
    """
    variances, vectors = np.linalg.eigh(corners.covariances)
    sigmas = np.sqrt(np.maximum(variances, 0.0))
    radius = 2.0 * float(np.median(sigmas[:, 1]))
    enlarged = max((factor for factor in (1, 2, 5, 10, 20, 50) if factor * radius <= largest), default=1)
    widths = 4.0 * enlarged * sigmas
    ellipses = EllipseCollection(
        widths[:, 0],
        widths[:, 1],
        np.degrees(np.arctan2(vectors[:, 1, 0], vectors[:, 0, 0])),
        units="xy",
        offsets=corners.positions,
        offset_transform=axes.transData,
        facecolors="none",
        edgecolors=VERMILION,
        linewidths=width,
        zorder=4,
    )
    return ellipses, enlarged


def draw_corners(axes: Axes, corners: CornerMap) -> None:
    """Draw the corners of a map, each with its two-sigma ellipse, enlarged so that it can be seen."""
    if not len(corners.ids):
        return
    ellipses, enlarged = corner_ellipses(axes, corners)
    axes.add_collection(ellipses)
    name = "2σ of a corner" + (f", {enlarged}× enlarged" if enlarged > 1 else "")
    axes.plot([], [], "o", markersize=9, markerfacecolor="none", markeredgecolor=VERMILION, label=name)
    for filled, name in ((True, "mapped corner, convex"), (False, "mapped corner, concave")):
        chosen = corners.convex == filled
        if chosen.any():
            axes.plot(
                *corners.positions[chosen].T,
                linestyle="none",
                marker="s",
                markersize=4.5,
                markeredgecolor=VERMILION,
                markerfacecolor=VERMILION if filled else "white",
                zorder=4.1,
                label=name,
            )
    ticks = np.stack([np.cos(corners.directions), np.sin(corners.directions)], axis=-1) * 0.18
    axes.add_collection(
        LineCollection(
            list(np.stack([corners.positions, corners.positions + ticks], axis=1)),
            colors=GREY,
            linewidths=0.9,
            zorder=3.9,
        )
    )
