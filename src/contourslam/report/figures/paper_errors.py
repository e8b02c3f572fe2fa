"""Errors and consistency of runs as a paper takes them: no titles, as wide as a column."""

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contourslam.evaluation.consistency import chi_square_bounds
from contourslam.evaluation.errors import pose_errors
from contourslam.report.figures.paper import legend_below, line_style, spread_logarithmic, verbatim
from contourslam.report.figures.style import BLUE, FAINT, GREY, SINGLE, for_paper
from contourslam.report.runs_groups import Errors
from contourslam.report.svg.series import pieces
from contourslam.report.svg.way import sampled
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

_LEAST = {"m": 1e-4, "°": 1e-3}
"""Errors below it are drawn at it: a logarithmic scale has no zero."""
_PIECES = 150


@for_paper
def differences_figure(differences: Mapping[str, tuple[Floats, Floats, Floats]], *, width: float = SINGLE) -> Figure:
    """Draw over time how far poses lie from those of one run.

    Parameters
    ----------
    differences : mapping of str to (ndarray, ndarray, ndarray), each of shape (n,)
        Time (s), distance (m) and turn (rad) per run.
    width : float
        Inches.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(width, 2.6), layout="constrained")
    position, heading = figure.subplots(2, 1, sharex=True)
    largest = max((float(distance.max()) for _, distance, _ in differences.values()), default=0.0)
    scale, unit = (100.0, "cm") if largest >= 0.01 else (1000.0, "mm")
    for i, (name, (times, distance, turn)) in enumerate(differences.items(), start=1):
        for axes, values in ((position, scale * distance), (heading, np.degrees(turn))):
            axes.plot(*pieces(times, values, _PIECES)[:2], **line_style(i), label=verbatim(name))
    for axes, label in ((position, f"distance ({unit})"), (heading, "turn (°)")):
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
    heading.set_xlabel("time (s)")
    figure.align_ylabels()
    return legend_below(figure, position, 2)


@for_paper
def distribution_figure(errors: Errors, *, width: float = SINGLE) -> Figure:
    """Draw which part of the errors is below a value: the cumulative distribution, over a logarithmic scale.

    Parameters
    ----------
    errors : Errors
        What is not finite is left out.
    width : float
        Inches.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(width, 2.3), layout="constrained")
    axes, least = figure.add_subplot(), _LEAST[errors.unit]
    for i, (name, values) in enumerate(errors.of.items()):
        known = np.sort(np.maximum(values[np.isfinite(values)], least))
        share = np.arange(1, len(known) + 1) / max(len(known), 1)
        at = np.unique(np.linspace(0, len(known) - 1, 600).astype(np.intp)) if len(known) else np.zeros(0, np.intp)
        axes.plot(known[at], share[at], **line_style(i), label=verbatim(name))
    together = np.concatenate([values[np.isfinite(values)] for values in errors.of.values()])
    if len(together):
        low, high = np.quantile(together, (0.005, 1.0)).tolist()
        axes.set_xlim(max(low, least), max(high, 2.0 * max(low, least)))
    spread_logarithmic(axes, "x")
    xlabel = f"{errors.measure} ({errors.unit})"
    axes.set(xlabel=xlabel, ylabel="share of the errors below", ylim=(0.0, 1.0))
    return legend_below(figure, axes, 2)


@for_paper
def relation_figure(times: Floats, errors: Mapping[str, Floats], *, width: float = SINGLE) -> Figure:
    """Draw errors of relations over time: medians of pieces, on a logarithmic scale, the first with its middle 90 %.

    Parameters
    ----------
    times : ndarray, shape (n,)
        s.
    errors : mapping of str to ndarray, shape (n,)
        Per kind, m.
    width : float
        Inches.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(width, 2.1), layout="constrained")
    axes = figure.add_subplot()
    for i, (name, values) in enumerate(errors.items()):
        at, middle, low, high = pieces(times, np.maximum(values, _LEAST["m"]), 60)
        if i == 0:
            axes.fill_between(at, low, high, color=FAINT, alpha=0.7, linewidth=0.0, label=f"{name}, middle 90 %")
        axes.plot(at, middle, **line_style(i), label=name)
    spread_logarithmic(axes, "y")
    axes.set(xlabel="time (s)", ylabel="relation error (m)")
    return legend_below(figure, axes, 2)


@for_paper
def truth_figure(result: RunResult, *, aligned: bool = False, width: float = SINGLE) -> Figure:
    """Draw the error of x, y and heading over time inside the bounds of two standard deviations.

    Parameters
    ----------
    result : RunResult
        With true poses.
    aligned : bool
        As :func:`contourslam.evaluation.errors.pose_errors`.
    width : float
        Inches.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(width, 3.0), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    truth = result.poses if result.truth is None else result.truth
    errors, times = pose_errors(result.poses, truth, aligned=aligned), result.stamps - result.stamps.min()
    at = sampled(len(times))
    for i, (axes, name, scale) in enumerate(
        zip(panels, ("x (cm)", "y (cm)", "heading (°)"), (100.0, 100.0, math.degrees(1.0)), strict=True)
    ):
        sigma, error = scale * np.sqrt(np.maximum(result.covariances[:, i, i], 0.0)), scale * errors[:, i]
        low, high = -2.0 * sigma[at], 2.0 * sigma[at]
        axes.fill_between(times[at], low, high, color=FAINT, alpha=0.7, linewidth=0.0, label="±2σ")
        axes.plot(times[at], error[at], color=BLUE, linewidth=0.6, label="error")
        axes.set_ylabel(name)
        known = np.abs(error[np.isfinite(error)])
        limit = 1.25 * max(float(np.quantile(2.0 * sigma, 0.98)), float(np.quantile(known, 0.995)), 1e-6)
        axes.set_ylim(-limit, limit)
    panels[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    return legend_below(figure, panels[0], 2)


@for_paper
def nis_figure(runs: Mapping[str, RunResult], *, width: float = SINGLE) -> Figure:
    """Draw the normalised innovation squared per degree of freedom over time, with the band of a consistent filter.

    Each point is the mean over a piece of the run; the band holds 95 % of such means, those of the first filter's
    pieces, were all innovations independent. The graph's NIS is of contours against wheels, which it takes for worse
    than they are: well below 1 is usual, it has no band, and the legend says what it is.

    Parameters
    ----------
    runs : mapping of str to RunResult
        With a correction or more each.
    width : float
        Inches.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(width, 2.1), layout="constrained")
    axes = figure.add_subplot()
    for i, (name, result) in enumerate(runs.items()):
        used = (result.nis_dof > 0) & np.isfinite(result.nis)
        times = (result.stamps - result.stamps.min())[used]
        parts = np.array_split(np.argsort(times, kind="stable"), max(1, min(_PIECES, int(used.sum()) // 5)))
        nis, dof = (np.array([column[used][part].sum() for part in parts]) for column in (result.nis, result.nis_dof))
        at = np.array([times[part].mean() for part in parts])
        graph = result.back_end == "graph"
        if not (graph or axes.collections):
            low, high = chi_square_bounds(dof)
            name_of_band = "95 %, if consistent"
            axes.fill_between(at, low / dof, high / dof, color=FAINT, alpha=0.7, linewidth=0.0, label=name_of_band)
            axes.axhline(1.0, color=GREY, linewidth=0.5)
        label = verbatim(name) + ": contours against wheels" * graph
        axes.plot(at, nis / dof, **(line_style(i) | {"linewidth": 0.7}), label=label)
    spread_logarithmic(axes, "y")
    axes.set(xlabel="time (s)", ylabel="NIS per degree of freedom")
    return legend_below(figure, axes, 2)
