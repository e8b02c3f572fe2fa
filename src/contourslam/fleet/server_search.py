"""Whether common maps overlap: each new view of a run is looked for in the charts of the others, once."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.fleet.common import CommonMap
from contourslam.fleet.common_kept import assemble
from contourslam.fleet.runs import Run
from contourslam.geometry.poses import between_one, compose_one
from contourslam.joining.chart import WAY, Chart
from contourslam.joining.find import decide
from contourslam.joining.joint import Apart, Joint
from contourslam.joining.looks import Look, Method, look, turned_round

LATER = 10  # a chart is drawn anew when one keyframe has come for so many that are in it
MOST_WAITING = 2000  # views that wait to be looked for; of more the oldest are given up


@dataclass(frozen=True, slots=True)
class Drawn:
    """A common map as a chart, and where its keyframes are in it.

    Attributes
    ----------
    chart : Chart
    runs : tuple of (Run, int)
        The run of each drive, and its first keyframe in the chart.
    views : dict of (Run, int) to int
        Number in the chart of each view of each run.
    """

    chart: Chart
    runs: tuple[tuple[Run, int], ...]
    views: dict[tuple[Run, int], int]

    def of(self, run: Run, number: int) -> int:
        """Keyframe in the chart."""
        return next(first for other, first in self.runs if other is run) + number

    def whose(self, keyframe: int) -> tuple[Run, int]:
        """Run of a keyframe of the chart, and its number there."""
        run, first = next(each for each in reversed(self.runs) if each[1] <= keyframe)
        return run, keyframe - first


@dataclass(frozen=True, slots=True)
class Sight:
    """A keyframe of one run as it may lie to one of another: holds whatever becomes of the common maps.

    Attributes
    ----------
    run, view, keyframe : Run, int, int
        Whose view was looked for, its number in the run, and the keyframe in its middle.
    near, anchor : Run, int
        A keyframe close to where it was found.
    pose : ndarray, shape (3,)
        The first seen from the second: m, m, rad.
    odds : float
    method : str
    """

    run: Run
    view: int
    keyframe: int
    near: Run
    anchor: int
    pose: Floats
    odds: float
    method: Method


class Search:
    """Views that are to be looked for, and what was found; changed in place.

    Attributes
    ----------
    looks : int
        Views looked for in charts so far.
    given_up : int
        Views that waited too long, for more came than could be looked for.
    """

    def __init__(self) -> None:
        self.looks = self.given_up = 0
        self._viewed: dict[Run, int] = {}
        self._waiting: deque[tuple[Run, int, CommonMap]] = deque()
        self._sights: dict[frozenset[int], list[Sight]] = {}
        self._drawn: dict[int, Drawn] = {}

    def __len__(self) -> int:
        return len(self._waiting)

    def hear(self, common: CommonMap, others: Iterable[CommonMap]) -> None:
        """Note the views that the runs of a common map have finished, to be looked for in the other ones."""
        others = list(others)
        for run in common.runs:
            before = self._viewed.get(run, 0)
            count = max(int(run.way[len(run.keys) - 1] / (0.5 * WAY)) - 1, 0) if run.keys else 0
            for view in range(before, count):
                self._waiting.extend((run, view, other) for other in others)
            self._viewed[run] = max(count, before)
        while len(self._waiting) > MOST_WAITING:
            self._waiting.popleft()
            self.given_up += 1

    def step(self, where: dict[Run, CommonMap]) -> tuple[CommonMap, CommonMap, Joint] | None:
        """Look for the newest view that waits, in one chart.

        Parameters
        ----------
        where : dict of Run to CommonMap
            That each run belongs to.

        Returns
        -------
        (CommonMap, CommonMap, Joint) or None
            Two that overlap, the older first, with the joint in the numbers of their keyframes.
        """
        run, view, other = self._waiting.pop()
        own = where[run]
        if not other.runs or own is other:  # has become part of another one, or of this
            return None
        target = self._draw(other)
        piece, first = _piece(run, view)
        self.looks += 1
        found = look(target.chart, piece, 0)
        if not found:
            return None
        pair = frozenset((own.number, other.number))
        kept = self._sights.setdefault(pair, [])
        for each in found:
            frames = target.chart.frames
            nearest = int(np.argmin(np.hypot(*(frames.poses[:, :2] - each.pose[:2]).T)))
            near, anchor = target.whose(nearest)
            pose = between_one(frames.poses[nearest], each.pose)
            kept.append(Sight(run, view, first + each.keyframe, near, anchor, pose, each.odds, each.method))
        return self._decide(own, other, kept)

    def _decide(
        self, own: CommonMap, other: CommonMap, sights: list[Sight]
    ) -> tuple[CommonMap, CommonMap, Joint] | None:
        older, younger = sorted((own, other), key=lambda common: common.number)
        first, second = self._draw(older, sights), self._draw(younger, sights)
        joint = decide(first.chart, second.chart, list(_laid(sights, first, second)))
        if isinstance(joint, Apart):
            return None
        ties = tuple(replace(tie, first=_key(first, tie.first), second=_key(second, tie.second)) for tie in joint.ties)
        return older, younger, replace(joint, ties=ties)

    def merged(self, kept: CommonMap, gone: CommonMap) -> None:
        """Take notice that one common map has gone into another."""
        for number in (kept.number, gone.number):
            self._drawn.pop(number, None)
        for pair in [pair for pair in self._sights if gone.number in pair]:
            sights = self._sights.pop(pair)
            into = frozenset(pair - {gone.number} | {kept.number})
            if len(into) == 2:
                self._sights.setdefault(into, []).extend(sights)

    def moved(self, common: CommonMap) -> None:
        """Take notice that a common map was solved anew."""
        self._drawn.pop(common.number, None)

    def _draw(self, common: CommonMap, sights: Iterable[Sight] = ()) -> Drawn:
        """Give the chart of a common map; one of some time ago will do, if it holds all that was seen there."""
        drawn = self._drawn.get(common.number)
        if drawn is not None:
            count = len(drawn.chart.frames)
            new = len(common) - count
            if new * LATER < count and all(key in drawn.views for key in _views_in(common, sights)):
                return drawn
        drawn = self._drawn[common.number] = _draw(common)
        return drawn


def _views_in(common: CommonMap, sights: Iterable[Sight]) -> Iterator[tuple[Run, int]]:
    return ((sight.run, sight.view) for sight in sights if sight.run in common.runs)


def _draw(common: CommonMap) -> Drawn:
    saved, _ = common.kept()
    chart = Chart(saved)
    begins = np.cumsum([0, *(len(run.keys) for run in common.runs)]).tolist()
    views: dict[tuple[Run, int], int] = {}
    count: dict[int, int] = {}
    for number, members in enumerate(chart.stretches):
        drive = int(chart.frames.drives[members[0]])
        views[common.runs[drive], count.get(drive, 0)] = number
        count[drive] = count.get(drive, 0) + 1
    return Drawn(chart, tuple(zip(common.runs, begins, strict=False)), views)


def _key(drawn: Drawn, keyframe: int) -> int:
    run, number = drawn.whose(keyframe)
    return run.keys[number]


def _piece(run: Run, view: int) -> tuple[Chart, int]:
    """Give one view of a run as a chart of its own, and its first keyframe."""
    way = np.array(run.way[: len(run.keys)])
    members: Ints = np.flatnonzero((way >= 0.5 * view * WAY) & (way < (0.5 * view + 1.0) * WAY))
    first = int(members[0])
    part = Run(run.robot, run.number)
    part.keyframes = run.keyframes[first : int(members[-1]) + 1]
    part.keys = list(range(len(members)))
    return Chart(assemble([part], run.chained(members), part.keys, [])), first


def _laid(sights: Iterable[Sight], first: Drawn, second: Drawn) -> Iterator[Look]:
    """Give what was seen as looks of the second chart in the first, as the charts are now."""
    firsts = {run for run, _ in first.runs}
    for sight in sights:
        back = sight.run in firsts
        inside, of = (second, first) if back else (first, second)
        if (sight.run, sight.view) not in of.views:
            continue
        pose = compose_one(inside.chart.frames.poses[inside.of(sight.near, sight.anchor)], sight.pose)
        number = of.views[sight.run, sight.view]
        found = Look(number, of.of(sight.run, sight.keyframe), pose, sight.odds, sight.method)
        yield turned_round(found, second.chart, first.chart) if back else found
