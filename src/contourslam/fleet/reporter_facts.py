"""What is new in a graph, as facts: read after each scan, a bounded part at a time."""

from typing import Any

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.fleet.facts import Fact, KeyframeFact, RelationFact, StretchFact
from contourslam.geometry.poses import between_one, compose_one
from contourslam.graph.keeping import read_relation
from contourslam.graph.memory import Memory

AT_ONCE, RELATIONS_AT_ONCE = 2, 20  # what one call reads at most: a map that is continued may be large


class News:
    """Facts of one graph, each given once; changed in place.

    Parameters
    ----------
    memory : Memory
        Of the graph; nothing in it is changed.
    before : News or None
        Of the graph of which everything has been told so far.

    Attributes
    ----------
    memory : Memory
    continued : bool
        Whether the graph goes on where the one before ended: then what that one had is not told again.
    poses : list of ndarray
        Of the keyframes that were told of, in the robot's own map as it was then.
    """

    def __init__(self, memory: Memory, before: "News | None" = None) -> None:
        self.memory = memory
        self.poses: list[Floats] = []
        self._factors = self._ties = self._stretches = 0
        self.continued = before is not None and before._is_beginning_of(memory)
        if before is not None and self.continued:
            self.poses = before.poses
            self._factors = self._told(memory.graph.factors)
            self._ties = self._told(memory.graph.ties)
            self._stretches = before._stretches

    def _is_beginning_of(self, memory: Memory) -> bool:
        told = len(self.poses)
        if not 0 < told <= len(memory.keyframes):
            return False
        pairs = zip(self.memory.keyframes[:told], memory.keyframes, strict=False)
        return all(one.stamp == other.stamp and np.array_equal(one.oriented, other.oriented) for one, other in pairs)

    def _told(self, factors: Any) -> int:
        """How many factors bind only keyframes that were told of: those of a further drive come after all others."""
        count: int = factors.size()
        while count and max(factors.at(count - 1).keys()) >= len(self.poses):
            count -= 1
        return count

    def collect(self, pose: Floats) -> list[Fact]:
        """Give what is new, or a first part of it.

        Parameters
        ----------
        pose : ndarray, shape (3,)
            Base in the robot's own map after the last scan.
        """
        memory = self.memory
        until = min(len(self.poses) + AT_ONCE, len(memory.keyframes))
        facts: list[Fact] = [self._keyframe(number, pose) for number in range(len(self.poses), until)]
        graph, places = memory.graph, memory.places.list
        first, self._factors = self._factors, self._within(graph.factors, self._factors)
        facts += [_relation(graph.factors.at(i), tie=False) for i in range(first, self._factors)]
        first, self._ties = self._ties, self._within(graph.ties, self._ties)
        facts += [_relation(graph.ties.at(i), tie=True) for i in range(first, self._ties)]
        for place in places[self._stretches : self._stretches + RELATIONS_AT_ONCE]:
            if max(place.anchor, *place.members) >= until:
                break
            facts.append(StretchFact(place.anchor, place.members, place.seen))
            self._stretches += 1
        return facts

    def _within(self, factors: Any, first: int) -> int:
        """Up to which factor to tell now: of an old map, each keyframe comes with the factors that end at it."""
        until = min(first + RELATIONS_AT_ONCE, factors.size())
        return next((i for i in range(first, until) if max(factors.at(i).keys()) >= len(self.poses)), until)

    def _keyframe(self, number: int, pose: Floats) -> KeyframeFact:
        memory, keyframe = self.memory, self.memory.keyframes[number]
        where = keyframe.local  # of an earlier drive: as the map was kept
        if memory.contour is not None and keyframe.drive == memory.keyframes[-1].drive:
            where = compose_one(pose, between_one(memory.contour.pose, keyframe.local))
        self.poses.append(where)
        sightings = memory.landmarks.sightings
        first, until = np.searchsorted(sightings.keys[: sightings.count], [number, number + 1])
        seen = sightings.rows[first:until].copy()
        return KeyframeFact(number, keyframe.stamp, where, keyframe.blur, keyframe.oriented, seen, keyframe.drive)


def _relation(factor: Any, *, tie: bool) -> RelationFact:
    first, second, pose, information, robust = read_relation(factor)
    return RelationFact(first, second, pose, information, robust, tie)
