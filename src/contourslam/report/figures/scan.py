"""One scan as the detector sees it: contours, responses, corners and walls."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contourslam.landmarks import Detection
from contourslam.report.figures.style import BLUE, FAINT, GREY, INK, ORANGE, SKY, VERMILION, colour, label, styled

Floats = NDArray[np.float64]

_TICK = 0.25  # m, drawn along the bisector of a corner


@styled
def scan_figure(detection: Detection, detector: str, *, threshold: float, title: str = "") -> Figure:
    """Draw a scan in the lidar's frame, and below it the detector's response along its contours.

    Parameters
    ----------
    detection : Detection
        What was found in the scan.
    detector : str
        Name of the detector.
    threshold : float
        Responses below it are no corner.
    title : str
        Put before the detector's name.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(6.4, 8.2), layout="constrained")
    plane, along = figure.subplots(2, 1, height_ratios=(3.0, 1.0))
    _draw_contours(plane, detection)
    _draw_landmarks(plane, detection)
    plane.set(xlabel="x of the lidar (m)", ylabel="y of the lidar (m)")
    plane.set_aspect("equal", adjustable="datalim")
    plane.set_title(f"{title}: {label(detector)}" if title else label(detector))
    _draw_responses(along, detection, detector, threshold)
    handles, names = plane.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower left", ncols=3)
    return figure


def _draw_contours(axes: Axes, detection: Detection) -> None:
    contours = detection.contours
    lines = [
        np.vstack([contours[i], contours[i][:1]]) if contours.closed[i] else contours[i] for i in range(len(contours))
    ]
    # Neighbours get different shades, so that one sees where a contour ends.
    shades = [(BLUE, SKY)[i % 2] for i in range(len(contours))]
    axes.add_collection(LineCollection(lines, colors=shades, linewidths=1.0, zorder=2))
    axes.plot(*contours.points.T, linestyle="none", marker=".", markersize=2.5, color=GREY, label="beam", zorder=2.1)
    axes.plot([], [], color=BLUE, label=f"contour ({len(contours)})")
    axes.plot(0.0, 0.0, marker=(3, 0, -90), markersize=11, color=INK, linestyle="none", label="lidar", zorder=4)


def _draw_landmarks(axes: Axes, detection: Detection) -> None:
    candidates, corners, walls = detection.curve.points[detection.candidates], detection.corners, detection.walls
    if len(walls.end_points):
        axes.add_collection(
            LineCollection(list(walls.end_points), colors=ORANGE, linewidths=4.0, alpha=0.45, zorder=1, label="wall")
        )
    axes.plot(*candidates.T, "x", color=INK, markersize=5, zorder=3, label="candidate")
    for convex, name in ((True, "corner, convex"), (False, "corner, concave")):
        chosen = corners.convex == convex
        face = VERMILION if convex else "white"
        axes.plot(
            *corners.positions[chosen].T,
            "s",
            markersize=5.5,
            markerfacecolor=face,
            markeredgecolor=VERMILION,
            zorder=3.5,
            label=f"{name} ({int(chosen.sum())})",
        )
    ticks = _TICK * np.stack([np.cos(corners.directions), np.sin(corners.directions)], axis=-1)
    bisectors = np.stack([corners.positions, corners.positions + ticks], axis=1)
    axes.add_collection(LineCollection(list(bisectors), colors=VERMILION, linewidths=1.2, zorder=3.4))


def _draw_responses(axes: Axes, detection: Detection, detector: str, threshold: float) -> None:
    curve = detection.curve
    place = np.arange(len(curve.points))
    for start in curve.starts[1:-1]:
        axes.axvline(float(start) - 0.5, color=FAINT, linewidth=0.7)
    axes.axhline(threshold, color=GREY, linestyle="--", linewidth=0.9)
    breaks = np.insert(detection.response.astype(np.float64), curve.starts[1:-1], np.nan)
    axes.plot(
        np.insert(place.astype(np.float64), curve.starts[1:-1], np.nan), breaks, color=colour(detector), linewidth=1.0
    )
    axes.plot(detection.candidates, detection.response[detection.candidates], "x", color=INK, markersize=5)
    axes.set(xlabel="point along the contours", ylabel="response")
    axes.set_xlim(-1, len(place))
    axes.grid(visible=False, axis="x")
    axes.annotate("threshold", (0.0, threshold), (3, 3), textcoords="offset points", fontsize=8, color=GREY)
