"""The four detectors, equations (12) to (22)."""

import math

import numpy as np
from matplotlib.figure import Figure

from contourslam.contour import Contours, equalize
from contourslam.detectors import DETECTORS, MatchedFilter, make_detector, suppress
from contourslam.detectors.curvature_scale_space import curvature
from contourslam.detectors.teh_chin import k_cosine, support_length
from contourslam.report.figures.style import (
    BLUE,
    FAINT,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    VERMILION,
    colour,
    label,
    styled,
)

from .scene import Floats, arc_length, contour_of, corner_of

SPACING = 0.06  # m, six standard deviations of a range of 1 cm


def walls(sigma: float, chance: int = 3) -> Contours:
    """A raw contour with turns of 90, -45, -90 and 60 degrees and a round bend, a point each 2 cm, with noise."""
    directions = np.concatenate(
        [
            np.repeat(np.radians([0.0, 90.0, 45.0, -45.0]), (45, 45, 45, 45)),
            np.radians(np.linspace(-45.0, 15.0, 30)),  # a bend of 0.6 m radius
            np.repeat(np.radians([15.0, 75.0]), (45, 45)),
        ]
    )
    steps = 0.02 * np.stack([np.cos(directions), np.sin(directions)], axis=1)
    points = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])
    return contour_of(points + sigma * np.random.default_rng(chance).standard_normal(points.shape))


def seen_by(contours: Contours, *, equalized: bool, sigma: float) -> Contours:
    """The contour as a detector gets it."""
    return equalize(contours, SPACING, average_below=3.0 * sigma) if equalized else contours


TRUE_TURNS = 0.9 * np.array([1.0, 2.0, 3.0]), 3.6 + 0.6 + 0.9  # m along the contour
BEND = 3.6, 4.2


@styled
def figure_responses() -> Figure:
    """All four on one noisy contour: as their sources have them, and adapted to range noise."""
    figure = Figure(figsize=(7.6, 7.4), layout="constrained")
    grid = figure.subplots(5, 2, sharex=False, height_ratios=(1.4, 1.0, 1.0, 1.0, 1.0))
    raw = walls(0.01)
    for axes, adapted in zip(grid[0], (False, True), strict=True):
        curve = seen_by(raw, equalized=adapted, sigma=0.01)
        axes.plot(*curve.points.T, ".-", color=GREY, markersize=3, linewidth=0.8)
        axes.set(aspect="equal", xlabel="x (m), " + ("equalized" if adapted else "raw points"), ylabel="y (m)")
    for row, name in zip(grid[1:], DETECTORS, strict=True):
        for axes, adapted in zip(row, (False, True), strict=True):
            detector = make_detector(name, adapted=adapted)
            curve = seen_by(raw, equalized=detector.equalized, sigma=0.01)
            response = detector.respond(curve)
            kept = suppress(response, curve, detector.threshold, detector.reach(curve))
            place = np.interp(curve.source, np.arange(len(raw.points)), 0.02 * np.arange(len(raw.points)))
            for turn in (*TRUE_TURNS[0], TRUE_TURNS[1]):
                axes.axvline(turn, color=FAINT, linewidth=4.0)
            axes.axvspan(*BEND, color="#f1f1f1")
            axes.axhline(detector.threshold, color=GREY, linestyle="--", linewidth=0.9)
            axes.plot(place, response, color=colour(name))
            axes.plot(place[kept], response[kept], "x", color=INK, markersize=6)
            axes.set_ylim(0.0, 1.15 * max(float(response.max()), 0.2))
            axes.grid(visible=False)
        row[0].set_ylabel(label(name))
    for axes, name in zip(grid[-1], ("as printed", "adapted"), strict=True):
        axes.set_xlabel(f"way along the contour (m), {name}")
    return figure


@styled
def figure_matched_filter() -> Figure:
    """Score of one template against the turn of a corner, and margins of a bank of templates."""
    figure = Figure(figsize=(7.4, 3.1), layout="constrained")
    score, margin = figure.subplots(1, 2, sharex=True)
    turns = np.linspace(0.0, 170.0, 60)

    def at_corner(detector: MatchedFilter, turn_deg: float) -> float:
        return float(detector.respond(contour_of(corner_of(math.radians(turn_deg), 12, 0.05), spacing=0.05))[12])

    printed = MatchedFilter(adapted=False)
    score.plot(
        turns,
        np.abs(np.cos(np.radians(90.0 - turns) / 2.0)),
        color=FAINT,
        linewidth=6.0,
        label="|cos((α − β)/2)|, α = 90°",
    )
    score.plot(turns, [at_corner(printed, t) for t in turns], color=BLUE, label="MatchedFilter(adapted=False)")
    score.axhline(math.sqrt(0.5), color=GREY, linestyle="--", linewidth=0.9)
    score.annotate(
        "a straight wall: 0.71", (168.0, math.sqrt(0.5)), (0, -13), textcoords="offset points", color=GREY, ha="right"
    )
    score.set(xlabel="turn β of the corner (degrees)", ylabel="score η", ylim=(0.5, 1.18), xticks=range(0, 181, 45))
    score.legend(loc="upper left")
    bank = MatchedFilter()
    for turn in bank.turns_deg:
        one = MatchedFilter(turns_deg=(turn,))
        margin.plot(turns, [at_corner(one, t) for t in turns], color=FAINT, linewidth=1.0)
    margin.plot(turns, [at_corner(bank, t) for t in turns], color=BLUE, label="MatchedFilter(), the whole bank")
    margin.plot([], [], color=FAINT, label="each of its templates")
    margin.axhline(bank.threshold, color=GREY, linestyle="--", linewidth=0.9, label="threshold")
    margin.set(xlabel="turn β of the corner (degrees)", ylabel="margin over a wall", ylim=(-0.02, 1.4))
    margin.legend(loc="upper left")
    return figure


