"""Runs of one recording brought together: moved into one world, and held against each other pose by pose."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.evaluation.bootstrap import PairedDifference, paired_difference
from contourslam.evaluation.errors import fit
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose
from contourslam.report.runs_reading import JudgedRun
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]

_SHARED = 0.5  # of the shorter run's scans that must have a stamp in the other, where both are of one recording
_SAME = 1e-6  # m and rad: odometry is written with ten digits
_WHOLE = 0.99  # of the longest run's time that a run must cover to compete


@dataclass(frozen=True, slots=True)
class Difference:
    """One run's poses seen from those of the first run, at the scans that both have.

    Attributes
    ----------
    times : ndarray, shape (n,)
        Since the first run's first scan, ascending, s.
    position, heading : ndarray, shape (n,)
        Distance (m) and turn (rad) between the two.
    """

    times: Floats
    position: Floats
    heading: Floats


@dataclass(frozen=True, slots=True)
class Errors:
    """Errors of one kind, run by run.

    Attributes
    ----------
    name : str
        Of the figure that shows them.
    measure, unit : str
        "relation error", "relation error, rotation" or "position error"; m or °.
    of : dict of str to ndarray, shape (n,)
        By the names of the runs, one or more; NaN where they are not known.
    """

    name: str
    measure: str
    unit: str
    of: dict[str, Floats]


@dataclass(frozen=True, slots=True)
class Pair:
    """Two runs' errors of the same things.

    Attributes
    ----------
    first, second : str
        Names of the runs.
    measure, unit : str
        "relation error", "relation error, rotation" or "position error"; m or rad.
    difference : PairedDifference
    """

    first: str
    second: str
    measure: str
    unit: str
    difference: PairedDifference


@dataclass(frozen=True, slots=True)
class Group:
    """Runs of one recording, one or more.

    Attributes
    ----------
    recording : str
        As it is called, as far as the runs tell.
    runs : tuple of JudgedRun
    motions : tuple of ndarray, shape (3,)
        Pose of each run's world in that of the first: m, m, rad.
    """

    recording: str
    runs: tuple[JudgedRun, ...]
    motions: tuple[Floats, ...]

    @property
    def whole(self) -> frozenset[str]:
        """Names of the runs that are complete and cover the recording as far as any of them."""
        times = [float(np.ptp(run.result.stamps)) for run in self.runs]
        return frozenset(
            run.name
            for run, time in zip(self.runs, times, strict=True)
            if run.result.complete and time >= _WHOLE * max(times)
        )

    @property
    def competing(self) -> frozenset[str]:
        """Names of the whole runs, where there are two or more: only they can be better or worse than each other."""
        return self.whole if len(self.whole) > 1 else frozenset()

    def moved(self, at: int) -> Floats:
        """Poses of a run in the first one's world, shape (t, 3)."""
        return compose(self.motions[at], self.runs[at].result.poses)

    def differences(self) -> dict[str, Difference]:
        """Each further run against the first."""
        first = self.runs[0].result
        found = {}
        for at, run in enumerate(self.runs[1:], start=1):
            stamps, ours, theirs = _common(first, run.result)
            apart = self.moved(at)[theirs] - first.poses[ours]
            position = np.asarray(np.hypot(apart[:, 0], apart[:, 1]))
            found[run.name] = Difference(stamps - first.stamps.min(), position, np.abs(wrap(apart[:, 2])))
        return found

    def errors(self) -> list[Errors]:
        """All that runs were judged by: of the whole runs, where there is one, for a part has other errors than all."""
        runs = [run for run in self.runs if run.name in self.whole] or self.runs
        relations = {run.name: run.relations.estimate for run in runs if run.relations is not None}
        distances = {name: known.translation for name, known in relations.items()}
        turns = {name: np.degrees(known.rotation) for name, known in relations.items()}
        positions = {run.name: errors for run in runs if (errors := run.position_errors) is not None}
        found = [
            Errors("relation_errors", "relation error", "m", distances),
            Errors("relation_turns", "relation error, rotation", "°", turns),
            Errors("position_errors", "position error", "m", positions),
        ]
        return [errors for errors in found if errors.of]

    def pairs(self) -> list[Pair]:
        """Every two runs that compete, by everything that both were judged by."""
        names = self.competing
        competing = [run for run in self.runs if run.name in names]
        return [pair for one, other in combinations(competing, 2) for pair in _pairs(one, other)]


