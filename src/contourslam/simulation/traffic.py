"""Who may go on: each robot claims the piece of its way that it is about to drive, and no two claims come near."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from contourslam.robot.route import SPACING
from contourslam.simulation.lanes import APART, Way, next_stand

Floats = NDArray[np.float64]
_STEP = 10  # points by which a claim grows, and between two of its points that are looked at
_SHORT = 25  # points before the end of its claim at which a robot stops
_SPARE = 30  # points that a claim is longer than the way to stop
_BRAKING = 0.35  # m/s²
_FAR = 25.0  # m between two robots whose claims cannot meet
_ASK_EACH = 5  # ticks between two questions of a robot that waits


class Traffic:
    """The claims of all robots. Mutable.

    A claim ends where its robot may wait without being in anybody's way. Through a door or over a crossing it is
    granted as a whole or not at all, so that nobody waits there, and what is claimed will become free again.

    Parameters
    ----------
    ways : sequence of Way
    starts : sequence of int
        Index of the point where each robot is.
    """

    def __init__(self, ways: Sequence[Way], starts: Sequence[int]) -> None:
        self._ways, self._at = ways, list(starts)
        shared = {id(way): way for way in ways}
        stands = {key: next_stand(way, _SHORT) for key, way in shared.items()}
        self._stands = [stands[id(way)] for way in ways]
        self._ends = [start + _SHORT for start in starts]
        self._waiting = [0] * len(ways)
        self._here = np.array([way.points[start] for way, start in zip(ways, starts, strict=True)])

    def limits(self, at: Sequence[int], speeds: Sequence[float]) -> list[float]:
        """Speed that each robot must not exceed, m/s; who has waited longest is asked first.

        Parameters
        ----------
        at : sequence of int
            Index of the point where each robot is, counted on from lap to lap.
        speeds : sequence of float
            At which it likes to go, m/s.
        """
        for robot, index in enumerate(at):
            if index != self._at[robot]:
                way = self._ways[robot]
                self._at[robot], self._here[robot] = index, way.points[index % len(way.points)]
        for robot in sorted(range(len(at)), key=lambda k: -self._waiting[k]):
            wanted = at[robot] + _SHORT + _SPARE + math.ceil(speeds[robot] ** 2 / (2 * _BRAKING) / SPACING)
            if self._ends[robot] >= wanted:
                self._waiting[robot] = 0
            elif self._waiting[robot] % _ASK_EACH or not self._grow(robot, wanted):
                self._waiting[robot] += 1
        left = [(end - index - _SHORT) * SPACING for end, index in zip(self._ends, at, strict=True)]
        return [math.sqrt(2 * _BRAKING * way) if way > 0.01 else 0.0 for way in left]

    def _grow(self, robot: int, wanted: int) -> bool:
        """Make a claim longer as far as it is free; whether that is as far as wanted."""
        others = [
            self._points(other, self._at[other], self._ends[other])
            for other in np.flatnonzero(np.hypot(*(self._here - self._here[robot]).T) < _FAR).tolist()
            if other != robot
        ]
        taken = np.concatenate(others) if others else np.empty((0, 2))
        while (end := self._ends[robot]) < wanted:
            further = self._stand(robot, end + _STEP)
            if further <= end:  # the way is at its end
                return True
            piece = self._points(robot, end, further)
            off = piece[:, None] - taken[None]
            if (off[..., 0] ** 2 + off[..., 1] ** 2 < APART**2).any():
                return False
            self._ends[robot] = further
        return True

    def _stand(self, robot: int, index: int) -> int:
        way = self._ways[robot]
        count = len(way.points)
        if not way.closed:
            return int(self._stands[robot][min(index, count - 1)])
        return index - index % count + int(self._stands[robot][index % count])

    def _points(self, robot: int, first: int, last: int) -> Floats:
        points = self._ways[robot].points
        found: Floats = points[np.append(np.arange(first, last, _STEP), last) % len(points)]
        return found
