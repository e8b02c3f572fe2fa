"""Bars and lines that set the detectors side by side: error, noise, refinement, timings."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contourslam.report.figures.style import BLUE, FAINT, GREY, INK, ORANGE, colour, label, logarithmic, styled

Floats = NDArray[np.float64]

_MARKERS = "osD^v"
# Tol's muted scheme (2021): ten stages that the colour-blind, too, can tell apart.
_STAGES = ["#332288", "#88ccee", "#44aa99", "#117733", "#999933", "#ddcc77", "#cc6677", "#882255", "#aa4499", "#767676"]


@styled
def rmse_figure(
    rmse: Mapping[str, tuple[float, float]], paper: Mapping[str, float], *, odometry: float, bound: float | None = None
) -> Figure:
    """Draw each detector's position error beside the paper's, on a logarithmic scale (so points: bars need a zero).

    Parameters
    ----------
    rmse : mapping of str to (float, float)
        Mean and standard deviation over the seeds of the position RMSE, per detector, m.
    paper : mapping of str to float
        The paper's, where it has one, m.
    odometry : float
        Raw odometry's, m.
    bound : float, optional
        The Cramér-Rao bound of a scan in the known room, m.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(6.0, 3.2), layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(rmse))
    means, spreads = 100.0 * np.array(list(rmse.values())).reshape(-1, 2).T
    theirs = 100.0 * np.array([paper.get(name, np.nan) for name in rmse])
    axes.hlines(place, means, theirs, color=FAINT, linewidth=2.0, zorder=2)
    axes.plot(theirs, place, "D", color=GREY, markersize=7, label="paper")
    whiskers = np.stack([np.minimum(spreads, 0.9 * means), spreads])  # below zero a log axis has no place
    axes.errorbar(means, place, xerr=whiskers, fmt="none", ecolor=INK, elinewidth=1.0, capsize=3.0, zorder=2.5)
    axes.scatter(means, place, s=80, c=[colour(name) for name in rmse], label="here", zorder=3)
    for x, y in [*zip(means, place, strict=True), *zip(theirs, place, strict=True)]:
        if np.isfinite(x):
            axes.annotate(f"{x:.2g}", (x, y), (0, 8), textcoords="offset points", ha="center", fontsize=8.5)
    axes.axvline(100.0 * odometry, color=ORANGE, linestyle="--", label="raw odometry")
    if bound is not None:
        axes.axvline(100.0 * bound, color=GREY, linestyle=":", label="Cramér-Rao bound")
    logarithmic(axes, "x")
    axes.set_yticks(place, [label(name) for name in rmse])
    axes.set_ylim(len(rmse) - 0.5, -0.6)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("RMSE of the position (cm)")
    figure.legend(loc="outside lower left", ncols=4)
    return figure


@styled
def noise_figure(levels: Floats, rmse: Mapping[str, Floats], *, odometry: float | None = None) -> Figure:
    """Draw position and heading error against the lidar's range noise.

    Parameters
    ----------
    levels : ndarray, shape (n,)
        Standard deviation of the range noise, m.
    rmse : mapping of str to ndarray, shape (n, 3)
        RMSE of x (m), y (m) and heading (rad) at each level, per detector.
    odometry : float, optional
        Raw odometry's position RMSE, m.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(6.0, 5.0), layout="constrained")
    position, heading = figure.subplots(2, 1, sharex=True)
    for i, (name, errors) in enumerate(rmse.items()):
        style = {"color": colour(name), "marker": _MARKERS[i % len(_MARKERS)], "markersize": 5}
        x = 100.0 * levels + 0.05 * (i - 0.5 * (len(rmse) - 1))  # side by side: equal lines would hide each other
        position.plot(x, 100.0 * np.hypot(errors[:, 0], errors[:, 1]), label=label(name), **style)
        heading.plot(x, np.degrees(errors[:, 2]), **style)
    if odometry is not None:
        position.axhline(100.0 * odometry, color=ORANGE, linestyle="--", label="raw odometry")
    for axes, name in ((position, "position RMSE (cm)"), (heading, "heading RMSE (°)")):
        logarithmic(axes, "y")
        axes.set_ylabel(name)
    heading.set_xlabel("standard deviation of the range noise (cm)")
    figure.legend(loc="outside lower left", ncols=3)
    return figure


@styled
def pair_figure(
    first: Mapping[str, float], second: Mapping[str, float], *, names: tuple[str, str], ylabel: str, scale: float = 1.0
) -> Figure:
    """Draw two bars per detector, such as the error with raw and with refined corners.

    Parameters
    ----------
    first, second : mapping of str to float
        The two values of each detector.
    names : tuple of str
        What the two are.
    ylabel : str
        Axis label, with the unit after `scale`.
    scale : float
        Values are multiplied by this.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(6.0, 3.2), layout="constrained")
    axes = figure.add_subplot()
    place = np.arange(len(first))
    for values, name, shift, fill in ((first, names[0], -0.2, FAINT), (second, names[1], 0.2, BLUE)):
        bars = axes.bar(place + shift, [scale * values[key] for key in first], 0.38, color=fill, label=name)
        axes.bar_label(bars, fmt="%.2g", fontsize=8.5, padding=2)
    axes.set_xticks(place, [label(key) for key in first])
    axes.grid(visible=False, axis="x")
    axes.set_ylabel(ylabel)
    axes.margins(y=0.12)
    figure.legend(loc="outside upper left", ncols=2)
    return figure


@styled
def timing_figure(stages: Mapping[str, Mapping[str, float]], order: Sequence[str] = ()) -> Figure:
    """Draw the time a scan takes, stage by stage.

    Parameters
    ----------
    stages : mapping of str to mapping of str to float
        Time per scan of each stage, per detector, s.
    order : sequence of str
        Stages from left to right; others follow.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(6.0, 3.0), layout="constrained")
    axes = figure.add_subplot()
    names = list(stages)
    known = list(dict.fromkeys([*order, *(stage for one in stages.values() for stage in one)]))
    place, left = np.arange(len(names)), np.zeros(len(names))
    for i, stage in enumerate(known):
        width = 1e3 * np.array([stages[name].get(stage, 0.0) for name in names])
        axes.barh(place, width, 0.62, left=left, color=_STAGES[i % len(_STAGES)], label=stage)
        left += width
    for y, total in zip(place, left, strict=True):
        axes.annotate(f"{total:.2f}", (total, y), (4, 0), textcoords="offset points", va="center", fontsize=8.5)
    axes.set_yticks(place, [label(name) for name in names])
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.margins(x=0.12)
    axes.set_xlabel("time per scan on one core (ms)")
    figure.legend(loc="outside lower left", ncols=4)
    return figure
