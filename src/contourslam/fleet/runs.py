"""What the server knows of one run of a robot: its facts, in order, and how they hang together."""

import math
from collections.abc import Iterator

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.fleet.facts import Fact, KeyframeFact, RelationFact, StretchFact
from contourslam.geometry.poses import between_one, compose_one
from contourslam.graph.places import Keyframe

View = tuple[int, int]
"""Drive of the run, and number of the stretch in it."""
KEYS = "it names a keyframe that has not been told of"


class Run:
    """Facts of one run; grows by :meth:`take`.

    Attributes
    ----------
    robot : str
        Its name.
    number : int
        Of the run, drawn by the robot.
    keyframes : list of KeyframeFact
    relations : list of RelationFact
        Without the one that ties the first keyframe to the robot's own frame.
    stretches : list of StretchFact
    keys : list of int
        Number of each keyframe in the common map that it has been placed in.
    way : list of float
        Length of the way up to each keyframe, m; all drives of the run one after the other.
    begins : list of int
        First keyframe of each drive.

    Parameters
    ----------
    robot : str
    number : int
    """

    def __init__(self, robot: str, number: int) -> None:
        self.robot, self.number = robot, number
        self.keyframes: list[KeyframeFact] = []
        self.relations: list[RelationFact] = []
        self.stretches: list[StretchFact] = []
        self.keys: list[int] = []
        self.way: list[float] = []
        self.begins: list[int] = []
        self._known_from: dict[int, RelationFact] = {}

    @property
    def name(self) -> str:
        """Robot and run, for people."""
        return f"{self.robot}/{self.number:x}"

    def take(self, fact: Fact) -> str:
        """Take in the next fact.

        Parameters
        ----------
        fact : KeyframeFact, RelationFact or StretchFact

        Returns
        -------
        str
            Why it could not be used; empty where it could.
        """
        count = len(self.keyframes)
        if isinstance(fact, KeyframeFact):
            if fact.number != count:
                return f"keyframe {fact.number} comes after keyframe {count - 1}"
            if not count or fact.drive != self.keyframes[-1].drive:
                self.begins.append(count)
            self.keyframes.append(fact)
            self.way.append(self.way[-1] + self._step(fact.number) if count else 0.0)
        elif isinstance(fact, RelationFact):
            if max(fact.first, fact.second) >= count or fact.second < 0:
                return f"a relation of {fact.first} and {fact.second}: {KEYS}"
            if fact.first >= 0:
                self.relations.append(fact)
                self._prefer(fact)
        else:
            if max(fact.anchor, *fact.members) >= count:
                return f"a stretch about {fact.anchor}: {KEYS}"
            self.stretches.append(fact)
        return ""

    def _step(self, number: int) -> float:
        before, here = self.keyframes[number - 1].pose, self.keyframes[number].pose
        # A loop that was closed in between has moved the robot's map: a keyframe is never as far from the last as that.
        return min(math.hypot(here[0] - before[0], here[1] - before[1]), 1.0)

    def _prefer(self, fact: RelationFact) -> None:
        """Remember what tells best where a keyframe lies: a match to contours rather than the wheels."""
        if fact.tie or fact.first >= fact.second:
            return
        known = self._known_from.get(fact.second)
        if known is None or (math.isnan(fact.robust) and not math.isnan(known.robust)):
            self._known_from[fact.second] = fact

    def known_from(self, number: int) -> tuple[int, Floats]:
        """Tell from which earlier keyframe a keyframe is known best, and how it is seen from there."""
        fact = self._known_from.get(number)
        if fact is not None:
            return fact.first, fact.pose
        return number - 1, between_one(self.keyframes[number - 1].pose, self.keyframes[number].pose)

    def views(self, length: float) -> Iterator[tuple[View, Ints]]:
        """Give the stretches of each drive of this `length` (m), that begin where the one before is half over.

        Only those whose keyframes are all placed.
        """
        ends = [*self.begins[1:], len(self.keyframes)]
        for drive, (begin, end) in enumerate(zip(self.begins, ends, strict=True)):
            along = np.array(self.way[begin : min(end, len(self.keys))])
            if not len(along):
                return
            along -= along[0]
            for k in range(max(math.floor(2.0 * along[-1] / length) - 1, 0)):
                yield (
                    (drive, k),
                    begin + np.flatnonzero((along >= 0.5 * k * length) & (along < (0.5 * k + 1.0) * length)),
                )

    def as_keyframe(self, number: int) -> Keyframe:
        """Give a keyframe as the graph has it."""
        fact = self.keyframes[number]
        return Keyframe(fact.stamp, fact.pose, fact.points, fact.blur, fact.drive)

    def chained(self, members: Ints) -> Floats:
        """Poses of keyframes that follow each other, as the run's own contours bind them, seen from the first of them.

        Parameters
        ----------
        members : ndarray of int, shape (n,)
            Ascending without gaps.

        Returns
        -------
        ndarray, shape (n, 3)
        """
        poses = {int(members[0]): np.zeros(3)}
        for number in members[1:].tolist():
            first, seen = self.known_from(number)
            if first not in poses:
                first, seen = number - 1, between_one(self.keyframes[number - 1].pose, self.keyframes[number].pose)
            poses[number] = compose_one(poses[first], seen)
        return np.array(list(poses.values()))
