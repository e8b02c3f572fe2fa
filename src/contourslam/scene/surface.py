"""Flat surfaces of the scene and the grid of texels on each."""

import math
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
FLAT = ("floor", "top")
"""Kinds of surfaces that lie."""
T = TypeVar("T", bound=np.generic)
SIDE = 8
"""Texels along each side of a cell: for a whole cell the same pictures are chosen."""


@dataclass(frozen=True, slots=True)
class Surface:
    """A rectangle that is seen from one side.

    Attributes
    ----------
    name : str
        "wall-12" for wall 12 of the map, "contour-3" for what contours show beside the walls, "floor-0".
    kind : str
        "wall", "contour", "behind" (a wall hidden by furniture), "top" (of furniture) or "floor".
    origin : ndarray, shape (3,)
        Its lower left corner as its viewer sees it, world frame with z up, m.
    across, up : ndarray, shape (3,)
        Unit vectors along its lower edge, to the viewer's right, and upward. The floor's go along x and y.
    width, height : float
        Its extent along the two, m.
    parts : ndarray, shape (p, 4), optional
        The rectangles that are really there, in the two directions: left, lower, right, upper, m. None for all of it.
    """

    name: str
    kind: str
    origin: Floats
    across: Floats
    up: Floats
    width: float
    height: float
    parts: Floats | None = None

    @property
    def normal(self) -> Floats:
        """Unit vector towards the viewer, shape (3,)."""
        (ax, ay, az), (ux, uy, uz) = self.across.tolist(), self.up.tolist()
        return np.array([ay * uz - az * uy, az * ux - ax * uz, ax * uy - ay * ux])  # np.cross takes ten times as long

    @property
    def segment(self) -> Floats:
        """Ends of the lower edge in the plane, shape (2, 2), m; seen from free space the first is to the left."""
        return np.stack([self.origin[:2], (self.origin + self.width * self.across)[:2]])

    @property
    def area(self) -> float:
        """Extent, m²."""
        if self.parts is None:
            return self.width * self.height
        return float(np.sum((self.parts[:, 2] - self.parts[:, 0]) * (self.parts[:, 3] - self.parts[:, 1])))

    def at(self, u: Floats, v: Floats) -> Floats:
        """World positions at distances along the two directions (m), shape (..., 3)."""
        return np.asarray(self.origin + np.asarray(u)[..., None] * self.across + np.asarray(v)[..., None] * self.up)

    def cut(self, height: float) -> "Surface":
        """Give the surface with another height, m."""
        return replace(self, height=height)


def upright(name: str, kind: str, left: Floats, right: Floats, height: float) -> Surface:
    """Raise a segment from the floor.

    Parameters
    ----------
    name, kind : str
    left, right : ndarray, shape (2,)
        Ends of the segment as seen from free space, m.
    height : float
        m.
    """
    across = np.append(right - left, 0.0)
    width = float(np.linalg.norm(across))
    return Surface(name, kind, np.append(left, 0.0), across / width, np.array([0.0, 0.0, 1.0]), width, height)


def middles(side: int) -> Floats:
    """Middles of side by side squares in a cell, row by row, in parts of the cell: down and right, shape (side², 2)."""
    along = (np.arange(side) + 0.5) / side
    return np.stack([np.repeat(along, side), np.tile(along, side)], axis=1)


@dataclass(frozen=True, slots=True)
class TexelGrid:
    """Where the texels of all surfaces are, in cells of SIDE by SIDE; a cell's texels are row by row from its top left.

    Attributes
    ----------
    surfaces : tuple of Surface
    shapes : ndarray of int, shape (s, 2)
        Rows and columns of cells of each surface.
    starts : ndarray of int, shape (s + 1,)
        Cells ``starts[i]:starts[i + 1]`` belong to surface i, row by row from its top left.
    """

    surfaces: tuple[Surface, ...]
    shapes: NDArray[np.int64]
    starts: NDArray[np.int64]

    @classmethod
    def over(cls, surfaces: tuple[Surface, ...], texel: float) -> "TexelGrid":
        """Lay texels of about this side (m) over surfaces."""
        sizes = np.array([[s.height, s.width] for s in surfaces], dtype=np.float64).reshape(-1, 2)
        shapes = np.maximum(np.ceil(sizes / (texel * SIDE) - 1e-9), 1).astype(np.int64)
        return cls(surfaces, shapes, np.concatenate([[0], np.cumsum(shapes[:, 0] * shapes[:, 1])]))

    @property
    def cells(self) -> int:
        """How many cells there are."""
        return int(self.starts[-1])

    def surface_of(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        """Which surface each cell belongs to."""
        return np.searchsorted(self.starts, cells, side="right") - 1

    def places(self, cells: NDArray[np.int64], offsets: Floats) -> Floats:
        """World positions in cells of one surface.

        Parameters
        ----------
        cells : ndarray of int, shape (c,)
            All of the same surface.
        offsets : ndarray, shape (k, 2)
            Down from a cell's top and right from its left, in parts of the cell.

        Returns
        -------
        ndarray, shape (c, k, 3)
            m.
        """
        surface = int(self.surface_of(cells[:1])[0])
        rows, columns = self.shapes[surface].tolist()
        flat, (row, column) = self.surfaces[surface], np.divmod(cells - self.starts[surface], columns)
        down = (row[:, None] + offsets[:, 0]) / rows
        right = (column[:, None] + offsets[:, 1]) / columns
        return flat.at(right * flat.width, (1.0 - down) * flat.height)

    def image(self, surface: int, values: NDArray[T]) -> NDArray[T]:
        """Arrange the texels of a surface as an image.

        Parameters
        ----------
        surface : int
        values : ndarray, shape (cells, SIDE * SIDE, ...)
            Of all surfaces.

        Returns
        -------
        ndarray, shape (rows, columns, ...)
            The top row first.
        """
        rows, columns = self.shapes[surface].tolist()
        own, rest = values[self.starts[surface] : self.starts[surface + 1]], values.shape[2:]
        blocks = own.reshape(rows, columns, SIDE, SIDE, *rest).swapaxes(1, 2)
        return blocks.reshape(rows * SIDE, columns * SIDE, *rest)

    def put(self, surface: int, values: NDArray[T], image: NDArray[T]) -> None:
        """Put an image back to where :meth:`image` took it from."""
        rows, columns = self.shapes[surface].tolist()
        rest = values.shape[2:]
        blocks = image.reshape(rows, SIDE, columns, SIDE, *rest).swapaxes(1, 2)
        values[self.starts[surface] : self.starts[surface + 1]] = blocks.reshape(-1, SIDE * SIDE, *rest)


def texel_for(surfaces: tuple[Surface, ...], wanted: float, most: int) -> float:
    """Side of a texel (m): the wanted one, or larger where there would be more than `most` texels."""
    total = sum(TexelGrid.over(surfaces, wanted).shapes.prod(axis=1)) * SIDE * SIDE if surfaces else 0
    if total <= most:
        return wanted
    texel = wanted
    while TexelGrid.over(surfaces, texel).cells * SIDE * SIDE > most:
        grown = texel * max(math.sqrt(TexelGrid.over(surfaces, texel).cells * SIDE * SIDE / most), 1.05)
        if grown > 1.0:  # cells are metres wide, and each surface has one at least
            return grown
        texel = grown
    return texel
