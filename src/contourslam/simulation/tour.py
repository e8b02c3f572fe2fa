"""Where to drive in a large building: half of the way explores, half comes back to places seen before."""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from contourslam.simulation.buildings import Building
from contourslam.simulation.chance import DRIVER, stream
from contourslam.simulation.ways import Doorway, Junction, Point, Stretch, along, passage

_LANE = 0.15  # m; a stretch is driven at most this far off the middle of the corridor
_VISITS, _VISITS_AGAIN = 0.35, 0.1  # chances to enter an open door, unseen or seen
_BETWEEN_DOORS = 1.4  # m
_SHORTEST, _LONGEST = 30.0, 150.0  # m of exploring or coming back at a time


@dataclass(frozen=True, slots=True)
class Leg:
    """A part of the way: waypoints (m, world frame), and whether it leads along where the robot has not been."""

    points: tuple[Point, ...]
    fresh: bool


def tour(
    building: Building, seed: int, *, start: Junction = (0, 0), lanes: tuple[float, float] = (-_LANE, _LANE)
) -> Iterator[Leg]:
    """Drive through a building without end; memory does not grow with the way.

    Exploring takes the nearest corridor not driven yet; coming back goes to a place drawn from those seen. The two
    take turns so that each makes half of the way, until all has been seen; from then on the robot comes back only.

    Parameters
    ----------
    building : Building
    seed : int
        Varies the order, the side of the corridor and the rooms that are visited.
    start : tuple of int
        The junction where it begins.
    lanes : tuple of float
        Between which a stretch is driven, m to the left of the middle of the corridor.

    Yields
    ------
    Leg
    """
    tourist = _Tourist(building, stream(seed, DRIVER), start, lanes)
    while True:
        yield from tourist.explore()
        yield from tourist.come_back()


class _Tourist:
    """Remembers where it is and what it has seen. Mutable."""

    def __init__(
        self, building: Building, chance: np.random.Generator, start: Junction, lanes: tuple[float, float]
    ) -> None:
        self._building, self._chance, self._lanes = building, chance, lanes
        self._ways: dict[Junction, list[Junction]] = {junction: [] for junction in building.junctions}
        for a, b in building.stretches:
            self._ways[a].append(b)
            self._ways[b].append(a)
        self._here = start
        self._from: Junction | None = None
        self._seen: set[Stretch] = set()
        self._entered: set[Doorway] = set()
        self._fresh = self._again = 0.0  # m

    def explore(self) -> Iterator[Leg]:
        """Go where the robot has not been, until that is half of the way and a bit more."""
        goal = self._again + self._turn()
        while self._fresh < goal and len(self._seen) < len(self._building.stretches):
            yield from self._go(self._path(None))

    def come_back(self) -> Iterator[Leg]:
        """Go to places seen before, until that is half of the way."""
        while self._again < self._fresh or len(self._seen) == len(self._building.stretches):
            known = sorted({junction for stretch in self._seen for junction in stretch} - {self._here})
            yield from self._go(self._path(known[int(self._chance.integers(len(known)))]))

    def _turn(self) -> float:
        return float(np.clip(0.3 * (self._fresh + self._again), _SHORTEST, _LONGEST))

    def _path(self, goal: Junction | None) -> list[Junction]:
        """Shortest way to a junction through what has been seen, or (None) through the nearest stretch that has not."""
        origins: dict[Junction, Junction] = {}
        waiting = deque([self._here])
        while waiting:
            at = waiting.popleft()
            ways = [self._ways[at][k] for k in self._chance.permutation(len(self._ways[at])).tolist()]
            for following in ways:
                # Nobody turns round in a corridor without need.
                if at == self._here and following == self._from and len(ways) > 1 and following != goal:
                    continue
                seen = (min(at, following), max(at, following)) in self._seen
                if (goal is None and not seen) or (seen and following == goal):
                    return [*self._back(origins, at), following]
                if seen and following != self._here and following not in origins:
                    origins[following] = at
                    waiting.append(following)
        # All that is left lies back through the stretch the robot came from.
        assert self._from is not None
        return [self._here, self._from]

    def _back(self, origins: dict[Junction, Junction], at: Junction) -> list[Junction]:
        path = [at]
        while path[-1] != self._here:
            path.append(origins[path[-1]])
        return path[::-1]

    def _go(self, path: list[Junction]) -> Iterator[Leg]:
        for a, b in pairwise(path):
            stretch = (min(a, b), max(a, b))
            ends = self._building.junctions[a], self._building.junctions[b]
            doorways = self._choose(stretch, *ends)
            lane, turn = float(self._chance.uniform(*self._lanes)), int(self._chance.choice([-1, 1]))
            fresh = stretch not in self._seen
            for index, points in enumerate(passage(*ends, lane, doorways, turn)):
                visiting = index % 2 == 1
                unseen = fresh if not visiting else doorways[index // 2] not in self._entered
                way = sum(math.dist(p, q) for p, q in pairwise(points))
                self._fresh, self._again = self._fresh + unseen * way, self._again + (not unseen) * way
                yield Leg(points, unseen)
            self._seen.add(stretch)
            self._entered.update(doorways)
            self._here, self._from = b, a

    def _choose(self, stretch: Stretch, start: Point, end: Point) -> list[Doorway]:
        """The doors that are gone through on the way along a stretch, in their order."""
        chosen: list[Doorway] = []
        for doorway in sorted(self._building.stretches[stretch], key=lambda d: math.dist(start, (d.x, d.y))):
            wanted = self._chance.random() < (_VISITS_AGAIN if doorway in self._entered else _VISITS)
            far = not chosen or along(start, end, doorway) > along(start, end, chosen[-1]) + _BETWEEN_DOORS
            if wanted and far:
                chosen.append(doorway)
        return chosen
