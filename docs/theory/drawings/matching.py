"""Contours aligned to contours, and what that says of the pose."""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib.figure import Figure

from contourslam.config import Config
from contourslam.geometry.poses import between_one, compose_one
from contourslam.landmarks import trace
from contourslam.matching.align import NARROW, POINT_SIGMA, WIDE, align
from contourslam.matching.cell_map import CellMap, nearest
from contourslam.matching.certainty import hold, match_covariance, pull
from contourslam.matching.oriented import move, oriented_points
from contourslam.matching.small import invert, turned
from contourslam.report.figures.style import BLUE, FAINT, GREEN, GREY, INK, ORANGE, VERMILION, styled
from contourslam.simulation.rooms import FURNISHED_ROOM

from .scene import LIDAR_HEIGHT, NO_CIRCLES, Floats, draw_robot, outline, scan_of

SIGMA = 0.01  # m
WHEELS = np.array([0.03, 0.01, math.radians(1.0)])  # standard deviations of a step of the wheels: m, m, rad
STEP = np.array([0.4, 0.0, 0.0])
PLACES = {
    "room": (FURNISHED_ROOM.segments(LIDAR_HEIGHT), FURNISHED_ROOM.circles(LIDAR_HEIGHT), np.array([2.2, 4.4, 0.2])),
    "corridor": (outline((-40.0, -1.0), (40.0, -1.0), (40.0, 1.0), (-40.0, 1.0)), NO_CIRCLES, np.zeros(3)),
}


def points_seen(place: str, pose: Floats, chance: int | np.random.Generator) -> Floats:
    """Contour points with normals of one scan."""
    segments, circles, _ = PLACES[place]
    return oriented_points(
        trace(scan_of(segments, pose, sigma=SIGMA, beams=360, chance=chance, circles=circles), Config())
    )


def map_of(oriented: Floats) -> CellMap:
    """Contour map of one scan."""
    cells = CellMap(np.zeros(3), 32.0)
    cells.insert(oriented, np.zeros(3))
    return cells


@styled
def figure_alignment() -> Figure:
    """A scan where it was guessed and where it fits, with the distances that are made small; and the kernel."""
    chance = np.random.default_rng(0)
    start = np.array([4.4, 4.9, 3.0])
    cells = map_of(points_seen("room", start, chance))
    true = np.array([0.35, 0.1, 0.1])
    scan = points_seen("room", compose_one(start, true), chance)
    guess = true + np.array([0.12, -0.13, 0.09])
    figure = Figure(figsize=(7.4, 3.0), layout="constrained")
    *panes, weights = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 0.9))
    for axes, pose, name in zip(
        panes, (guess, align(scan, cells, guess, 4.0 * np.eye(3)).pose), ("guessed", "aligned"), strict=True
    ):
        moved = move(scan, pose)
        axes.plot(*cells.points[:, :2].T, ".", color=GREY, markersize=3)
        axes.plot(*moved[:, :2].T, ".", color=BLUE, markersize=3)
        for x, y, nx, ny in moved:
            row = nearest(cells.index, cells.tiles, x - cells.x0, y - cells.y0)
            if row >= 0 and nx * cells.points[row, 2] + ny * cells.points[row, 3] > 0.7:
                n = cells.points[row, 2:4]
                d = n @ ([x, y] - cells.points[row, :2])
                axes.plot([x, x - d * n[0]], [y, y - d * n[1]], color=VERMILION, linewidth=1.2)
        draw_robot(axes, pose, BLUE)
        axes.set(xlabel=f"x (m), {name}", aspect="equal", xlim=(-1.6, 2.6), ylim=(-2.0, 2.5))
    panes[0].set_ylabel("y (m)")
    d = np.linspace(-0.4, 0.4, 200)
    for width, shade in ((WIDE, ORANGE), (NARROW, BLUE)):
        weights.plot(d, (1.0 + (d / width) ** 2) ** -2.0, color=shade, label=f"s = {width:.2f} m")
    weights.set(xlabel="distance d (m)", ylabel="weight w")
    weights.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


@styled
def figure_pull() -> Figure:
    """Pull of a map on a scan that is pushed along x: as it grows, and as a sum of squares would have it."""
    figure = Figure(figsize=(7.4, 2.9), layout="constrained")
    for axes, place in zip(figure.subplots(1, 2), PLACES, strict=True):
        chance, pose = np.random.default_rng(1), PLACES[place][2]
        cells, scan = map_of(points_seen(place, pose, chance)), points_seen(place, compose_one(pose, STEP), chance)
        best = align(scan, cells, STEP, np.diag(1.0 / WHEELS**2)).pose
        pulls, parts = np.empty((6, 3)), np.empty((6, 3, 3))
        table = cells.index, cells.tiles, cells.rows, cells.x0, cells.y0
        pull(*table, scan, best, 0.0, pulls, parts)
        slope, pushes, found = parts[:, 0, 0].sum(), np.linspace(-0.1, 0.1, 41), []
        for push in pushes:
            pull(*table, scan, best + np.array([push, 0.0, 0.0]), 0.0, pulls, parts)
            found.append(pulls[:, 0].sum())
        axes.plot(100 * pushes, slope * pushes, color=VERMILION, linestyle="--", label="sum of squares, H")
        axes.plot(100 * pushes, found, color=BLUE, label="partners found anew")
        axes.axvspan(-1.0, 1.0, color="#eeeeee", zorder=0)
        axes.set(xlabel=f"push along x (cm), {place}", ylabel="pull along x", ylim=(-0.06 * slope, 0.06 * slope))
        axes.legend(loc="upper left")
    return figure


