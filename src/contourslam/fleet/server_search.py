"""Whether common maps overlap: each new view of a run is looked for in the charts of the others, once."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.fleet.common import CommonMap
from contourslam.fleet.common_kept import assemble
from contourslam.fleet.runs import Run, View
from contourslam.geometry.poses import between_one, compose_one
from contourslam.joining.chart import WAY, Chart
from contourslam.joining.find import LIKELY, decide
from contourslam.joining.joint import Apart, Joint
from contourslam.joining.looks import Look, Method, look, turned_round
from contourslam.joining.verdict import hurdle

LATER = 10  # a chart is drawn anew when one keyframe has come for so many that are in it,
LAG = 16  # or so many: about the way of one view, that no two robots meet in what neither chart holds
SURE = 5.0  # log-odds of a look after which two common maps are judged at once;
SELDOM = 2  # else when they have so many views that may be alike, and one more for so many that they were judged by
CAREFUL = 0.75  # of the hurdle that a joint may be at: who asks again as maps grow gives chance as many chances
MOST_SIGHTS = 200  # kept of two common maps that stay apart; of more, the older half is given up
MOST_WAITING = 20_000  # views that wait to be looked for; of more the oldest are given up


@dataclass(frozen=True, slots=True)
class Sight:
    """A keyframe of one run as it may lie to one of another: holds whatever becomes of the common maps.

    Attributes
    ----------
    run, view, keyframe : Run, (int, int), int
        Whose view was looked for, its drive and number, and the keyframe in its middle.
    near, anchor : Run, int
        A keyframe close to where it was found.
    pose : ndarray, shape (3,)
        The first seen from the second: m, m, rad.
    odds : float
    method : str
    """

    run: Run
    view: View
    keyframe: int
    near: Run
    anchor: int
    pose: Floats
    odds: float
    method: Method


@dataclass(frozen=True, slots=True)
class Drawn:
    """A common map as a chart, and where its keyframes are in it.

    Attributes
    ----------
    chart : Chart
    owners : list of (Run, int)
        Run of each keyframe of the chart, and its number there.
    index : dict of (Run, int) to int
        The other way round.
    runs : frozenset of Run
    views : dict of (Run, (int, int)) to int
        Number in the chart of each view of each run.
    """

    chart: Chart
    owners: list[tuple[Run, int]]
    index: dict[tuple[Run, int], int]
    runs: frozenset[Run]
    views: dict[tuple[Run, View], int]

    def holds(self, sight: Sight) -> bool:
        """Whether the keyframes and the view of a sight are in it, as far as they are of its runs."""
        if sight.near in self.runs and (sight.near, sight.anchor) not in self.index:
            return False
        if sight.run not in self.runs:
            return True
        return (sight.run, sight.keyframe) in self.index and (sight.run, sight.view) in self.views


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
        self._viewed: dict[Run, tuple[int, int]] = {}  # piece of each run, and number in it, of the next view
        self._waiting: deque[tuple[Run, View, Ints, CommonMap]] = deque()
        self._sights: dict[frozenset[int], list[Sight]] = {}
        self._piece: tuple[Run, View, Chart] | None = None  # the view that was looked for last
        self._again: dict[frozenset[int], int] = {}  # views of two common maps at which they are judged next
        self._drawn: dict[int, Drawn] = {}

    def __len__(self) -> int:
        return len(self._waiting)

    def hear(self, common: CommonMap, others: Iterable[CommonMap]) -> None:
        """Note the views that the runs of a common map have finished, to be looked for in the other ones."""
        others = list(others)
        for run in common.runs:
            for at, view, members in run.views(WAY, self._viewed.get(run, (0, 0))):
                self._waiting.extend((run, view, members, other) for other in others)
                self._viewed[run] = at[0], at[1] + 1
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
        run, view, members, other = self._waiting.pop()
        own = where.get(run)
        if own is None or not other.runs or own is other:  # put aside, or part of another one by now, or of this
            return None
        target = self._draw(other)
        if self._piece is None or self._piece[:2] != (run, view):
            self._piece = run, view, _piece(run, members)
        self.looks += 1
        found = [each for each in look(target.chart, self._piece[2], 0) if each.odds > LIKELY]
        if not found:
            return None
        pair = frozenset((own.number, other.number))
        kept = self._sights.setdefault(pair, [])
        for each in found:
            frames = target.chart.frames
            nearest = int(np.argmin(np.hypot(*(frames.poses[:, :2] - each.pose[:2]).T)))
            near, anchor = target.owners[nearest]
            pose = between_one(frames.poses[nearest], each.pose)
            kept.append(Sight(run, view, int(members[each.keyframe]), near, anchor, pose, each.odds, each.method))
        views = len({(each.run, each.view) for each in kept})
        if views < self._again.get(pair, 0) and max(each.odds for each in found) < SURE:
            return None
        # Those found apart are judged ever more seldom: the answer gets dearer as they grow.
        self._again[pair] = min(views + 1 + views // SELDOM, MOST_SIGHTS // 2)
        return self._decide(own, other, kept)

    def _decide(
        self, own: CommonMap, other: CommonMap, sights: list[Sight]
    ) -> tuple[CommonMap, CommonMap, Joint] | None:
        older, younger = sorted((own, other), key=lambda common: common.number)
        first, second = self._draw(older, sights), self._draw(younger, sights)
        joint = decide(first.chart, second.chart, list(_laid(sights, first, second)))
        if isinstance(joint, Apart) or not joint.ties or hurdle(joint.evidence) > CAREFUL:
            if len(sights) > MOST_SIGHTS:
                del sights[: len(sights) // 2]
            return None
        ties = tuple(replace(tie, first=_key(first, tie.first), second=_key(second, tie.second)) for tie in joint.ties)
        return older, younger, replace(joint, ties=ties)

    def merged(self, kept: CommonMap, gone: CommonMap) -> None:
        """Take notice that one common map has gone into another."""
        for number in (kept.number, gone.number):
            self._drawn.pop(number, None)
        for pair in [pair for pair in self._sights if gone.number in pair]:
            sights = self._sights.pop(pair)
            self._again.pop(pair, None)
            into = frozenset(pair - {gone.number} | {kept.number})
            if len(into) == 2:
                self._sights.setdefault(into, []).extend(sights)

    def forget(self, common: CommonMap) -> None:
        """Take notice that a common map is no more."""
        self._drawn.pop(common.number, None)
        for pair in [pair for pair in self._sights if common.number in pair]:
            self._again.pop(pair, None)
            del self._sights[pair]

    def moved(self, common: CommonMap) -> None:
        """Take notice that a common map was solved anew."""
        self._drawn.pop(common.number, None)

    def _draw(self, common: CommonMap, sights: Iterable[Sight] = ()) -> Drawn:
        """Give the chart of a common map; one of some time ago will do, if it holds all that was seen there."""
        drawn = self._drawn.get(common.number)
        if drawn is not None:
            count = len(drawn.chart.frames)
            new = len(common) - count
            if new < min(count / LATER, LAG) and all(drawn.holds(sight) for sight in sights):
                return drawn
        drawn = self._drawn[common.number] = _draw(common)
        return drawn


def _draw(common: CommonMap) -> Drawn:
    saved, order = common.kept()
    chart = Chart(saved)
    owners = [common.owners[key] for key in order]
    index = {owner: number for number, owner in enumerate(owners)}
    drawn = Drawn(chart, owners, index, frozenset(common.runs), {})
    drives = [(run, begin) for run in common.runs for begin, _ in run.pieces]
    counts = [0] * len(drives)
    for number, members in enumerate(chart.stretches):
        drive = int(chart.frames.drives[members[0]])
        run, begin = drives[drive]
        drawn.views[run, (begin, counts[drive])] = number
        counts[drive] += 1
    return drawn


def _key(drawn: Drawn, keyframe: int) -> int:
    run, number = drawn.owners[keyframe]
    return run.keys[number]


def _piece(run: Run, members: Ints) -> Chart:
    """Give one view of a run as a chart of its own."""
    part = Run(run.robot, run.number)
    part.keyframes, part.begins = run.keyframes[members[0] : members[-1] + 1], [0]
    part.keys, part.pieces = list(range(len(members))), [[0, len(members)]]
    return Chart(assemble([part], run.chained(members), part.keys, []))


def _laid(sights: Iterable[Sight], first: Drawn, second: Drawn) -> Iterator[Look]:
    """Give what was seen as looks of the second chart in the first, as the charts are now."""
    for sight in sights:
        back = sight.run in first.runs
        inside, of = (second, first) if back else (first, second)
        if not (of.holds(sight) and inside.holds(sight)):
            continue  # a view that has come out a little shorter in the chart
        pose = compose_one(inside.chart.frames.poses[inside.index[sight.near, sight.anchor]], sight.pose)
        number = of.views[sight.run, sight.view]
        found = Look(number, of.index[sight.run, sight.keyframe], pose, sight.odds, sight.method)
        yield turned_round(found, second.chart, first.chart) if back else found
