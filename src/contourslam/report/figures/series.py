"""What goes on along a run: relation errors, matching quality and innovations over time."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from contourslam.report.figures.style import BLUE, FAINT, GREEN, GREY, ORANGE, logarithmic, styled
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

_PIECES = 250
"""Lines are drawn through the medians of this many pieces of the run: the eye cannot tell more."""
_LEAST = 1e-3
"""Errors below it are drawn at it: a logarithmic scale has no zero, m."""
_COLOURS = {"estimate": BLUE, "online": GREEN, "raw odometry": ORANGE}


@styled
def relation_figure(times: Floats, errors: Mapping[str, Floats]) -> Figure:
    """Draw the error of each relation over time on a logarithmic scale, and the running median of each kind.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Second time of each relation since the start, s; n is 1 or more.
    errors : mapping of str to ndarray, shape (n,)
        "estimate", "online", "raw odometry": m.

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(10.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    for i, (name, values) in enumerate(reversed(list(errors.items()))):
        colour, shown = _COLOURS.get(name, GREY), np.maximum(values, _LEAST)
        axes.plot(
            times,
            shown,
            ".",
            markersize=3.5,
            color=colour,
            alpha=0.5,
            markeredgewidth=0,
            rasterized=True,
            zorder=2 + i,
        )
        at, middle, _, _ = _pieces(times, shown, 60)
        axes.plot(at, middle, color=colour, linewidth=1.7, zorder=6 + i, label=name)
    logarithmic(axes, "y")
    axes.set(xlabel="time (s)", ylabel="relation error (m)")
    handles, names = axes.get_legend_handles_labels()
    figure.legend(
        handles[::-1], names[::-1], loc="outside lower left", ncols=3, title="dots: relations, lines: medians"
    )
    return figure


@styled
def matching_figure(result: RunResult) -> Figure:
    """Draw matching quality, where it is known, above the normalised innovation squared per degree of freedom.

    Parameters
    ----------
    result : RunResult
        With one scan or more.

    Returns
    -------
    Figure
    """
    times = result.stamps - result.stamps.min()
    corrected = result.nis_dof > 0
    panels = (result.quality is not None) + bool(corrected.any())
    figure = Figure(figsize=(10.0, 1.0 + 2.0 * max(panels, 1)), layout="constrained")
    all_axes = list(figure.subplots(max(panels, 1), 1, sharex=True, squeeze=False)[:, 0])
    if result.quality is not None:
        axes = all_axes.pop(0)
        _band(axes, times, result.quality, GREEN)
        axes.set(ylabel="matching quality", ylim=(-0.03, 1.03))
    if corrected.any():
        axes = all_axes.pop(0)
        ratio = np.maximum(result.nis[corrected] / result.nis_dof[corrected], 1e-2)
        _band(axes, times[corrected], ratio, BLUE)
        axes.axhline(1.0, color=GREY, linewidth=0.8)
        logarithmic(axes, "y")
        axes.set_ylabel("NIS per degree\nof freedom (1 is ideal)")
    figure.axes[-1].set_xlabel("time (s)")
    return figure


def _band(axes: Axes, times: Floats, values: Floats, colour: str) -> None:
    at, middle, low, high = _pieces(times, values, _PIECES)
    axes.fill_between(at, low, high, color=FAINT, alpha=0.7, linewidth=0.0)
    axes.plot(at, middle, color=colour, linewidth=1.0)


def _pieces(times: Floats, values: Floats, count: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Mean time, and median, 5 % and 95 % quantile of the values, of consecutive pieces of equally many."""
    order = np.argsort(times, kind="stable")
    pieces = np.array_split(order, max(1, min(count, len(order))))
    quantiles = np.array([np.quantile(values[piece], (0.5, 0.05, 0.95)) for piece in pieces])
    return np.array([times[piece].mean() for piece in pieces]), *quantiles.T
