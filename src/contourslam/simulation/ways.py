"""Ways through a building: along its corridors, through its doors, round the rooms behind them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

Point = tuple[float, float]
Junction = tuple[int, int]
Stretch = tuple[Junction, Junction]
LOOP_DEPTH, LOOP_RADIUS = 2.0, 0.6  # m: the little circle that a visitor drives in a room, from the corridor's wall
_MOUTH = 0.8  # m from the middle of a junction, where the way along a corridor begins and ends


@dataclass(frozen=True, slots=True)
class Doorway:
    """An open door that a robot can go through.

    Attributes
    ----------
    x, y : float
        Middle of the gap, on the corridor's face of the wall, m in the world frame.
    inward : tuple of float
        Unit vector from the corridor into the room.
    """

    x: float
    y: float
    inward: tuple[float, float]


def along(start: Point, end: Point, doorway: Doorway) -> float:
    """How far along the corridor from `start` to `end` a door is, m."""
    ux, uy = _direction(start, end)
    return (doorway.x - start[0]) * ux + (doorway.y - start[1]) * uy


def passage(start: Point, end: Point, lane: float, doorways: Sequence[Doorway], turn: int) -> list[tuple[Point, ...]]:
    """Waypoints from one junction to the next.

    Parameters
    ----------
    start, end : tuple of float
        The junctions, m.
    lane : float
        How far to the left of the corridor's middle to drive, m.
    doorways : sequence of Doorway
        Doors to go through, in their order on the way.
    turn : int
        1 to begin the circle in a room on the side of the way's end, -1 on that of its start.

    Returns
    -------
    list of tuples of points
        Along the corridor, and in turns with it the visit of each room; each part begins where the last one ends.
    """
    (ux, uy), length = _direction(start, end), math.dist(start, end)

    def in_corridor(way: float) -> Point:
        return start[0] + way * ux - lane * uy, start[1] + way * uy + lane * ux

    parts: list[tuple[Point, ...]] = []
    at = in_corridor(_MOUTH)
    for doorway in doorways:
        before, after = (in_corridor(along(start, end, doorway) + step) for step in (-0.5, 0.5))
        parts += [(at, before), (before, *_visit(doorway, (turn * ux, turn * uy)), after)]
        at = after
    parts.append((at, in_corridor(length - _MOUTH)))
    return parts


def first_lap(
    junctions: Mapping[Junction, Point], stretches: Mapping[Stretch, tuple[Doorway, ...]]
) -> tuple[Point, ...]:
    """Waypoints of the lap round the first block, counter-clockwise, through the first open door on the way."""
    points: list[Point] = []
    corners: tuple[Junction, ...] = ((0, 0), (1, 0), (1, 1), (0, 1), (0, 0))
    visited = False
    for a, b in pairwise(corners):
        doorways = () if visited else stretches[min(a, b), max(a, b)][:1]
        visited = visited or bool(doorways)
        for part in passage(junctions[a], junctions[b], 0.0, doorways, 1):
            points += [point for point in part if point not in points[-1:]]
    return tuple(points)


def _visit(doorway: Doorway, aside: tuple[float, float]) -> tuple[Point, ...]:
    """Through a door, once round the circle behind it, and out again."""

    def at(across: float, deep: float) -> Point:
        return (
            doorway.x + across * aside[0] + deep * doorway.inward[0],
            doorway.y + across * aside[1] + deep * doorway.inward[1],
        )

    bearings = [math.radians(bearing) for bearing in range(-45, 226, 45)]
    circle = [at(LOOP_RADIUS * math.cos(b), LOOP_DEPTH + LOOP_RADIUS * math.sin(b)) for b in bearings]
    gate = at(0.0, -0.45), at(0.0, 0.6)
    return (*gate, *circle, *gate[::-1])


def _direction(start: Point, end: Point) -> Point:
    length = math.dist(start, end)
    return (end[0] - start[0]) / length, (end[1] - start[1]) / length
