"""Where each of several robots drives: on the right, and where it may stand without being in the way of others."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.robot.route import sample_route
from contourslam.simulation.buildings import Building
from contourslam.simulation.chance import TRAFFIC, seed_of, stream
from contourslam.simulation.room import Room
from contourslam.simulation.rooms import BUILDINGS
from contourslam.simulation.tour import tour
from contourslam.simulation.ways import Point

Floats = NDArray[np.float64]
APART = 0.5
"""Between the middles of two robots, at the least, m."""
_LANE = 0.28  # m to the right of the middle of a corridor
_MOUTH = 0.86  # m from the middle of a junction, on one's lane: who stands there is in nobody's way
_DOOR = 1.0  # m on both sides of an open door that are kept clear
_ACROSS, _DEEP = 2.4, 3.0  # m from a door into the corridor and into the room
_COARSE = 10  # points of a way per point of which it is asked whether one may stand there
_LONGER = 100  # points: two places of a way that are farther apart on it are not neighbours
_STARTS_APART = 1.2  # m
_START = 70  # points ahead of a start on which one may stand


@dataclass(frozen=True, slots=True)
class Way:
    """Where a robot drives.

    Attributes
    ----------
    points : ndarray, shape (n, 2)
        World frame, m, `SPACING` apart.
    standing : ndarray of bool, shape (n,)
        Where a robot may wait: not in doors, on crossings, or where its way leads back past itself.
    closed : bool
        The last point leads back to the first.
    """

    points: Floats
    standing: NDArray[np.bool_]
    closed: bool


def ways_of(place: Room | Building, robots: int, length: float, seed: int) -> tuple[list[Way], list[int]]:
    """Find a way and a start for each robot: laps of a room, side by side; a tour of its own for each in a building.

    Parameters
    ----------
    place : Room or Building
    robots : int
    length : float
        Of a tour, m.
    seed : int

    Returns
    -------
    ways : list of Way
    starts : list of int
        Index of each robot's first point on its way.

    Raises
    ------
    ConfigError
        If so many robots do not fit; the message says how many do.
    """
    if robots < 1:
        raise ConfigError(f"there must be at least one robot, got {robots}")
    room = place if isinstance(place, Room) else place.room
    if robots == 1:
        return _laps(room, 1), [0]
    building = place if isinstance(place, Building) else BUILDINGS.get(room.name)
    if building is not None and building.room == room:
        ways = _tours(building, robots, length, seed)
    else:
        ways = _laps(room, robots)
    starts = _starts(ways, robots)
    if len(starts) < robots:
        raise ConfigError(f"room {room.name}: {robots} robots do not fit; {len(starts)} do")
    return ways, starts


def _laps(room: Room, robots: int) -> list[Way]:
    points = sample_route(room.route)
    return [Way(points, _stands_apart(points), True)] * robots


def _stands_apart(points: Floats) -> NDArray[np.bool_]:
    """Where a closed way does not come near another part of itself."""
    some = points[::_COARSE]
    between = np.hypot(*np.moveaxis(some[:, None] - some[None], 2, 0))
    steps = np.abs(np.subtract.outer(np.arange(len(some)), np.arange(len(some))))
    along = np.minimum(steps, len(some) - steps) * _COARSE
    near = ((between < APART) & (along > _LONGER)).any(axis=1)
    return np.repeat(~near, _COARSE)[: len(points)]


def _tours(building: Building, robots: int, length: float, seed: int) -> list[Way]:
    junctions = sorted(building.junctions)
    order = stream(seed, TRAFFIC).permutation(len(junctions)).tolist()
    found = []
    for robot in range(robots):
        start = junctions[order[robot % len(order)]]
        waypoints: list[Point] = []
        way = 0.0
        for leg in tour(building, seed_of(seed, robot), start=start, lanes=(-_LANE, -_LANE)):
            waypoints += [point for point in leg.points if point not in waypoints[-1:]]
            way += sum(np.hypot(q[0] - p[0], q[1] - p[1]) for p, q in pairwise(leg.points))
            if way > length:
                break
        points = sample_route(waypoints, closed=False)
        found.append(Way(points, _stands_clear(points, building), False))
    return found


def _stands_clear(points: Floats, building: Building) -> NDArray[np.bool_]:
    """Where a way through a building is clear of its junctions and of its open doors."""
    some = points[::_COARSE]
    clear = np.ones(len(some), dtype=np.bool_)
    for junction in building.junctions.values():
        clear &= np.hypot(*(some - junction).T) > _MOUTH
    for doorways in building.stretches.values():
        for doorway in doorways:
            off = some - (doorway.x, doorway.y)
            inward = np.array(doorway.inward)
            deep, aside = off @ inward, off @ np.array([-inward[1], inward[0]])
            clear &= (np.abs(aside) > _DOOR) | (deep < -_ACROSS) | (deep > _DEEP)
    return np.repeat(clear, _COARSE)[: len(points)]


def _starts(ways: Sequence[Way], robots: int) -> list[int]:
    """Starts of as many robots as fit, one after the other, each as soon on its way as there is room."""
    places: list[Floats] = []
    found: list[int] = []
    for robot, way in enumerate(ways):
        count = len(way.points)
        begin = robot * count // robots if way.closed else 0
        for step in range(0, count, _COARSE):
            index = (begin + step) % count
            ahead = np.arange(index, index + _START) % count
            if way.standing[ahead].all() and all(
                np.hypot(*(way.points[ahead] - place).T).min() > _STARTS_APART for place in places
            ):
                places.append(way.points[index])
                found.append(index)
                break
        else:
            return found
    return found


def next_stand(way: Way, behind: int) -> NDArray[np.int64]:
    """For each point of a way the first one from it on, so many points behind which a robot may wait.

    It may lie beyond the last point of a closed way; of an open one, the last point is always one.
    """
    count = len(way.points)
    stands = np.roll(way.standing, behind)
    if not way.closed:
        stands[:behind], stands[-1] = way.standing[0], True
    twice = np.concatenate([stands, stands]) if way.closed else stands
    where = np.where(twice, np.arange(len(twice)), len(twice) + count)
    return np.minimum.accumulate(where[::-1])[::-1][:count].astype(np.int64)
