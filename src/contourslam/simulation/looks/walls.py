"""A wall with all that is on it: its ground, the skirting board, and things hung where furniture leaves room."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from contourslam.simulation.looks import materials, on_walls
from contourslam.simulation.looks.canvas import Canvas, Colour

Kind = Literal["home", "office", "hall"]
Free = Callable[[float, float, float, float], bool]  # whether x0, x1, z0, z1 (m) of the wall is in sight
_HOME = ((0.93, 0.88, 0.76), (0.74, 0.82, 0.80), (0.90, 0.80, 0.76), (0.80, 0.84, 0.72), (0.72, 0.78, 0.86))
_BRICK = (0.70, 0.40, 0.30)
_APART = 0.18  # m between two things

# What is hung in which style: the artist, sizes in m (width, height, at least; at most), height above the floor.
_THINGS: dict[Kind, tuple[tuple[on_walls.Artist, tuple[float, float], tuple[float, float], float], ...]] = {
    "home": (
        (on_walls.window, (1.3, 1.2), (1.7, 1.35), 0.85),
        (on_walls.framed, (0.7, 0.5), (1.2, 0.8), 1.15),
        (on_walls.framed, (0.45, 0.6), (0.6, 0.8), 1.15),
        (on_walls.poster, (0.6, 0.84), (0.7, 1.0), 0.95),
        (on_walls.framed, (0.3, 0.3), (0.4, 0.4), 1.35),
    ),
    "office": (
        (on_walls.whiteboard, (1.2, 0.9), (2.0, 1.1), 0.95),
        (on_walls.notice_board, (0.9, 0.7), (1.5, 0.9), 1.05),
        (on_walls.poster, (0.6, 0.84), (0.84, 1.19), 0.9),
        (on_walls.framed, (0.5, 0.5), (0.9, 0.7), 1.2),
        (on_walls.window, (1.2, 1.2), (1.8, 1.4), 0.9),
    ),
    "hall": (
        (on_walls.sign, (1.2, 0.6), (2.2, 1.0), 1.9),
        (on_walls.poster, (1.2, 1.7), (1.6, 2.2), 1.0),
        (on_walls.notice_board, (1.2, 0.8), (1.8, 1.0), 1.0),
        (on_walls.window, (1.8, 1.2), (2.6, 1.6), 2.9),
        (on_walls.sign, (0.5, 0.5), (0.7, 0.7), 1.5),
    ),
}


@dataclass(frozen=True, slots=True)
class Style:
    """What the walls of one room have in common.

    Attributes
    ----------
    kind : {"home", "office", "hall"}
    papers : tuple of two pairs
        Wallpaper and its colour: of most walls, and of some.
    """

    kind: Kind
    papers: tuple[tuple[materials.Draw, Colour], ...]


def draw_style(kind: Kind, chance: np.random.Generator) -> Style:
    """Choose the wallpapers of a room."""
    first, second = chance.permutation(len(_HOME))[:2].tolist()
    return Style(kind, ((materials.striped, _HOME[first]), (materials.plain, _HOME[second])))


def draw_wall(
    width: float, height: float, pixel: float, style: Style, free: Free, chance: np.random.Generator, *, on_floor: bool
) -> Canvas:
    """Draw a wall as it is seen from the free space before it.

    Parameters
    ----------
    width, height, pixel : float
        m.
    style : Style
        Of the whole room.
    free : callable
        Tells whether a rectangle of the wall (x0, x1, z0, z1 in m) is in sight.
    chance : numpy.random.Generator
    on_floor : bool
        Not the part of a wall above a door: it has a skirting board, and things hang on it.

    Returns
    -------
    Canvas
    """
    canvas = _ground(width, height, pixel, style, chance)
    if on_floor:
        skirting = 0.08 if style.kind != "hall" else 0.15
        canvas.fill(0.0, width, 0.0, skirting, (0.93, 0.92, 0.89) if style.kind != "hall" else (0.32, 0.33, 0.35))
        canvas.shade(0.0, width, skirting - 0.01, skirting, 0.72)
        _hang(canvas, style, free, chance)
    # Corners and the edge below the ceiling are a little darker, as no lamp of the simulation makes them.
    edge = np.minimum(np.minimum(canvas.x, width - canvas.x), height - canvas.z)
    canvas.pixels *= (1.0 - 0.14 * np.exp(-np.maximum(edge, 0.0) / 0.10))[..., None]
    return canvas


def _ground(width: float, height: float, pixel: float, style: Style, chance: np.random.Generator) -> Canvas:
    if style.kind == "hall":
        canvas = materials.plain(width, height, pixel, (0.78, 0.78, 0.76), chance)
        canvas.part(0.0, width, 0.0, 1.2)[:] *= np.array([0.62, 0.72, 0.74], dtype=np.float32)
        for k in range(1, max(1, int(width / 2.5)) + 1):  # joints of concrete slabs
            canvas.shade(2.5 * k - 0.012, 2.5 * k + 0.012, 0.0, height, 0.6)
        return canvas
    if style.kind == "office" or width < 0.5:
        return materials.plain(width, height, pixel, (0.90, 0.89, 0.86), chance)
    luck = chance.random()
    if luck < 0.25 and 0.9 < width < 5.0:
        return materials.brick(width, height, pixel, _BRICK, chance)
    paper, colour = style.papers[int(luck > 0.7)]
    canvas = paper(width, height, pixel, colour, chance)
    canvas.fill(0.0, width, height - 0.06, height, (0.95, 0.94, 0.92))
    canvas.shade(0.0, width, height - 0.07, height - 0.06, 0.75)
    return canvas


def _hang(canvas: Canvas, style: Style, free: Free, chance: np.random.Generator) -> None:
    """Hang things at random where there is room; large ones first."""
    taken: list[tuple[float, float]] = []
    things = _THINGS[style.kind]
    for index in range(max(1, round(1.1 * canvas.width))):
        artist, least, most, z = things[index % len(things)]
        w, h = (float(chance.uniform(a, b)) for a, b in zip(least, most, strict=True))
        if w + 0.3 > canvas.width or z + h + 0.1 > canvas.height:
            continue
        for x in chance.uniform(0.15, canvas.width - w - 0.15, 8).tolist():
            apart = all(x > right + _APART or x + w < left - _APART for left, right in taken)
            if apart and free(x, x + w, z, z + h):
                taken.append((x, x + w))
                canvas.shadow(x, x + w, z, z + h)
                canvas.put(x, z, artist(w, h, canvas.pixel, chance))
                if artist is on_walls.window and style.kind == "home" and free(x + 0.1, x + w - 0.1, 0.12, 0.72):
                    canvas.shadow(x + 0.1, x + w - 0.1, 0.15, 0.72)
                    canvas.put(x + 0.1, 0.15, on_walls.radiator(w - 0.2, 0.57, canvas.pixel, chance))
                break
    for x in np.arange(0.35, canvas.width - 0.3, 2.3).tolist():  # sockets
        canvas.fill(x, x + 0.08, 0.26, 0.34, (0.96, 0.96, 0.95))
        canvas.disc(x + 0.04, 0.30, 0.027, (0.82, 0.82, 0.81))
