"""Where each of several robots drives: on the right, and where it may stand without being in the way of others."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.robot.route import SPACING, sample_route
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
_DOOR = 0.8  # m on both sides of an open door that are kept clear
_ACROSS, _DEEP = 2.4, 3.0  # m from a door into the corridor and into the room
_COARSE = 10  # points of a way per point of which it is asked whether one may stand there
_LONGER = 100  # points: two places of a way that are farther apart on it are not neighbours
_SAME_WAY = 0.7  # cosine of the angle between two ways up to which one counts as following the other
_STARTS_APART = 1.2  # m
_EACH = 8.0  # m of corridor, or of places to wait, per robot: with less they block each other sooner or later
_TRIES = 16
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
    room = place if isinstance(place, Room) else place.room
    if robots == 1:
        return _laps(room, 1), [0]
    building = place if isinstance(place, Building) else BUILDINGS.get(room.name)
    if building is not None and building.room != room:
        building = None
    ways = _laps(room, robots) if building is None else _tours(building, robots, length, seed)
    starts = _starts(ways, seed)
    most = min(len(starts), _most(ways) if building is None else int(_lanes(building) / _EACH))
    if most < robots:
        while len(_starts(ways[:most], seed)) < most:
            most -= 1
        raise ConfigError(
            f"room {room.name}: {robots} robots do not fit; {most} do, and more in a larger building: --room "
            "office_building with more --corridors"
        )
    return ways, starts


def _most(laps: Sequence[Way]) -> int:
    """How many robots can drive laps without a jam: any number, where nobody has to let others pass."""
    each = {id(way): way for way in laps}.values()
    if all(way.standing.all() for way in each):
        return len(laps)
    return max(int(sum(int(way.standing.sum()) for way in each) * SPACING / _EACH), len(each))


def _lanes(building: Building) -> float:
    """Length of all corridors that can be driven through, m."""
    return float(sum(math.dist(*(building.junctions[end] for end in stretch)) for stretch in building.stretches))


def _laps(room: Room, robots: int) -> list[Way]:
    """The laps of a room, in turns."""
    laps = room.loops if room.loops and robots > 1 else (room.route,)
    points = [sample_route(lap) for lap in laps]
    ways = [Way(lap, stands, True) for lap, stands in zip(points, _stands_apart(points), strict=True)]
    return [ways[robot % len(ways)] for robot in range(robots)]


def _stands_apart(laps: Sequence[Floats]) -> list[NDArray[np.bool_]]:
    """Where closed ways do not come near themselves or each other, unless both go the same way."""
    some = [points[::_COARSE] for points in laps]
    places, counts = np.concatenate(some), np.array([len(points) for points in some])
    lap, step = np.repeat(np.arange(len(some)), counts), np.concatenate([np.arange(count) for count in counts])
    ahead = np.concatenate([np.roll(points, -1, axis=0) - points for points in some])
    ahead /= np.hypot(*ahead.T)[:, None]
    apart = np.abs(step[:, None] - step)
    along = np.where(lap[:, None] == lap, np.minimum(apart, counts[lap] - apart) * _COARSE, _LONGER + 1)
    near = np.hypot(*np.moveaxis(places[:, None] - places, 2, 0)) < APART
    clear = ~(near & (along > _LONGER) & (ahead @ ahead.T < _SAME_WAY)).any(axis=1)
    return [
        np.repeat(part, _COARSE)[: len(points)]
        for part, points in zip(np.split(clear, np.cumsum(counts)[:-1]), laps, strict=True)
    ]


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


def _starts(ways: Sequence[Way], seed: int) -> list[int]:
    """Starts of as many robots as fit, one after the other, each as soon on its way as there is room."""
    chance = stream(seed, TRAFFIC)
    places: list[Floats] = []
    found: list[int] = []
    begins: dict[int, int] = {}
    for robot, way in enumerate(ways):
        count, begin = len(way.points), 0
        if way.closed:  # evenly along the lap, from where it is farthest from those who stand already
            alike = [k for k, other in enumerate(ways) if other is way]
            if id(way) not in begins:
                begins[id(way)] = max(chance.integers(count, size=_TRIES).tolist(), key=lambda k: _off(way, k, places))
            begin = begins[id(way)] + alike.index(robot) * count // len(alike)
        for step in range(0, count - (0 if way.closed else _START), _COARSE):
            index = (begin + step) % count
            ahead = np.arange(index, index + _START) % count
            if way.standing[ahead].all() and min(_off(way, k, places) for k in ahead[::_COARSE]) > _STARTS_APART:
                places.append(way.points[index])
                found.append(index)
                break
        else:
            return found
    return found


def _off(way: Way, index: int, places: Sequence[Floats]) -> float:
    """Distance from a point of a way to the nearest of some places, m."""
    return min((float(np.hypot(*(way.points[index] - place))) for place in places), default=np.inf)


def next_stand(way: Way, behind: int) -> NDArray[np.int64]:
    """For each point of a way the first one from it on up to which, from so many points behind it, a robot may wait.

    It may lie beyond the last point of a closed way; of an open one, the last point is always one.
    """
    count = len(way.points)
    stands = np.all([np.roll(way.standing, k) for k in range(behind + 1)], axis=0)
    if not way.closed:
        stands[:behind], stands[-1] = way.standing[0], True
    twice = np.concatenate([stands, stands]) if way.closed else stands
    where = np.where(twice, np.arange(len(twice)), len(twice) + count)
    return np.minimum.accumulate(where[::-1])[::-1][:count].astype(np.int64)
