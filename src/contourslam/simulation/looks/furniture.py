"""What furniture is made of: its colour names the material, its measures what it is."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.chance import LOOKS
from contourslam.simulation.looks import materials, on_walls
from contourslam.simulation.looks.materials import Draw
from contourslam.simulation.looks.walls import Kind
from contourslam.simulation.pieces import (
    CARTON,
    DARK_WOOD,
    FABRIC,
    GREEN,
    GREY,
    PINE,
    RED,
    STEEL,
    WOOD,
    Box,
    Colour,
    Cylinder,
)

Bytes = NDArray[np.uint8]
_TILE = 1.8  # m; a material without a form is drawn once and cut from
_WOODS = (WOOD, PINE, DARK_WOOD)


class Shelf:
    """Gives the images of furniture; what looks alike shares one. Mutable.

    Parameters
    ----------
    pixel : float
        m.
    kind : {"home", "office", "hall"}
    seed : int
    """

    def __init__(self, pixel: float, kind: Kind, seed: int) -> None:
        self.pixel = pixel
        self._kind, self._seed = kind, seed
        self._images: dict[tuple[object, ...], Bytes] = {}
        self._cuts = np.random.default_rng([seed, LOOKS, 10**6])

    def side(self, box: Box, width: float, height: float) -> tuple[Bytes, tuple[float, float]]:
        """Image of an upright face, and where in it the face's upper left corner is."""
        kind = self._formed(box, width, height)
        if kind is not None:
            return self._whole(kind, box.colour, width, height), (0.0, 0.0)
        return self._cut(box, width < height)

    def lid(self, box: Box) -> tuple[Bytes, tuple[float, float]]:
        """Image of a top or a lower side."""
        if box.colour == CARTON:
            return self._whole(materials.cardboard, CARTON, box.length, box.width), (0.0, 0.0)
        return self._cut(box, box.length < box.width)

    def mantle(self, piece: Cylinder) -> Bytes:
        """Image of a column's mantle, once round it."""
        draw = materials.leaves if piece.colour == GREEN else materials.plain
        return self._whole(draw, piece.colour, 2 * math.pi * piece.radius, piece.top - piece.bottom)

    def _formed(self, box: Box, width: float, height: float) -> Draw | None:
        """What is drawn to the measures of the face; None for a material without a form."""
        wide = width > 0.9 * max(box.length, box.width)
        bulky = min(box.length, box.width) >= 0.3 and height >= 0.35
        soft = box.colour in (FABRIC, RED)
        if box.colour == DARK_WOOD and height > 1.9 and min(box.length, box.width) < 0.07 and wide:
            return lambda w, h, pixel, _, chance: on_walls.door(w, h, pixel, chance)
        if box.colour == FABRIC and box.bottom > 0.85 and wide and height > 0.4:
            return lambda w, h, pixel, _, chance: on_walls.framed(w, h, pixel, chance)
        if box.bottom > 0.5 and 0.2 < height < 0.3 and box.colour in (RED, FABRIC, GREEN):
            return materials.books
        if box.colour == CARTON:
            return materials.cardboard
        if box.colour in (GREY, STEEL) or (self._kind == "hall" and box.colour == GREEN):
            column = height > 3.0
            return materials.metal if (bulky or height > 0.5) and not column else None
        if box.colour in _WOODS and bulky:
            return materials.cabinet if wide and self._kind != "hall" else None
        return materials.fabric if soft and self._kind != "hall" else None

    def _whole(self, draw: Draw, colour: Colour, width: float, height: float) -> Bytes:
        name = draw.__name__ if draw.__name__ != "<lambda>" else str(draw.__code__.co_names)
        key = (name, colour, round(width, 2), round(height, 2))
        if key not in self._images:
            self._images[key] = draw(width, height, self.pixel, colour, self._chance()).image()
        return self._images[key]

    def _cut(self, box: Box, upright: bool) -> tuple[Bytes, tuple[float, float]]:
        """A piece of the material's tile, taken from anywhere in it."""
        material: Draw = materials.plain
        if box.colour in _WOODS:
            material = materials.wood
        elif box.colour in (FABRIC, RED) and self._kind != "hall":
            material = materials.fabric
        key = (material.__name__, box.colour, upright)
        if key not in self._images:
            # A hair longer than wide tells wood which way its grain runs.
            width, height = (_TILE, _TILE * 1.01) if upright else (_TILE * 1.01, _TILE)
            self._images[key] = material(width, height, self.pixel, box.colour, self._chance()).image()
        rows, columns = self._images[key].shape[:2]
        return self._images[key], (float(self._cuts.integers(columns)), float(self._cuts.integers(rows)))

    def _chance(self) -> np.random.Generator:
        return np.random.default_rng([self._seed, LOOKS, 10**6 + 1 + len(self._images)])