def _noisy_corner(chance: np.random.Generator) -> Contours:
    points = corner_of(math.pi / 2, 40, 0.02)
    return contour_of(points + 0.01 * chance.standard_normal(points.shape))


@styled
def figure_support() -> Figure:
    """Where Teh and Chin's region of support ends at a right angle, with 1 cm of noise."""
    chance = np.random.default_rng(0)
    rough, even = [], []
    for _ in range(400):
        raw = _noisy_corner(chance)
        rough.append(0.02 * support_length(raw.points, 0, len(raw.points), False, 40, 1, 1000))
        smooth = equalize(raw, SPACING, average_below=0.03)
        vertex = int(np.argmin(np.abs(smooth.source - 40.0)))
        even.append(SPACING * support_length(smooth.points, 0, len(smooth.points), False, vertex, 3, 10))
    figure = Figure(figsize=(7.4, 2.8), layout="constrained")
    growth, ends = figure.subplots(1, 2)
    k = np.arange(1, 31)
    for points, shade, name in (
        (corner_of(math.pi / 2, 40, 0.02), INK, "no noise"),
        (raw.points, VERMILION, "1 cm of noise"),
    ):
        before, after = points[40 - k], points[40 + k]
        chord = after - before
        height = chord[:, 0] * (points[40, 1] - before[:, 1]) - chord[:, 1] * (points[40, 0] - before[:, 0])
        growth.plot(0.02 * k, height / (chord**2).sum(axis=1), ".-", color=shade, label=name)
    growth.set(xlabel="support k (m)", ylabel="d / l", ylim=(-1.6, 0.1))
    growth.legend(loc="lower right")
    bins = np.arange(0.0, 0.66, 0.02) - 0.001
    ends.hist(rough, bins, color=VERMILION, alpha=0.75, label="raw points, k from 1")
    ends.hist(even, bins, color=BLUE, alpha=0.75, label="equalized, k from 0.2 m")
    ends.set(xlabel="support found (m)", ylabel="of 400 corners")
    ends.legend(loc="upper center")
    return figure


@styled
def figure_k_cosine() -> Figure:
    """Short chords measure the noise: the k-cosine at a corner and on a wall."""
    chance = np.random.default_rng(1)
    k = np.arange(1, 31)
    contours = [_noisy_corner(chance).points for _ in range(200)]
    figure = Figure(figsize=(6.4, 3.1), layout="constrained")
    axes = figure.subplots()
    for at, shade, name in ((40, VERMILION, "at the corner"), (20, BLUE, "on the wall, 0.4 m before it")):
        reach = k[k <= min(at, 80 - at)]
        cosines = np.array([[k_cosine(points, 0, 81, False, at, j) for j in reach] for points in contours])
        low, middle, high = np.quantile(cosines, (0.1, 0.5, 0.9), axis=0)
        axes.fill_between(0.02 * reach, low, high, color=shade, alpha=0.2, linewidth=0.0)
        axes.plot(0.02 * reach, middle, color=shade, label=f"{name}: median, 10 % to 90 %")
    axes.axvspan(0.0, 0.2, color="#eeeeee", zorder=0)
    axes.annotate(
        "left out of the mean",
        (0.1, 1.02),
        ha="center",
        va="bottom",
        xycoords=("data", "axes fraction"),
        fontsize=9,
        color=GREY,
    )
    axes.set(xlabel="chord k (m)", ylabel="cosine", xlim=(0.0, 0.6))
    axes.legend()
    return figure


@styled
def figure_scale_space() -> Figure:
    """Curvature of one contour at three scales."""
    curve = seen_by(walls(0.01), equalized=True, sigma=0.01)
    place = arc_length(curve.points)
    figure = Figure(figsize=(7.4, 3.2), layout="constrained")
    axes = figure.subplots()
    for turn in (*TRUE_TURNS[0], TRUE_TURNS[1]):
        axes.axvline(turn, color=FAINT, linewidth=4.0)
    axes.axvspan(*BEND, color="#f1f1f1")
    for sigma, shade in ((0.06, ORANGE), (0.10, PURPLE), (0.25, GREEN)):
        kappa, _ = curvature(curve.points, 0, len(curve.points), False, sigma / SPACING)
        axes.plot(place, kappa, color=shade, label=f"σ = {sigma:.2f} m")
    axes.set(xlabel="way along the contour (m)", ylabel="curvature κ (1/m)")
    axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


@styled
def figure_suppression() -> Figure:
    """Of the points within reach the largest response stays."""
    curve = seen_by(walls(0.01), equalized=True, sigma=0.01)
    detector = make_detector("wu")
    response, reach = detector.respond(curve), detector.reach(curve)
    kept = suppress(response, curve, detector.threshold, reach)
    above = np.flatnonzero(response >= detector.threshold)
    place: Floats = arc_length(curve.points)
    figure = Figure(figsize=(7.4, 2.6), layout="constrained")
    axes = figure.subplots()
    for i in kept:
        axes.axvspan(place[max(i - reach, 0)], place[min(i + reach, len(place) - 1)], color="#e8f1f7")
    axes.axhline(detector.threshold, color=GREY, linestyle="--", linewidth=0.9, label="threshold")
    axes.plot(place, response, ".-", color=GREEN, markersize=4, linewidth=1.0, label="response of Wu")
    axes.plot(place[above], response[above], "o", color=ORANGE, markersize=5, label="above the threshold")
    axes.plot(place[kept], response[kept], "x", color=INK, markersize=9, markeredgewidth=2.0, label="candidate")
    axes.set(xlabel="way along the contour (m), shaded: reach of each candidate", ylabel="response", ylim=(0.0, 0.62))
    axes.legend(ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure
