"""Office floors of any size, drawn from a seed: corridors that look alike, rooms behind doors, furniture."""

from dataclasses import dataclass

import numpy as np

from contourslam.errors import ConfigError
from contourslam.simulation.furnishing import Frame, KeepOut, furnish_room, furnish_wall
from contourslam.simulation.pieces import GREY, Box, Cylinder, Piece, door, partition
from contourslam.simulation.room import Room
from contourslam.simulation.ways import LOOP_DEPTH, LOOP_RADIUS, Doorway, Junction, Stretch, first_lap

Plan = tuple[tuple[float, float], ...]  # width of each room along a corridor, and where in it the door is, m
_WALL, _STOREY, _DOOR = 0.12, 2.8, 1.0  # m
_CORRIDORS, _BLOCKS, _MARGIN = (2.0, 2.2, 2.4), (9.6, 10.8, 12.0, 14.4), 4.6  # m, of which sizes are drawn
_OPEN, _CLOSED_OFF, _HALLS = 0.6, 0.15, 0.15  # shares of doors, corridor stretches and blocks
_MOST_CORRIDORS = 40


@dataclass(frozen=True, slots=True)
class Building:
    """An office floor, with what a driver knows of it.

    Attributes
    ----------
    room : Room
        Its walls and furniture; the route goes once round the first block and into a room on the way.
    junctions : dict
        Where corridors cross: (x, y) in m by (column, row).
    stretches : dict
        The doorways of each stretch of corridor that can be driven through, by the two junctions at its ends, the
        western or southern first.
    """

    room: Room
    junctions: dict[Junction, tuple[float, float]]
    stretches: dict[Stretch, tuple[Doorway, ...]]


def office_building(corridors: int = 4, seed: int = 0) -> Building:
    """Draw an office floor.

    Parameters
    ----------
    corridors : int
        How many corridors run in each direction, about 14 m apart; from 2 to 40.
    seed : int
        The same seed gives the same building.

    Returns
    -------
    Building

    Raises
    ------
    ConfigError
        If the number of corridors is out of bounds.
    """
    if not 2 <= corridors <= _MOST_CORRIDORS:
        raise ConfigError(f"office_building: corridors must be 2 to {_MOST_CORRIDORS}, got {corridors!r}")
    chance = np.random.default_rng([seed, corridors])
    columns, rows = _bands(corridors, chance), _bands(corridors, chance)
    junctions = {
        (i, j): ((columns[i][1] + columns[i + 1][0]) / 2, (rows[j][1] + rows[j + 1][0]) / 2)
        for i in range(corridors)
        for j in range(corridors)
    }
    stretches: dict[Stretch, tuple[Doorway, ...]] = dict.fromkeys(_stretches(corridors), ())
    closed = _closed_off(list(stretches), chance)
    plans: dict[tuple[float, int], Plan] = {}
    pieces: list[Piece] = []
    for c, (x0, x1) in enumerate(columns):
        for r, (y0, y1) in enumerate(rows):
            block = _Block((x0, x1, y0, y1), _sides(c, r, corridors), closed, plans, chance)
            pieces += block.pieces
            for stretch, doorways in block.doorways.items():
                stretches[stretch] += doorways
    for stretch in closed:
        pieces.append(_fire_door(junctions[stretch[0]], junctions[stretch[1]]))
        del stretches[stretch]
    width, depth = columns[-1][1], rows[-1][1]
    room = Room(
        name="office_building",
        description=f"{width:.0f} x {depth:.0f} m office floor: {corridors} by {corridors} corridors, rooms, furniture",
        outline=((0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)),
        pieces=tuple(pieces),
        route=first_lap(junctions, stretches),
        wall_height=_STOREY,
    )
    return Building(room, junctions, stretches)


def _bands(corridors: int, chance: np.random.Generator) -> list[tuple[float, float]]:
    """From where to where the blocks between the corridors reach along one axis, m."""
    at, found = 0.0, []
    for index in range(corridors + 1):
        size = _MARGIN if index in (0, corridors) else float(chance.choice(_BLOCKS))
        found.append((round(at, 6), round(at + size, 6)))
        at += size + float(chance.choice(_CORRIDORS))
    return found


def _stretches(corridors: int) -> list[Stretch]:
    along = [((i, j), (i + 1, j)) for i in range(corridors - 1) for j in range(corridors)]
    return along + [((j, i), (j, i + 1)) for i in range(corridors - 1) for j in range(corridors)]