def grouped(runs: Sequence[JudgedRun]) -> list[Group]:
    """Bring runs of one recording together, in the order in which they are given."""
    found: list[list[JudgedRun]] = []
    for run in runs:
        for group in found:
            if same_recording(group[0], run):
                group.append(run)
                break
        else:
            found.append([run])
    names: list[str] = []
    for number, group in enumerate(found, start=1):
        name = next((told for run in group if (told := _told(run))), f"recording {number}")
        names.append(f"{name} ({number})" if name in names else name)
    return [_group(group, name) for group, name in zip(found, names, strict=True)]


def _told(run: JudgedRun) -> str:
    """Name of the recording, by what the run says, or before it said so by its command."""
    told = run.about.get("recording")
    if isinstance(told, str):
        return told
    words = str(run.about.get("command", "")).split()[2:3]
    return Path(words[0]).name if words and not words[0].startswith("-") else ""


def same_recording(one: JudgedRun, other: JudgedRun) -> bool:
    """Whether two runs are of one recording.

    They are where half of the scans' stamps agree, and neither the wheels nor the true poses tell two drives: those of
    a simulation all begin at the same time.
    """
    stamps, ours, theirs = _common(one.result, other.result)
    if len(stamps) < max(1.0, _SHARED * min(len(np.unique(run.result.stamps)) for run in (one, other))):
        return False
    if not _agree(one.result.odometry[ours], other.result.odometry[theirs]):
        return False
    truths = one.result.truth, other.result.truth
    if truths[0] is None or truths[1] is None or one.aligned or other.aligned:
        return True
    return _agree(truths[0][ours], truths[1][theirs])


def _agree(one: Floats, other: Floats) -> bool:
    """Whether two ways are the same one, wherever they begin; one that does not move tells nothing."""
    known = np.isfinite(one).all(axis=1) & np.isfinite(other).all(axis=1)
    one, other = one[known], other[known]
    if len(one) < 2 or not np.ptp(one, axis=0).any() or not np.ptp(other, axis=0).any():
        return True
    steps = between(one[:-1], one[1:]), between(other[:-1], other[1:])
    return bool((np.abs(between(*steps)) < _SAME).all())


def _common(one: RunResult, other: RunResult) -> tuple[Floats, NDArray[np.intp], NDArray[np.intp]]:
    """Stamps that both have, ascending, and where each has them."""
    return np.intersect1d(one.stamps, other.stamps, return_indices=True)


def _group(runs: list[JudgedRun], recording: str) -> Group:
    first = runs[0]
    motions = [np.zeros(3)]
    for run in runs[1:]:
        if all(one.result.truth is not None and not one.aligned for one in (first, run)):
            motions.append(np.zeros(3))  # both already stand in the world of the true poses
        else:
            _, ours, theirs = _common(first.result, run.result)
            motions.append(fit(run.result.poses[theirs, :2], first.result.poses[ours, :2]))
    return Group(recording, tuple(runs), tuple(motions))


def _pairs(one: JudgedRun, other: JudgedRun) -> list[Pair]:
    found = []
    if one.relations is not None and other.relations is not None:
        ours, theirs = _matching(one.relations.stamps, other.relations.stamps)
        if len(ours):
            for measure, unit, field in (
                ("relation error", "m", "translation"), ("relation error, rotation", "rad", "rotation"),
            ):  # fmt: skip
                errors = getattr(one.relations.estimate, field)[ours], getattr(other.relations.estimate, field)[theirs]
                found.append(Pair(one.name, other.name, measure, unit, paired_difference(*errors)))
    errors_one, errors_other = one.position_errors, other.position_errors
    if errors_one is not None and errors_other is not None:
        _, first, second = _common(one.result, other.result)
        difference = paired_difference(errors_one[first], errors_other[second])
        if difference.count:
            found.append(Pair(one.name, other.name, "position error", "m", difference))
    return found


def _matching(one: Floats, other: Floats) -> tuple[list[int], list[int]]:
    """Rows of two tables of stamps that are the same, in the order of their second stamp."""
    rows = {(row[0], row[1]): at for at, row in enumerate(other.tolist())}
    both = [(row[1], at, rows[row[0], row[1]]) for at, row in enumerate(one.tolist()) if (row[0], row[1]) in rows]
    both.sort()
    return [at for _, at, _ in both], [at for _, _, at in both]
