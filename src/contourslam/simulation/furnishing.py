"""Furniture set down at random, clear of the way through: for buildings too large to be furnished by hand."""

import math
from dataclasses import dataclass, replace

import numpy as np

from contourslam.simulation.pieces import (
    CARTON,
    GREY,
    PINE,
    RED,
    STEEL,
    WHITE,
    Box,
    Cylinder,
    Piece,
    desk,
    place,
    plant,
    shelves,
    sofa,
    table,
)

_INTO_WALL = 0.005  # m by which furniture reaches into its wall: no sliver of free space behind it
_APART = 0.06  # m between two things, so that a round one always stands clear
Rectangle = tuple[float, float, float, float]  # x from, x to, y from, y to, m


@dataclass(frozen=True, slots=True)
class Frame:
    """Where a stretch of wall stands: its left end in the world frame (m), and its turn, a multiple of 90 degrees."""

    x: float
    y: float
    yaw_deg: float

    def at(self, px: float, py: float) -> tuple[float, float]:
        """World position of the point (px, py) of this frame, m."""
        return place(self.x, self.y, self.yaw_deg, px, py)

    def put(self, pieces: tuple[Piece, ...]) -> tuple[Piece, ...]:
        """Pieces given in this frame, in the world frame."""
        return tuple(self._put(piece) for piece in pieces)

    def _put(self, piece: Piece) -> Piece:
        x, y = self.at(piece.x, piece.y)
        if isinstance(piece, Box):
            return replace(piece, x=x, y=y, yaw_deg=piece.yaw_deg + self.yaw_deg)
        return replace(piece, x=x, y=y)


@dataclass(frozen=True, slots=True)
class KeepOut:
    """What furniture leaves free: rectangles, and discs of (x, y, radius), m."""

    rectangles: tuple[Rectangle, ...] = ()
    discs: tuple[tuple[float, float, float], ...] = ()

    def allows(self, box: Rectangle) -> bool:
        """Whether a bounding rectangle stays off everything to be left free."""
        for x, y, radius in self.discs:
            if math.hypot(max(box[0] - x, 0.0, x - box[1]), max(box[2] - y, 0.0, y - box[3])) < radius:
                return False
        return not any(_overlap(box, other, 0.0) for other in self.rectangles)


def furnish_room(inside: Rectangle, keep_out: KeepOut, tries: int, chance: np.random.Generator) -> tuple[Piece, ...]:
    """Furnish a room; what does not fit where chance puts it is left out.

    Parameters
    ----------
    inside : tuple of float
        Free rectangle of the room in its own frame; the door is on the side of the smallest y, which stays bare.
    keep_out : KeepOut
        In the same frame.
    tries : int
        How many things are tried.
    chance : numpy.random.Generator

    Returns
    -------
    tuple of Box or Cylinder
    """
    found: list[Piece] = []
    taken: list[Rectangle] = []
    for _ in range(tries):
        loose = chance.random() < 0.3
        pieces = _loose(inside, chance) if loose else _against_wall(inside, chance)
        box = _bounds(pieces)
        sunk = -_APART if loose else _INTO_WALL + 1e-9
        fits = box[0] >= inside[0] - sunk and box[1] <= inside[1] + sunk and box[2] >= inside[2] + _APART
        if fits and box[3] <= inside[3] + sunk and keep_out.allows(box):
            if any(_overlap(box, other, _APART) for other in taken):
                continue
            found += pieces
            taken.append(box)
    return tuple(found)


