"""The textures of all surfaces side by side on few sheets."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

LARGEST = 4096
"""Pixels along a side of a sheet: what graphics units have taken for long, those of phones too."""
BORDER = 4
"""Pixels that a texture goes on beyond its edges, so that none of its neighbours shines through."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a texture is.

    Attributes
    ----------
    sheet : int
    row, column : int
        Of its top left pixel.
    rows, columns : int
        Its size.
    """

    sheet: int
    row: int
    column: int
    rows: int
    columns: int


@dataclass(frozen=True, slots=True)
class Atlas:
    """Sheets and the places on them, one for each texture in their order."""

    sheets: tuple[Bytes, ...]
    places: tuple[Place, ...]


def pack(images: list[Bytes]) -> Atlas:
    """Put textures on sheets in shelves, the tall ones first.

    Parameters
    ----------
    images : list of ndarray of uint8, shape (rows, columns, 3)
        Each smaller than LARGEST by two borders.
    """
    sizes = np.array([image.shape[:2] for image in images]).reshape(-1, 2) + 2 * BORDER
    side = _side(sizes)
    places: dict[int, Place] = {}
    sheet = top = left = shelf = 0
    used = [[0, 0]]
    for index in np.lexsort((-sizes[:, 1], -sizes[:, 0])).tolist():
        rows, columns = sizes[index].tolist()
        if left + columns > side:
            top, left, shelf = top + shelf, 0, 0
        if top + rows > side:
            sheet, top, left, shelf = sheet + 1, 0, 0, 0
            used.append([0, 0])
        places[index] = Place(sheet, top + BORDER, left + BORDER, rows - 2 * BORDER, columns - 2 * BORDER)
        left, shelf = left + columns, max(shelf, rows)
        used[sheet] = [max(used[sheet][0], top + rows), max(used[sheet][1], left)]
    sheets = tuple(np.full((*size, 3), 128, np.uint8) for size in used)
    for index, image in enumerate(images):
        place = places[index]
        wide = np.pad(image, ((BORDER, BORDER), (BORDER, BORDER), (0, 0)), mode="edge")
        top, left = place.row - BORDER, place.column - BORDER
        sheets[place.sheet][top : top + wide.shape[0], left : left + wide.shape[1]] = wide
    return Atlas(sheets, tuple(places[index] for index in range(len(images))))


def _side(sizes: NDArray[np.int64]) -> int:
    """Side of a sheet on which all of it has room, as far as sheets go."""
    wanted = math.sqrt(1.15 * float(np.sum(sizes[:, 0] * sizes[:, 1]))) if len(sizes) else 1.0
    return int(min(max(wanted, sizes.max() if len(sizes) else 1), LARGEST))
