"""How sure a sweep's figures are: means of cells with their intervals, and detectors tested in pairs."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.evaluation.paired_tests import (
    Interval,
    PairedTest,
    by_seed,
    judged,
    mean_interval,
    signed_rank,
)
from contourslam.report.sweep.measures import Measure
from contourslam.report.sweep.values import Condition, Drive, Summary, Sweep, SweepRun

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pair:
    """Two detectors held against each other.

    Attributes
    ----------
    place : str
        Room, or "" for all rooms together.
    first, second : str
    test : PairedTest
        Of the natural logarithms where the measure is compared by its ratio.
    interval : Interval
        Of the mean difference, likewise, over the seeds with which neither failed.
    ratio : bool
        Whether it is.
    lost : int
        Runs of either that failed among those compared.
    """

    place: str
    first: str
    second: str
    test: PairedTest
    interval: Interval
    ratio: bool
    lost: int

    @property
    def effect(self) -> float:
        """Median of how much larger the first's error is: as a part of the second's, or in the measure's unit."""
        return self.plain(self.test.median)

    def plain(self, difference: float) -> float:
        """Turn a difference of logarithms, if it is one, into how much larger the first is as a part of the second."""
        return math.expm1(difference) if self.ratio and difference < math.inf else difference

    @property
    def better(self) -> str | None:
        """Name of the one that is shown to be better, if one is."""
        return {"first better": self.first, "second better": self.second}.get(self.test.verdict)


Tests = dict[tuple[str, str], list[Pair]]
"""Pairs by the names of measure and setting."""


def summary(sweep: Sweep, measure: Measure, place: str, condition: Condition, detector: str) -> Summary:
    """Mean of a measure over the drives of a cell, with its interval; computed once."""
    key = place, condition, detector, measure.name
    if key not in sweep.summaries:
        sweep.summaries[key] = _summary(sweep.cell(place, condition, detector), measure.of)
    return sweep.summaries[key]


def wheels(sweep: Sweep, measure: Measure, place: str, condition: Condition) -> Summary:
    """The same of the wheels alone: each detector's run of a drive has the same wheels."""
    key = place, condition, "", measure.name
    if key not in sweep.summaries:
        drives: dict[Drive, SweepRun] = {}
        for detector in sweep.detectors:
            for run in sweep.cell(place, condition, detector):
                if not run.error:
                    drives.setdefault(run.drive, run)
        sweep.summaries[key] = _summary(list(drives.values()), measure.of_odometry)
    return sweep.summaries[key]


def _summary(runs: Sequence[SweepRun], value: Callable[[Mapping[str, Any]], float]) -> Summary:
    values = np.array([math.nan if run.error else value(run.row) for run in runs], dtype=np.float64)
    return Summary(mean_interval(values), len(runs), sum(bool(run.error) for run in runs))


def pairs(
    sweep: Sweep, measure: Measure, groups: Sequence[tuple[str, Sequence[str]]], conditions: Sequence[Condition]
) -> list[Pair]:
    """Test every two detectors in each group of places, corrected for all tests together.

    What was measured with one seed under several conditions and in several rooms is averaged first, so that a seed
    counts once: its drives in several rooms share the errors of the wheels and the stream of noise.

    Parameters
    ----------
    sweep : Sweep
    measure : Measure
    groups : sequence of (str, sequence of str)
        Name of a group, and its places.
    conditions : sequence of Condition

    Returns
    -------
    list of Pair
        Group by group; pairs that share no seed are among them, with nothing shown.
    """
    found: list[Pair] = []
    for name, places in groups:
        costs = {detector: _costs(sweep, measure, places, conditions, detector) for detector in sweep.detectors}
        for first, second in combinations(sweep.detectors, 2):
            one, other = costs[first], costs[second]
            shared = [key for key in one if key in other]
            values = [np.array([cost[key] for key in shared], dtype=np.float64) for cost in (one, other)]
            lost = int(sum(np.isinf(value).sum() for value in values))
            differences = by_seed([drive.seed for drive, _ in shared], *values)
            test, interval = signed_rank(differences), mean_interval(differences)
            found.append(Pair(name, first, second, test, interval, measure.ratio, lost))
    tests = judged([pair.test for pair in found])
    return [replace(pair, test=test) for pair, test in zip(found, tests, strict=True)]


def _costs(
    sweep: Sweep, measure: Measure, places: Sequence[str], conditions: Sequence[Condition], detector: str
) -> dict[tuple[Drive, Condition], float]:
    return {
        (run.drive, condition): _cost(run, measure)
        for place in places
        for condition in conditions
        for run in sweep.cell(place, condition, detector)
    }


def _cost(run: SweepRun, measure: Measure) -> float:
    if run.error:
        return math.inf
    value = measure.of(run.row)
    if not measure.ratio or math.isnan(value):
        return value
    return math.log(value) if value > 0.0 else math.nan