def _closed_off(stretches: list[Stretch], chance: np.random.Generator) -> list[Stretch]:
    """Some stretches whose fire doors are shut; every junction keeps two ways out and can be reached."""
    ways: dict[Junction, set[Junction]] = {}
    for a, b in stretches:
        ways.setdefault(a, set()).add(b)
        ways.setdefault(b, set()).add(a)
    closed: list[Stretch] = []
    for index in chance.permutation(len(stretches)).tolist():
        a, b = stretches[index]
        # The first block's lap stays open: it is the room's route.
        if len(closed) >= _CLOSED_OFF * len(stretches) or max(*a, *b) <= 1:
            continue
        if min(len(ways[a]), len(ways[b])) < 3:
            continue
        ways[a].remove(b)
        ways[b].remove(a)
        if _reached(ways) < len(ways):
            ways[a].add(b)
            ways[b].add(a)
        else:
            closed.append((a, b))
    return closed


def _reached(ways: dict[Junction, set[Junction]]) -> int:
    seen, waiting = {(0, 0)}, [(0, 0)]
    while waiting:
        for following in ways[waiting.pop()] - seen:
            seen.add(following)
            waiting.append(following)
    return len(seen)


def _fire_door(a: tuple[float, float], b: tuple[float, float]) -> Box:
    """A shut door across a corridor, halfway between two junctions; it reaches into the walls."""
    yaw_deg = 0.0 if a[0] == b[0] else 90.0
    return Box((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, max(_CORRIDORS) + 2 * 0.04, 0.08, _STOREY, yaw_deg, colour=GREY)


def _sides(c: int, r: int, corridors: int) -> dict[str, Stretch | None]:
    """The stretch of corridor along each side of a block: None beside the end of a corridor; no entry at the facade."""
    inside_c, inside_r = 1 <= c < corridors, 1 <= r < corridors
    found: dict[str, Stretch | None] = {}
    if r > 0:
        found["south"] = ((c - 1, r - 1), (c, r - 1)) if inside_c else None
    if r < corridors:
        found["north"] = ((c - 1, r), (c, r)) if inside_c else None
    if c > 0:
        found["west"] = ((c - 1, r - 1), (c - 1, r)) if inside_r else None
    if c < corridors:
        found["east"] = ((c, r - 1), (c, r)) if inside_r else None
    return found


class _Block:
    """What stands between four corridors: one or two rows of rooms, or a hall. Built up by its constructor."""

    def __init__(
        self,
        bounds: tuple[float, float, float, float],
        sides: dict[str, Stretch | None],
        closed: list[Stretch],
        plans: dict[tuple[float, int], Plan],
        chance: np.random.Generator,
    ) -> None:
        x0, x1, y0, y1 = bounds
        self.pieces: list[Piece] = []
        self.doorways: dict[Stretch, tuple[Doorway, ...]] = {}
        self._chance, self._plans = chance, plans
        walls = {  # each seen from the corridor, from its left end to its right
            "south": (Frame(x0, y0, 0.0), x1 - x0, y1 - y0),
            "east": (Frame(x1, y0, 90.0), y1 - y0, x1 - x0),
            "north": (Frame(x1, y1, 180.0), x1 - x0, y1 - y0),
            "west": (Frame(x0, y1, 270.0), y1 - y0, x1 - x0),
        }
        facing, share = self._faces(sides)
        for side, stretch in sides.items():
            frame, length, depth = walls[side]
            doors: tuple[tuple[float, bool], ...] = ()
            if side in facing and stretch is not None:
                doors = self._rooms(frame, length, share * depth, stretch, share == 1.0 and len(sides) == 4)
            gaps = [(s, _DOOR) for s, _ in doors]
            self.pieces += partition(frame.at(0, _WALL / 2), frame.at(length, _WALL / 2), _STOREY, *gaps)
            if stretch is not None:
                bare = [s for s, _ in doors] + [length / 2] * (stretch in closed)  # a fire door is in the middle
                self.pieces += frame.put(furnish_wall(length, tuple(bare), int(chance.integers(0, 4)), chance))
        if share == 0.5:
            frame, length, depth = walls[facing[0]]
            self.pieces += partition(frame.at(0, depth / 2), frame.at(length, depth / 2), _STOREY)

    def _faces(self, sides: dict[str, Stretch | None]) -> tuple[tuple[str, ...], float]:
        """On which sides the rooms have their doors, and how much of the block's depth they take."""
        if len(sides) < 4:  # at the facade: one row, towards the building
            return tuple(side for side, stretch in sides.items() if stretch is not None), 1.0
        faces = (("south", "north"), ("east", "west"))[int(self._chance.integers(2))]
        if self._chance.random() < _HALLS:
            return faces[:1], 1.0
        return faces, 0.5

    def _rooms(
        self, frame: Frame, length: float, depth: float, stretch: Stretch, hall: bool
    ) -> tuple[tuple[float, bool], ...]:
        """Build the rooms along one wall; returns where the doors are along it, m, and whether they are open."""
        chance, start = self._chance, 0.0
        doors: list[tuple[float, bool]] = []
        variant = 3 if hall else int(chance.integers(3))  # few plans, so that corridors look alike
        if (length, variant) not in self._plans:
            self._plans[length, variant] = _plan(length, variant, chance)
        for width, at in self._plans[length, variant]:
            middle, opened = start + at, bool(chance.random() < _OPEN)
            if start > 0:
                self.pieces += partition(frame.at(start, _WALL / 2), frame.at(start, depth), _STOREY)
            if opened:
                inside = (start + _WALL, start + width - _WALL, _WALL, depth - _WALL)
                if start > 0:
                    inside = (start + _WALL / 2, *inside[1:])
                if start + width < length - 0.01:
                    inside = (inside[0], start + width - _WALL / 2, *inside[2:])
                self.pieces += self._open_room(frame, inside, middle, hall)
                (x, y), (ahead_x, ahead_y) = frame.at(middle, 0), frame.at(middle, 1)
                inward = (float(round(ahead_x - x)), float(round(ahead_y - y)))
                self.doorways[stretch] = (*self.doorways.get(stretch, ()), Doorway(x, y, inward))
            else:
                self.pieces.append(door(frame.at(middle - _DOOR / 2, _WALL / 2), frame.yaw_deg, _DOOR))
            doors.append((middle, opened))
            start += width
        return tuple(doors)

    def _open_room(
        self, frame: Frame, inside: tuple[float, float, float, float], middle: float, hall: bool
    ) -> tuple[Piece, ...]:
        """The leaf of its door and its furniture, clear of a visitor's circle."""
        chance = self._chance
        left = bool(chance.random() < 0.5)
        hinge = middle + (-1 if left else 1) * (_DOOR / 2 + 0.03)
        swing = chance.uniform(0.0, 25.0) * (1 if left else -1)
        leaf = door(frame.at(hinge, _WALL - 0.03), frame.yaw_deg + 90.0 + float(swing), 0.95)
        keep_out = KeepOut(((middle - 1.0, middle + 1.0, 0.0, 1.25),), ((middle, LOOP_DEPTH, LOOP_RADIUS + 0.4),))
        found = furnish_room(inside, keep_out, 30 if hall else int(chance.integers(5, 12)), chance)
        if hall:
            found += _columns(inside, keep_out, found)
        return (leaf, *frame.put(found))


def _plan(length: float, variant: int, chance: np.random.Generator) -> Plan:
    """Split a row into rooms of about one width; each door keeps 1.1 m from the room's corners."""
    count = 1 if variant == 3 else max(int(length / (2.9, 3.6, 4.6)[variant]), 2)
    jitter = 0.25 if length / count > 3.3 else 0.0
    shares = np.cumsum([0.0, *(np.ones(count) + jitter * chance.uniform(-0.5, 0.5, count))])
    edges = shares / shares[-1] * length
    return tuple((float(width), float(chance.uniform(1.2, max(width - 1.2, 1.25)))) for width in np.diff(edges))


def _columns(
    inside: tuple[float, float, float, float], keep_out: KeepOut, standing: tuple[Piece, ...]
) -> tuple[Piece, ...]:
    """Round columns of a hall on a regular grid, where nothing stands in their way."""
    x0, x1, y0, y1 = inside
    found: list[Piece] = []
    for x in np.arange(x0 + 2.4, x1 - 1.0, 3.6).tolist():
        for y in np.arange(y0 + 3.6, y1 - 1.0, 3.6).tolist():
            box = (x - 0.22, x + 0.22, y - 0.22, y + 0.22)
            near = any(abs(p.x - x) < 1.4 and abs(p.y - y) < 1.4 for p in standing)
            if keep_out.allows(box) and not near:
                found.append(Cylinder(x, y, 0.22, _STOREY))
    return tuple(found)
