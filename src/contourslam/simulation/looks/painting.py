"""All surfaces of a room, painted."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.chance import LOOKS
from contourslam.simulation.looks.floors import draw_ceiling, draw_floor
from contourslam.simulation.looks.furniture import Shelf
from contourslam.simulation.looks.surface import Surface
from contourslam.simulation.looks.walls import Kind, draw_style, draw_wall
from contourslam.simulation.pieces import WHITE, Box, Cylinder, Piece
from contourslam.simulation.room import Room

Floats = NDArray[np.float64]
_FINEST, _COARSEST, _PIXELS = 0.005, 0.02, 9e6  # m per pixel, and pixels in all
_DEEP = 0.7  # m before a wall in which furniture hides what would hang there
_FACETS = 32
_HALL_HEIGHT, _NARROW = 3.5, 0.3  # m
_THIN = 0.15  # m; inner walls are, chimney breasts are not


def paint(room: Room, seed: int) -> tuple[Surface, ...]:
    """Paint floor, ceiling, walls and pieces; see :func:`~contourslam.simulation.textures.room_textures`."""
    pixel = _resolution(room)
    walls = _Walls(room, pixel, seed)
    kind = walls.style.kind
    shelf = Shelf(pixel, kind, seed)
    surfaces = [draw_floor(room, kind, pixel, _stream(seed, 0)), draw_ceiling(room, kind, _stream(seed, 1))]
    # Free space is on the left of the outline: from there, a side's end is its left edge.
    ends = np.roll(np.array(room.outline), -1, axis=0)
    for index, (start, end) in enumerate(zip(np.array(room.outline), ends, strict=True)):
        surfaces.append(walls.wall(f"wall{index}", end, start, (0.0, room.wall_height), index, None))
    for index, piece in enumerate(room.pieces):
        name = f"piece{index}"
        if isinstance(piece, Cylinder):
            surfaces += _mantle(name, piece, shelf)
            continue
        corners = piece.footprint()
        for k, (left, right) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
            if _is_wall(piece) and math.dist(left, right) > _NARROW:
                number = 1000 + 4 * index + k
                face = walls.wall(f"{name}.{k}", left, right, (piece.bottom, piece.top), number, index)
            else:
                face = _upright(f"{name}.{k}", left, right, piece, shelf)
            surfaces.append(face)
        surfaces += _lids(name, piece, shelf)
    return tuple(surfaces)


def _stream(seed: int, number: int) -> np.random.Generator:
    """Chance of one surface's own, so that one more piece does not repaint the rest."""
    return np.random.default_rng([seed, LOOKS, number])


def _kind(room: Room) -> Kind:
    if room.wall_height > _HALL_HEIGHT:
        return "hall"
    partitions = (isinstance(piece, Box) and _is_wall(piece) and piece.width < _THIN for piece in room.pieces)
    return "office" if any(partitions) else "home"


def _is_wall(piece: Box) -> bool:
    """Whether a piece is an inner wall, the part of one above a door, or a chimney breast."""
    return piece.colour == WHITE and piece.top > 2.2


def _resolution(room: Room) -> float:
    x, y = np.array(room.outline).T
    along = float(np.hypot(np.roll(x, -1) - x, np.roll(y, -1) - y).sum())
    inner = [piece.length * 2.0 for piece in room.pieces if isinstance(piece, Box) and _is_wall(piece)]
    area = np.ptp(x) * np.ptp(y) + (along + sum(inner)) * room.wall_height
    return float(np.clip(math.sqrt(area / _PIXELS), _FINEST, _COARSEST))


