"""Errors of the pose over time with the filter's two-sigma bounds (the paper's Fig. 6), and its NEES."""

import math
from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.report.figures.style import FAINT, GREY, colour, label, logarithmic, styled
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]


@styled
def error_figure(result: RunResult) -> Figure:
    """Draw the error of x, y and heading over time inside the bounds the filter claims.

    Parameters
    ----------
    result : RunResult
        A run with true poses.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(6.0, 5.4), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    truth = result.poses if result.truth is None else result.truth
    errors = result.poses - truth
    errors[:, 2] = wrap(errors[:, 2])
    time = result.stamps - result.stamps[:1]
    for i, (axes, name, unit, scale) in enumerate(
        zip(panels, ("x", "y", "θ"), ("cm", "cm", "°"), (100.0, 100.0, math.degrees(1.0)), strict=True)
    ):
        sigma = scale * np.sqrt(np.maximum(result.covariances[:, i, i], 0.0))
        error = scale * errors[:, i]
        inside = float(np.mean(np.abs(error) <= 2.0 * sigma)) if len(error) else math.nan
        axes.fill_between(time, -2.0 * sigma, 2.0 * sigma, color=FAINT, alpha=0.6, linewidth=0.0, label="±2σ")
        axes.plot(time, error, color=colour(result.detector), linewidth=0.8, label="error")
        axes.axhline(0.0, color=GREY, linewidth=0.6)
        axes.set_ylabel(f"{name} ({unit})")
        axes.set_title(f"{name}: {100.0 * inside:.0f} % inside ±2σ", fontweight="normal", fontsize=9.5)
        limit = 1.25 * max(float(np.quantile(2.0 * sigma, 0.98)), float(np.quantile(np.abs(error), 0.995)), 1e-6)
        axes.set_ylim(-limit, limit)
    panels[-1].set_xlabel("time (s)")
    handles, names = panels[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper right", ncols=2)
    return figure


@styled
def nees_figure(
    times: Floats, nees: Mapping[str, Floats], *, bounds: tuple[float, float], runs: int, seconds: float = 5.0
) -> Figure:
    """Draw the normalised estimation error squared over time, one line a detector, averaged over the runs.

    Parameters
    ----------
    times : ndarray, shape (t,)
        Time since the start, s.
    nees : mapping of str to ndarray, shape (t,)
        Mean over the runs at each time, per detector; 3 is ideal for a pose.
    bounds : tuple of float
        What 95 % of a consistent filter's values lie between, for this many runs.
    runs : int
        How many runs the mean is over.
    seconds : float
        Lines are smoothed over this time.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(6.0, 3.4), layout="constrained")
    axes = figure.add_subplot()
    axes.axhspan(*bounds, color=FAINT, alpha=0.6, linewidth=0.0, label=f"95 % for {runs} run{'s' * (runs != 1)}")
    axes.axhline(3.0, color=GREY, linewidth=0.8)
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    window = np.ones(min(max(1, round(seconds / max(step, 1e-9))), len(times)))
    for name, values in nees.items():
        known = np.isfinite(values)
        count = np.convolve(known, window, mode="same")
        total = np.convolve(np.where(known, values, 0.0), window, mode="same")
        smooth = np.divide(total, count, out=np.full(len(values), np.nan), where=count > 0.5)
        axes.plot(times, smooth, color=colour(name), label=label(name))
    logarithmic(axes, "y")
    axes.set(xlabel="time (s)", ylabel="NEES of the pose (3 is ideal)")
    figure.legend(loc="outside lower left", ncols=3)
    return figure
