"""What stands between four corridors of an office floor: rooms in rows or a hall, their doors and furniture."""

import numpy as np

from contourslam.simulation.furnishing import Frame, KeepOut, furnish_room, furnish_wall
from contourslam.simulation.pieces import Cylinder, Piece, door, partition
from contourslam.simulation.ways import LOOP_DEPTH, LOOP_RADIUS, Doorway, Stretch

Plan = tuple[tuple[float, float], ...]  # width of each room along a corridor, and where in it the door is, m
STOREY = 2.8  # m
_WALL, _DOOR = 0.12, 1.0  # m
_OPEN, _HALLS = 0.6, 0.15  # shares of doors and of blocks


class Block:
    """What stands between four corridors: one or two rows of rooms, or a hall.

    Parameters
    ----------
    bounds : tuple of float
        x from, x to, y from, y to, m.
    sides : dict
        The stretch of corridor along each side: None beside the end of a corridor; no entry at the facade.
    closed : list of Stretch
        Those with a shut fire door across.
    plans : dict
        The building's floor plans by length and variant, shared by all blocks so that they look alike; added to.
    chance : numpy.random.Generator

    Attributes
    ----------
    pieces : list of Box or Cylinder
        In the world frame.
    doorways : dict
        Open doors by stretch of corridor.
    """

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
            self.pieces += partition(frame.at(0, _WALL / 2), frame.at(length, _WALL / 2), STOREY, *gaps)
            if stretch is not None:
                bare = [s for s, _ in doors] + [length / 2] * (stretch in closed)  # a fire door is in the middle
                self.pieces += frame.put(furnish_wall(length, tuple(bare), int(chance.integers(0, 4)), chance))
        if share == 0.5:
            frame, length, depth = walls[facing[0]]
            self.pieces += partition(frame.at(0, depth / 2), frame.at(length, depth / 2), STOREY)

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
                self.pieces += partition(frame.at(start, _WALL / 2), frame.at(start, depth), STOREY)
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
                found.append(Cylinder(x, y, 0.22, STOREY))
    return tuple(found)