class _Walls:
    """Paints the walls of one room, inner ones too."""

    def __init__(self, room: Room, pixel: float, seed: int) -> None:
        self.style = draw_style(_kind(room), _stream(seed, 2))
        self._pixel, self._seed = pixel, seed
        self._footprints = np.array([_footprint(piece) for piece in room.pieces]).reshape(-1, 8, 2)
        self._heights = np.array([(piece.bottom, piece.top) for piece in room.pieces]).reshape(-1, 2)

    def wall(
        self, name: str, left: Floats, right: Floats, heights: tuple[float, float], number: int, own: int | None
    ) -> Surface:
        """A wall between two points of the floor plan, as seen from the free space before it; `own` is its piece."""
        bottom, top = heights
        width = math.dist(left, right)
        along = (right - left) / width
        x0, x1, z0, z1 = self._in_front(left, along, width, bottom, own)

        def free(a: float, b: float, c: float, d: float) -> bool:
            return not bool(np.any((a < x1) & (x0 < b) & (c < z1) & (z0 < d)))

        chance = _stream(self._seed, 3 + number)
        size = width, top - bottom
        canvas = draw_wall(*size, self._pixel, self.style, free, chance, on_floor=bottom < 0.1)
        corner, down = np.array([left[0], left[1], top]), np.array([0.0, 0.0, -1.0])
        return Surface(name, corner, np.array([*along, 0.0]), down, *size, canvas.image(), self._pixel)

    def _in_front(
        self, left: Floats, along: Floats, width: float, bottom: float, own: int | None
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Bounds of the wall's rectangles that pieces stand before: x0, x1, z0, z1, m."""
        off = self._footprints - left
        x, depth = off @ along, off @ np.array([along[1], -along[0]])
        near = (depth.min(axis=1) < _DEEP) & (depth.max(axis=1) > 0.01) & (x.max(axis=1) > 0) & (x.min(axis=1) < width)
        near &= np.arange(len(off)) != (-1 if own is None else own)
        z0, z1 = (self._heights[near] - bottom).T
        return x[near].min(axis=1), x[near].max(axis=1), z0, z1


def _footprint(piece: Piece) -> Floats:
    """Eight points around a piece, some of them twice; shape (8, 2)."""
    if isinstance(piece, Box):
        return np.repeat(piece.footprint(), 2, axis=0)
    around = np.linspace(0.0, 2 * np.pi, 8, endpoint=False)
    return np.stack([piece.x + piece.radius * np.cos(around), piece.y + piece.radius * np.sin(around)], axis=1)


def _upright(name: str, left: Floats, right: Floats, piece: Box, shelf: Shelf) -> Surface:
    width, height = math.dist(left, right), piece.top - piece.bottom
    image, offset = shelf.side(piece, width, height)
    along = np.array([*((right - left) / width), 0.0])
    corner = np.array([left[0], left[1], piece.top])
    return Surface(name, corner, along, np.array([0.0, 0.0, -1.0]), width, height, image, shelf.pixel, offset)


def _lids(name: str, piece: Box, shelf: Shelf) -> list[Surface]:
    """The top, and the lower side of what does not stand on the floor."""
    image, offset = shelf.lid(piece)
    a, b, _, d = (np.array([*point, 0.0]) for point in piece.footprint())
    up = np.array([0.0, 0.0, 1.0])
    size = piece.length, piece.width, image, shelf.pixel, offset
    along, across = (b - a) / piece.length, (d - a) / piece.width
    found = [Surface(f"{name}.4", d + piece.top * up, along, -across, *size)]
    if piece.bottom > 0.02:
        found.append(Surface(f"{name}.5", a + piece.bottom * up, along, across, *size))
    return found


def _mantle(name: str, piece: Cylinder, shelf: Shelf) -> list[Surface]:
    image = shelf.mantle(piece)
    around = np.linspace(0.0, 2 * np.pi, _FACETS + 1)
    rim = np.stack([piece.x + piece.radius * np.cos(around), piece.y + piece.radius * np.sin(around)], axis=1)
    width, height = math.dist(rim[0], rim[1]), piece.top - piece.bottom
    down = np.array([0.0, 0.0, -1.0])
    found = []
    for k in range(_FACETS):
        along = np.array([*((rim[k + 1] - rim[k]) / width), 0.0])
        corner = np.array([*rim[k], piece.top])
        offset = (k * width / shelf.pixel, 0.0)
        found.append(Surface(f"{name}.{k}", corner, along, down, width, height, image, shelf.pixel, offset))
    return found