@dataclass(frozen=True)
class Trials:
    """Errors of many alignments and the covariances stated for them, both in the scan's frame."""

    errors: Floats
    naive: Floats
    measured: Floats
    combined: Floats


@cache
def trials(place: str, count: int = 60) -> Trials:
    """Align a scan to a map of another one, with wheels that err, again and again."""
    chance, prior = np.random.default_rng(5), np.diag(1.0 / WHEELS**2)
    rows = []
    start = PLACES[place][2]
    for _ in range(count):
        first, scan = points_seen(place, start, chance), points_seen(place, compose_one(start, STEP), chance)
        cells = map_of(first)
        found = align(scan, cells, STEP + WHEELS * chance.standard_normal(3), prior)
        naive = turned(invert(found.information * (POINT_SIGMA / SIGMA) ** 2 + 1e-9 * np.eye(3)), -found.pose[2])
        own, other = hold(scan, cells, found.pose), hold(first, cells, np.zeros(3), inside=True)
        measured = match_covariance(own, found.pose, other, np.zeros(3))
        rows.append((between_one(STEP, found.pose), naive, measured, invert(invert(measured) + prior)))
    return Trials(*(np.array(column) for column in zip(*rows, strict=True)))


@styled
def figure_honesty() -> Figure:
    """How far alignments lie off, and what is stated of it, in a room and along a bare corridor."""
    figure = Figure(figsize=(7.4, 3.2), layout="constrained")
    panes = figure.subplots(1, 2, sharey=True)
    bars = (
        (INK, "error, RMS"),
        (VERMILION, "stated by a sum of squares"),
        (BLUE, "measured"),
        (GREEN, "measured, with the wheels"),
    )
    for axes, place in zip(panes, PLACES, strict=True):
        t = trials(place)
        off = np.sqrt(np.linalg.eigvalsh(t.errors[:, :2].T @ t.errors[:, :2] / len(t.errors)))
        stated = [
            np.sqrt(np.median(np.linalg.eigvalsh(c[:, :2, :2]), axis=0)) for c in (t.naive, t.measured, t.combined)
        ]
        for k, (values, (shade, name)) in enumerate(zip((off, *stated), bars, strict=True)):
            axes.bar(np.arange(2) + 0.2 * (k - 1.5), 1e3 * values[::-1], 0.19, color=shade, label=name)
        axes.set(xticks=[0, 1], xticklabels=["widest direction", "narrowest"], xlabel=place, yscale="log")
        axes.grid(visible=False, axis="x")
    panes[0].set_ylabel("standard deviation (mm)")
    figure.legend(
        *axes.get_legend_handles_labels(), loc="outside upper left", ncols=4, columnspacing=1.0, handlelength=1.0
    )
    return figure


@styled
def figure_corridor() -> Figure:
    """A scan of a bare corridor fits where it is and where it is not."""
    chance = np.random.default_rng(3)
    cells = map_of(points_seen("corridor", np.zeros(3), chance))
    scan = points_seen("corridor", np.array([0.4, 0.0, 0.0]), chance)
    figure = Figure(figsize=(7.4, 3.0), layout="constrained")
    for axes, x in zip(figure.subplots(2, 1, sharex=True), (0.4, 1.4), strict=True):
        found = align(scan, cells, np.array([x, 0.0, 0.0]), np.diag(1.0 / WHEELS**2))
        axes.plot(*cells.points[:, :2].T, ".", color=FAINT, markersize=6)
        axes.plot(*move(scan, found.pose)[:, :2].T, ".", color=BLUE, markersize=2.5)
        draw_robot(axes, found.pose, BLUE)
        draw_robot(axes, (0.4, 0.0, 0.0), INK, fillstyle="none")
        text = f"guess {x:.1f} m: {100 * found.overlap:.0f} % of the points fit, RMS {1e3 * found.residual:.0f} mm"
        axes.annotate(text, (0.98, 0.5), xycoords="axes fraction", ha="right", va="center", fontsize=9.5)
        axes.set(ylabel="y (m)", xlim=(-6.5, 9.5), ylim=(-1.4, 1.4))
    axes.set_xlabel("x (m)")
    return figure
