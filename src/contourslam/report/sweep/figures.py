"""Error of every detector along an axis of the sweep, with intervals."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from contourslam.report.naming import COLOURS, label
from contourslam.report.svg.axes import Axes
from contourslam.report.svg.colours import GREY, INK, ORANGE, SKY
from contourslam.report.svg.drawing import Drawing, drawing
from contourslam.report.svg.legend import Header
from contourslam.report.sweep.measures import Measure
from contourslam.report.sweep.statistics import summary, wheels
from contourslam.report.sweep.values import Condition, Summary, Sweep

Floats = NDArray[np.float64]
AxisName = Literal["noise", "beams"]

_OTHERS = (INK, SKY)
_WIDTH, _HEIGHT = 400.0, 250.0  # px
_APART = 0.009
"""Detectors stand so far beside each other, as a part of the axis: equal ones would hide each other."""
_TITLES = {"noise": "noise of a range (cm)", "beams": "beams a turn"}


@dataclass(frozen=True, slots=True)
class Curves:
    """A measure along an axis, all else as in the middle of the sweep.

    Attributes
    ----------
    axis : str
    conditions : tuple of Condition
        Two or more, by their place on the axis.
    detectors : dict of str to tuple of Summary
    odometry : tuple of Summary
        Of the wheels alone.
    """

    axis: AxisName
    conditions: tuple[Condition, ...]
    detectors: Mapping[str, tuple[Summary, ...]]
    odometry: tuple[Summary, ...]

    @property
    def intervals(self) -> bool:
        """Whether any mean has an interval to be drawn."""
        return any(math.isfinite(one.interval.low) for found in self.detectors.values() for one in found)

    @property
    def places(self) -> Floats:
        """Where the conditions stand on the axis: noise in cm, or beams."""
        values = [100.0 * (one.noise or 0.0) if self.axis == "noise" else one.beams or 0 for one in self.conditions]
        return np.array(values, dtype=np.float64)


def curves(sweep: Sweep, measure: Measure, room: str, setting: str, axis: AxisName) -> Curves | None:
    """Take a measure along an axis through the middle of the sweep; None where the room has but one point on it."""
    centre = sweep.centre(setting)
    if centre is None:
        return None
    other: AxisName = "beams" if axis == "noise" else "noise"
    along = tuple(
        one
        for one in sweep.conditions(setting, room)
        if getattr(one, other) == getattr(centre, other) and getattr(one, axis) is not None
    )
    detectors = {name: tuple(summary(sweep, measure, room, one, name) for one in along) for name in sweep.detectors}
    if len(along) < 2 or not any(one.known for found in detectors.values() for one in found):
        return None
    return Curves(axis, along, detectors, tuple(wheels(sweep, measure, room, one) for one in along))


def curves_drawing(found: Curves, measure: Measure, title: str) -> Drawing:
    """Draw the means along the axis, each with its interval, and the wheels alone; what is what stands above."""
    x, scale = found.places, measure.scale
    margin = 0.06 * float(np.ptp(x))
    span = (float(x.min()) - margin, float(x.max()) + margin)
    means = {name: scale * np.array([one.interval.mean for one in cells]) for name, cells in found.detectors.items()}
    bounds = {
        name: scale * np.array([[one.interval.low, one.interval.high] for one in cells])
        for name, cells in found.detectors.items()
    }
    odometry = scale * np.array([one.interval.mean for one in found.odometry])
    own = colours(list(means))
    entries = [(label(name), own[name]) for name in means]
    if np.isfinite(odometry).any():
        entries.append(("raw odometry", ORANGE))
    header = Header(title, entries, _WIDTH)
    values = np.concatenate([*means.values(), *(bound.ravel() for bound in bounds.values()), odometry])
    axes = Axes(
        span,
        _span(values, logarithmic=measure.ratio),
        _WIDTH,
        _HEIGHT,
        labels=(_TITLES[found.axis], measure.heading),
        unit=measure.unit,
        logarithmic=measure.ratio,
        offset=(0.0, header.outer[1]),
    )
    axes.line(x, odometry, ORANGE, 1.6, name="raw odometry")
    for k, (name, mean) in enumerate(means.items()):
        at = x + (k - 0.5 * (len(means) - 1)) * _APART * (span[1] - span[0])
        axes.line(at, mean, own[name], 1.2, name=label(name))
        whole = np.isfinite(bounds[name]).all(axis=1)
        axes.segments(np.stack([np.repeat(at[whole, None], 2, axis=1), bounds[name][whole]], axis=-1), own[name], 1.6)
        shown = np.isfinite(mean)
        axes.dots(np.stack([at[shown], mean[shown]], axis=-1), own[name], 5.5)
    return drawing([header, axes])


def _span(values: Floats, *, logarithmic: bool) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if logarithmic:
        return 0.85 * float(known.min()), 1.05 * _tick_above(float(known.max()))
    return 0.0, 1.1 * max(float(known.max()), 1e-6)


def _tick_above(value: float) -> float:
    """First of 1, 2, 5, 10, 20, ... that is no smaller: so what is drawn lies between two numbers of the axis."""
    power = 10.0 ** math.floor(math.log10(value))
    return next((factor * power for factor in (1.0, 2.0, 5.0) if factor * power >= value), 10.0 * power)


def colours(detectors: Sequence[str]) -> dict[str, str]:
    """Colour of each detector: its own for the four of the paper, others in turn."""
    others = [name for name in detectors if name not in COLOURS]
    more = {name: (*_OTHERS, GREY)[min(k, len(_OTHERS))] for k, name in enumerate(others)}
    return {name: COLOURS.get(name) or more[name] for name in detectors}
