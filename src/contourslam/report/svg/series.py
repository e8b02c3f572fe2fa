"""What goes on along a run: relation errors, matching quality, innovations and errors over time."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.report.svg.axes import Axes
from contourslam.report.svg.colours import BLUE, GREEN, GREY, ORANGE, VERMILION
from contourslam.report.svg.drawing import Drawing, drawing
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

_WIDTH = 900.0  # px
_PIECES = 250
"""Lines are drawn through the medians of this many pieces of the run: the eye cannot tell more."""
_LEAST = 1e-3
"""Errors below it are drawn at it: a logarithmic scale has no zero, m."""
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
        unit="m",
        logarithmic=True,
    )
    shown = [(name, np.maximum(values, _LEAST)) for name, values in reversed(list(errors.items()))]
    for name, values in shown:
        axes.cloud(np.stack([times, values], axis=-1), _COLOURS.get(name, GREY), 3.0, 0.6)
    for name, values in shown:
        at, middle, _, _ = pieces(times, values, 60)
        axes.line(at, middle, _COLOURS.get(name, GREY), 2.0, name=f"{name}, median")
    axes.legend([(name, _COLOURS.get(name, GREY)) for name in errors])
    return drawing([axes])


def matching_drawing(result: RunResult) -> Drawing:
    """Draw, one below the other, what is known of: matching quality, NIS per degree of freedom, stated uncertainty.

    Parameters
    ----------
    result : RunResult
        With one scan or more, and one of the three.
    """
    times, corrected = result.stamps - result.stamps.min(), result.nis_dof > 0
    panels: list[Axes] = []

    def panel(y: tuple[float, float], label: str, unit: str = "", *, logarithmic: bool) -> Axes:
        offset = (0.0, sum(one.outer[1] for one in panels))
        labels = ("time (s)", label)
        panels.append(
            Axes(_span(times), y, _WIDTH, 150.0, labels=labels, unit=unit, logarithmic=logarithmic, offset=offset)
        )
        return panels[-1]

    if result.quality is not None:
        _band(panel((-0.03, 1.03), "matching quality", logarithmic=False), times, result.quality, GREEN)
    if corrected.any():
        ratio = np.maximum(result.nis[corrected] / result.nis_dof[corrected], 1e-2)
        _, _, low, high = pieces(times[corrected], ratio, _PIECES)
        span = (min(0.5, float(low.min())), 1.2 * max(2.0, float(high.max())))
        axes = panel(span, "NIS per d. o. f.", logarithmic=True)
        _band(axes, times[corrected], ratio, BLUE)
        if result.back_end != "graph":  # its wheels are taken for worse than they are, so that 1 is not to be expected
            axes.rule(1.0)
    sigmas = 100.0 * position_sigmas(result)
    if (sigmas > 0.0).any():
        sigmas = np.maximum(
            sigmas, 0.01 * float(sigmas.max())
        )  # a logarithm knows no zero, which is what the first may be
        span = (0.8 * float(sigmas.min()), max(1.25 * float(sigmas.max()), 5.0 * float(sigmas.min())))
        _band(panel(span, "position σ (cm)", "cm", logarithmic=True), times, sigmas, VERMILION)
    return drawing(panels)


def position_sigmas(result: RunResult) -> Floats:
    """Larger standard deviation of each pose's position, m, shape (t,)."""
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(result.covariances[:, :2, :2])[:, 1], 0.0)))


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
        unit = name[name.index("(") + 1 : -1]
        axes = Axes(_span(times), (-limit, limit), _WIDTH, 130.0, labels=("time (s)", name), unit=unit, offset=offset)
        axes.band(times[at], -bound[at], bound[at], name="±2σ")
        axes.rule(0.0)
        axes.line(times[at], error[at], BLUE, 0.9, name="error")
        panels.append(axes)
    return drawing(panels)


def _span(times: Floats) -> tuple[float, float]:
    return 0.0, max(1.0, float(times.max()))


def _band(axes: Axes, times: Floats, values: Floats, colour: str) -> None:
    at, middle, low, high = pieces(times, values, _PIECES)
    axes.band(at, low, high, name="90 % within")
    axes.line(at, middle, colour, 1.2, name="median")


def pieces(times: Floats, values: Floats, count: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Mean time, and median, 5 % and 95 % quantile of the values, of consecutive pieces of equally many."""
    order = np.argsort(times, kind="stable")
    parts = np.array_split(order, max(1, min(count, len(order))))
    quantiles = np.array([np.quantile(values[part], (0.5, 0.05, 0.95)) for part in parts])
    return np.array([times[part].mean() for part in parts]), *quantiles.T
