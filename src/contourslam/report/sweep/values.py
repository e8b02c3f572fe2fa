"""A sweep as its report needs it: runs by drive, cell and detector."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

from contourslam.evaluation.paired_tests import Interval

T = TypeVar("T")


@dataclass(frozen=True, slots=True, order=True)
class Drive:
    """What chance decided once: one value of each mean of a cell.

    Attributes
    ----------
    place : str
        Room, or name of the recording.
    seed : int
        0 for a recording, which is one drive.
    """

    place: str
    seed: int


@dataclass(frozen=True, slots=True)
class Condition:
    """How a drive was measured and by which setting it was mapped; noise and beams are None for a recording.

    Attributes
    ----------
    setting : str
    noise : float or None
        Standard deviation of a range, m; None also where it grows with the range.
    beams : int or None
        Of a turn.
    """

    setting: str
    noise: float | None
    beams: int | None

    @property
    def name(self) -> str:
        """Say it in words, without the setting."""
        return self.noise_name if self.beams is None else f"{self.noise_name}, {self.beams} beams"

    @property
    def noise_name(self) -> str:
        """Say the noise in words."""
        return "the lidar's own noise" if self.noise is None else f"{100 * self.noise:g} cm of noise"


@dataclass(frozen=True, slots=True)
class SweepRun:
    """One run.

    Attributes
    ----------
    drive : Drive
    condition : Condition
    detector : str
    simulated : bool
    error : str
        Why it failed, in a line; empty where it was finished.
    row : mapping
        All columns.
    """

    drive: Drive
    condition: Condition
    detector: str
    simulated: bool
    error: str
    row: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Summary:
    """A measure over the drives of a cell.

    Attributes
    ----------
    interval : Interval
        Over the drives that were finished and know the measure.
    runs, failed : int
    """

    interval: Interval
    runs: int
    failed: int

    @property
    def known(self) -> bool:
        """Whether there is anything to show."""
        return self.interval.count > 0


@dataclass(frozen=True)
class Sweep:
    """All runs of a sweep, and where they come from.

    Attributes
    ----------
    runs : tuple of SweepRun
        At most one of each drive, condition and detector.
    experiments : tuple of str
        The experiment files as they stand.
    expected : int or None
        How many runs the experiment has, where that is known.
    """

    runs: tuple[SweepRun, ...]
    experiments: tuple[str, ...] = ()
    expected: int | None = None

    @cached_property
    def simulated(self) -> tuple[SweepRun, ...]:
        """Runs in simulated rooms."""
        return tuple(run for run in self.runs if run.simulated)

    @cached_property
    def recorded(self) -> tuple[SweepRun, ...]:
        """Runs of recordings."""
        return tuple(run for run in self.runs if not run.simulated)

    @cached_property
    def failed(self) -> tuple[SweepRun, ...]:
        """Runs that were not finished."""
        return tuple(run for run in self.runs if run.error)

    @cached_property
    def detectors(self) -> list[str]:
        """In the order of the table."""
        return once(run.detector for run in self.runs)

    @cached_property
    def settings(self) -> list[str]:
        """Settings of the simulated runs, in the order of the table."""
        return once(run.condition.setting for run in self.simulated)

    @cached_property
    def rooms(self) -> list[str]:
        """In the order of the table."""
        return once(run.drive.place for run in self.simulated)

    def conditions(self, setting: str, place: str | None = None) -> list[Condition]:
        """Conditions of the simulated runs of a setting, in one room or all, by noise and beams."""
        found = once(
            run.condition
            for run in self.simulated
            if run.condition.setting == setting and place in (None, run.drive.place)
        )
        return sorted(found, key=lambda one: (one.noise is None, one.noise or 0.0, one.beams or 0))

    def common(self, setting: str) -> list[Condition]:
        """Conditions of a setting that every room has: rooms taken together count by these alone."""
        rooms = [set(self.conditions(setting, room)) for room in self.rooms]
        return [one for one in self.conditions(setting) if all(one in conditions for conditions in rooms)]

    def centre(self, setting: str) -> Condition | None:
        """Condition in which the axes of a setting cross: the one that most others share noise or beams with.

        Of several, the one nearest to the paper's lidar, 1 cm and 500 beams.
        """
        conditions = self.conditions(setting)

        def crossing(one: Condition) -> tuple[int, float]:
            neighbours = sum((other.noise == one.noise) + (other.beams == one.beams) for other in conditions)
            return -neighbours, abs((one.noise or 0.0) - 0.01) * 100.0 + abs((one.beams or 0) - 500) / 500.0

        return min(conditions, key=crossing, default=None)

    @cached_property
    def _lookup(self) -> dict[tuple[str, Condition, str], list[SweepRun]]:
        found: dict[tuple[str, Condition, str], list[SweepRun]] = {}
        for run in self.runs:
            found.setdefault((run.drive.place, run.condition, run.detector), []).append(run)
        return found

    def cell(self, place: str, condition: Condition, detector: str) -> list[SweepRun]:
        """Runs of a detector at a place under a condition, one a drive."""
        return self._lookup.get((place, condition, detector), [])

    @cached_property
    def summaries(self) -> dict[tuple[str, Condition, str, str], Summary]:
        """What :mod:`~contourslam.report.sweep.statistics` has computed, by place, condition, detector and measure."""
        return {}


def once(items: Iterable[T]) -> list[T]:
    """Give each item once, in the order in which they first come."""
    return list(dict.fromkeys(items))
