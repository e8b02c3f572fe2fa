"""All surfaces of a room, painted."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.chance import LOOKS
from contourslam.simulation.looks.floors import draw_ceiling, draw_floor
from contourslam.simulation.looks.furniture import Shelf
from contourslam.simulation.looks.walls import Kind, Style, draw_style, draw_wall
from contourslam.simulation.pieces import WHITE, Box, Cylinder, Piece
from contourslam.simulation.room import Room
from contourslam.simulation.textures import Surface

Floats = NDArray[np.float64]
_FINEST, _COARSEST, _PIXELS = 0.005, 0.02, 9e6  # m per pixel, and pixels in all
_DEEP = 0.7  # m before a wall in which furniture hides what would hang there
_FACETS = 32
_HALL_HEIGHT = 3.5  # m
_THIN = 0.15  # m; inner walls are, chimney breasts are not


def paint(room: Room, seed: int) -> tuple[Surface, ...]:
    """Paint floor, ceiling, walls and pieces; see :func:`~contourslam.simulation.textures.room_textures`."""
    pixel = _resolution(room)
    style = draw_style(_kind(room), _stream(seed, 2))
    shelf = Shelf(pixel, style.kind, seed)
    surfaces = [draw_floor(room, style.kind, pixel, _stream(seed, 0)), draw_ceiling(room, style.kind, _stream(seed, 1))]
    count = len(room.outline)
    for index in range(count):
        start, end = (np.array(room.outline[k % count]) for k in (index, index + 1))
        # Free space is on the left of the outline: from there, the side's end is its left edge.
        surfaces.append(_wall(f"wall{index}", end, start, 0.0, room.wall_height, room, None, style, pixel, seed, index))
    for index, piece in enumerate(room.pieces):
        name = f"piece{index}"
        if isinstance(piece, Cylinder):
            surfaces += _mantle(name, piece, shelf)
        elif _is_wall(piece):
            ends = piece.footprint()
            for k in range(4):
                a, b = ends[k], ends[(k + 1) % 4]
                if math.dist(a, b) > 0.3:
                    number = 1000 + 4 * index + k
                    face = _wall(f"{name}.{k}", a, b, piece.bottom, piece.top, room, piece, style, pixel, seed, number)
                    surfaces.append(face)
                else:
                    surfaces.append(_upright(f"{name}.{k}", a, b, piece, shelf))
            surfaces += _lids(name, piece, shelf)
        else:
            ends = piece.footprint()
            surfaces += [_upright(f"{name}.{k}", ends[k], ends[(k + 1) % 4], piece, shelf) for k in range(4)]
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


def _wall(
    name: str, left: Floats, right: Floats, bottom: float, top: float, room: Room, own: Box | None, style: Style,
    pixel: float, seed: int, number: int,
) -> Surface:  # fmt: skip
    """A wall between two points of the floor plan, as seen from the free space before it."""
    width, height = math.dist(left, right), top - bottom
    along = (right - left) / width
    before = np.array([along[1], -along[0]])  # to the viewer
    taken = _in_front(left, along, before, width, bottom, room, own)

    def free(x0: float, x1: float, z0: float, z1: float) -> bool:
        return not any(x0 < b and a < x1 and z0 < d and c < z1 for a, b, c, d in taken)

    canvas = draw_wall(width, height, pixel, style, free, _stream(seed, 3 + number), on_floor=bottom < 0.1)
    corner = np.array([left[0], left[1], top])
    return Surface(
        name, corner, np.array([*along, 0.0]), np.array([0.0, 0.0, -1.0]), width, height, canvas.image(), pixel
    )


def _in_front(
    left: Floats, along: Floats, before: Floats, width: float, bottom: float, room: Room, own: Box | None
) -> list[tuple[float, float, float, float]]:
    """Rectangles of a wall (x0, x1, z0, z1, m) that pieces stand before."""
    found = []
    for piece in room.pieces:
        if piece is own:
            continue
        off = _footprint(piece) - left
        x, depth = off @ along, off @ before
        if depth.min() < _DEEP and depth.max() > 0.01 and x.max() > 0 and x.min() < width:
            found.append((float(x.min()), float(x.max()), piece.bottom - bottom, piece.top - bottom))
    return found


def _footprint(piece: Piece) -> Floats:
    if isinstance(piece, Box):
        return piece.footprint()
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