def furnish_wall(length: float, doors: tuple[float, ...], tries: int, chance: np.random.Generator) -> tuple[Piece, ...]:
    """Set things against a corridor's wall, which runs along x at y = 0 with the corridor at y < 0.

    Parameters
    ----------
    length : float
        Of the wall, m; its ends, where corridors cross, stay bare.
    doors : tuple of float
        Middles of the doors along it, m; about a metre on both sides of them stays free.
    tries : int
        How many things are tried.
    chance : numpy.random.Generator

    Returns
    -------
    tuple of Box or Cylinder
        None reaches more than 0.4 m into the corridor.
    """
    keep_out = KeepOut(tuple((s - 0.95, s + 0.95, -2.0, 1.0) for s in doors))
    found: list[Piece] = []
    taken: list[Rectangle] = []
    for _ in range(tries):
        x, kind = float(chance.uniform(0.9, length - 0.9)), int(chance.integers(6))
        if kind == 0:
            radius = float(chance.uniform(0.12, 0.16))
            pieces: tuple[Piece, ...] = plant(x, -1.5 * radius - _APART, radius)
        else:
            long, deep, top, colour = (
                (0.9, 0.4, 1.8, STEEL), (1.4, 0.36, 0.9, PINE), (0.4, 0.15, 2.6, WHITE), (0.6, 0.22, 1.1, RED),
                (1.2, 0.12, 0.7, GREY),
            )[kind - 1]  # fmt: skip
            pieces = (Box(x, _INTO_WALL - deep / 2, long, deep, top, colour=colour),)
        box = _bounds(pieces)
        if keep_out.allows(box) and not any(_overlap(box, other, _APART) for other in taken):
            found += pieces
            taken.append(box)
    return tuple(found)


def _against_wall(inside: Rectangle, chance: np.random.Generator) -> tuple[Piece, ...]:
    """Something that stands with its back to the left, the right or the far wall."""
    x0, x1, y0, y1 = inside
    wall, part, kind = int(chance.integers(3)), float(chance.uniform(0.15, 0.85)), int(chance.integers(6))
    deep = (0.75, 0.36, 0.9, 0.5, 0.45, 0.6)[kind]
    off = deep / 2 - _INTO_WALL
    x, y, yaw = (
        (x0 + off, y0 + part * (y1 - y0), -90.0),
        (x1 - off, y0 + part * (y1 - y0), 90.0),
        (x0 + part * (x1 - x0), y1 - off, 180.0),
    )[wall]
    if kind == 0:
        return desk(x, y, yaw + 180.0)
    if kind == 1:
        return shelves(x, y, float(chance.choice([1.0, 1.6])), deep, yaw)
    if kind == 2:
        return sofa(x, y, 1.7, yaw)
    long, top, colour = ((1.2, 1.8, GREY), (0.9, 1.4, STEEL), (0.8, 0.7, PINE))[kind - 3]
    return (Box(x, y, long, deep, top, yaw, colour=colour),)


def _loose(inside: Rectangle, chance: np.random.Generator) -> tuple[Piece, ...]:
    """Something that stands anywhere, turned anyhow."""
    x0, x1, y0, y1 = inside
    x, y, kind = float(chance.uniform(x0, x1)), float(chance.uniform(y0, y1)), int(chance.integers(4))
    yaw = float(chance.uniform(0.0, 180.0))
    if kind == 0:
        return plant(x, y, float(chance.uniform(0.14, 0.2)))
    if kind == 1:
        return table(x, y, 1.2, 0.7, yaw)
    if kind == 2:
        return (Cylinder(x, y, float(chance.uniform(0.15, 0.3)), 1.2),)
    long, wide = chance.uniform(0.35, 0.8, 2).tolist()
    return (Box(x, y, long, wide, 0.6, yaw, colour=CARTON),)


def _bounds(pieces: tuple[Piece, ...]) -> Rectangle:
    boxes = np.concatenate([piece.footprint() for piece in pieces if isinstance(piece, Box)] or [np.empty((0, 2))])
    rounds = [(p.x + s * p.radius, p.y + s * p.radius) for p in pieces if isinstance(p, Cylinder) for s in (-1, 1)]
    points = np.concatenate([boxes, np.array(rounds).reshape(-1, 2)])
    (x0, y0), (x1, y1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return x0, x1, y0, y1


def _overlap(a: Rectangle, b: Rectangle, apart: float) -> bool:
    return a[0] < b[1] + apart and b[0] < a[1] + apart and a[2] < b[3] + apart and b[2] < a[3] + apart
