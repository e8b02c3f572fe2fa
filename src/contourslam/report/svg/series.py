"""What goes on along a run: relation errors, matching quality, innovations and errors over time."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.report.svg.axes import BLUE, GREEN, GREY, ORANGE, Axes
from contourslam.report.svg.drawing import Drawing, drawing
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

_WIDTH = 900.0  # px
_PIECES = 250
"""Lines are drawn through the medians of this many pieces of the run: the eye cannot tell more."""
_LEAST = 1e-3
"""Errors below it are drawn at it: a logarithmic scale has no zero, m."""
_MAX_DOTS = 4000
_COLOURS = {"estimate": BLUE, "online": GREEN, "raw odometry": ORANGE}


def relation_drawing(times: Floats, errors: Mapping[str, Floats]) -> Drawing:
    """Draw the error of each relation over time on a logarithmic scale, and the running median of each kind.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Second time of each relation since the start, s; n is 1 or more.
    errors : mapping of str to ndarray, shape (n,)
        "estimate", "online", "raw odometry": m.
    """
    highest = max(float(values.max()) for values in errors.values())
    axes = Axes(
        _span(times),
        (0.8 * _LEAST, 1.5 * max(highest, 10.0 * _LEAST)),
        _WIDTH,
        320.0,
        labels=("time (s)", "relation error (m)"),
        logarithmic=True,
    )
    shown = [(name, np.maximum(values, _LEAST)) for name, values in reversed(list(errors.items()))]
    for name, values in shown:
        every = slice(None, None, max(1, len(times) // _MAX_DOTS))
        axes.dots(np.stack([times[every], values[every]], axis=-1), _COLOURS.get(name, GREY), 3.0, 0.5)
    for name, values in shown:
        at, middle, _, _ = pieces(times, values, 60)
        axes.line(at, middle, _COLOURS.get(name, GREY), 2.0)
    axes.legend([(name, _COLOURS.get(name, GREY)) for name in errors])
    return drawing([axes])


def matching_drawing(result: RunResult) -> Drawing:
    """Draw matching quality, where it is known, above the normalised innovation squared per degree of freedom.

    Parameters
    ----------
    result : RunResult
        With one scan or more, and one of the two.
    """
    times, span = result.stamps - result.stamps.min(), _span(result.stamps - result.stamps.min())
    corrected = result.nis_dof > 0
    panels: list[Axes] = []
    if result.quality is not None:
        axes = Axes(span, (-0.03, 1.03), _WIDTH, 150.0, labels=("time (s)", "matching quality"))
        _band(axes, times, result.quality, GREEN)
        panels.append(axes)
    if corrected.any():
        ratio = np.maximum(result.nis[corrected] / result.nis_dof[corrected], 1e-2)
        _, _, low, high = pieces(times[corrected], ratio, _PIECES)
        axes = Axes(
            span,
            (min(0.5, float(low.min())), 1.2 * max(2.0, float(high.max()))),
            _WIDTH,
            150.0,
            labels=("time (s)", "NIS per d. o. f."),
            logarithmic=True,
            offset=(0.0, sum(panel.outer[1] for panel in panels)),
        )
        _band(axes, times[corrected], ratio, BLUE)
        axes.rule(1.0)
        panels.append(axes)
    return drawing(panels)


def error_drawing(result: RunResult) -> Drawing:
    """Draw the error of x, y and heading over time inside the bounds of two standard deviations.

    Parameters
    ----------
    result : RunResult
        A run with true poses.
    """
    errors = result.poses - (result.poses if result.truth is None else result.truth)
    errors[:, 2] = wrap(errors[:, 2])
    times = result.stamps - result.stamps.min()
    at = np.arange(0, len(times), max(1, len(times) // 2000))
    panels: list[Axes] = []
    for i, (name, scale) in enumerate((("x (cm)", 100.0), ("y (cm)", 100.0), ("heading (°)", math.degrees(1.0)))):
        bound = 2.0 * scale * np.sqrt(np.maximum(result.covariances[:, i, i], 0.0))
        error = scale * errors[:, i]
        known = np.abs(error[np.isfinite(error)])
        limit = 1.25 * max(float(np.quantile(bound, 0.98)), float(np.quantile(known, 0.995)), 1e-6)
        offset = (0.0, sum(panel.outer[1] for panel in panels))
        axes = Axes(_span(times), (-limit, limit), _WIDTH, 130.0, labels=("time (s)", name), offset=offset)
        axes.band(times[at], -bound[at], bound[at])
        axes.rule(0.0)
        axes.line(times[at], error[at], BLUE, 0.9)
        panels.append(axes)
    return drawing(panels)


def _span(times: Floats) -> tuple[float, float]:
    return 0.0, max(1.0, float(times.max()))


def _band(axes: Axes, times: Floats, values: Floats, colour: str) -> None:
    at, middle, low, high = pieces(times, values, _PIECES)
    axes.band(at, low, high)
    axes.line(at, middle, colour, 1.2)


def pieces(times: Floats, values: Floats, count: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Mean time, and median, 5 % and 95 % quantile of the values, of consecutive pieces of equally many."""
    order = np.argsort(times, kind="stable")
    parts = np.array_split(order, max(1, min(count, len(order))))
    quantiles = np.array([np.quantile(values[part], (0.5, 0.05, 0.95)) for part in parts])
    return np.array([times[part].mean() for part in parts]), *quantiles.T
