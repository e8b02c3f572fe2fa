"""A local map of contour points, one averaged point a cell, and a table that gives the nearest one at once."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel

Tiles = NDArray[np.int16 | np.int32]
CELL = 0.05  # m; one averaged point a cell
REACH = 5  # cells around a point in which it may be the nearest one
TILE = 32  # cells along the side of a tile; tiles are taken only where there are points
MOST = 30.0  # sightings that an averaged point weighs at most, so that it follows a surface that was seen badly first
MOST_POINTS = 32_000  # where the tables hold 16 bits; a stretch of some metres sees a tenth of that
COLUMNS = 5  # x, y, nx, ny, sightings


@kernel
def nearest(index: Tiles, tiles: Tiles, x: float, y: float) -> int:
    """Row of the averaged point nearest to x, y (m from the table's corner); -1 where none lies within reach."""
    i, j = math.floor(x / CELL), math.floor(y / CELL)
    if i < 0 or j < 0 or i >= index.shape[0] * TILE or j >= index.shape[1] * TILE:
        return -1
    tile = index[i // TILE, j // TILE]
    return -1 if tile < 0 else int(tiles[tile, i % TILE, j % TILE])


@kernel
def _stamp(index: Tiles, tiles: Tiles, used: int, rows: Floats, point: int, x0: float, y0: float) -> int:
    """Make `point` the nearest one of the cells around it, where no nearer one is; returns the number of tiles used."""
    x, y = rows[point, 0] - x0, rows[point, 1] - y0
    i0, j0 = math.floor(x / CELL), math.floor(y / CELL)
    for i in range(max(i0 - REACH, 0), min(i0 + REACH + 1, index.shape[0] * TILE)):
        for j in range(max(j0 - REACH, 0), min(j0 + REACH + 1, index.shape[1] * TILE)):
            cx, cy = (i + 0.5) * CELL, (j + 0.5) * CELL
            squared = (cx - x) ** 2 + (cy - y) ** 2
            if squared > (REACH * CELL) ** 2:
                continue
            tile = index[i // TILE, j // TILE]
            if tile < 0:
                if used == tiles.shape[0]:
                    continue
                tile = used
                index[i // TILE, j // TILE] = tile
                tiles[tile] = -1
                used += 1
            other = tiles[tile, i % TILE, j % TILE]
            if other >= 0:
                ox, oy = rows[other, 0] - x0, rows[other, 1] - y0
                if (cx - ox) ** 2 + (cy - oy) ** 2 <= squared:
                    continue
            tiles[tile, i % TILE, j % TILE] = point
    return used


@kernel
def _insert(
    index: Tiles, tiles: Tiles, used: int, rows: Floats, count: int, x0: float, y0: float, oriented: Floats,
    pose: Floats,
) -> tuple[int, int]:  # fmt: skip
    """Average points into the rows, or append them; returns the numbers of rows and tiles used."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    most = min(rows.shape[0], MOST_POINTS) if tiles.itemsize == 2 else rows.shape[0]
    for k in range(oriented.shape[0]):
        x = pose[0] + cos * oriented[k, 0] - sin * oriented[k, 1]
        y = pose[1] + sin * oriented[k, 0] + cos * oriented[k, 1]
        nx, ny = cos * oriented[k, 2] - sin * oriented[k, 3], sin * oriented[k, 2] + cos * oriented[k, 3]
        if not (0.0 <= x - x0 < index.shape[0] * TILE * CELL and 0.0 <= y - y0 < index.shape[1] * TILE * CELL):
            continue
        near = nearest(index, tiles, x - x0, y - y0)
        if near >= 0:
            row = rows[near]
            alike = nx * row[2] + ny * row[3] > 0.7
            if alike and (x - row[0]) ** 2 + (y - row[1]) ** 2 < CELL * CELL:
                weight = 1.0 / (min(row[4], MOST) + 1.0)
                row[0] += weight * (x - row[0])
                row[1] += weight * (y - row[1])
                row[2] += weight * (nx - row[2])
                row[3] += weight * (ny - row[3])
                length = math.hypot(row[2], row[3])
                row[2] /= length
                row[3] /= length
                row[4] += 1.0
                continue
        if count == most:
            break
        rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3], rows[count, 4] = x, y, nx, ny, 1.0
        used = _stamp(index, tiles, used, rows, count, x0, y0)
        count += 1
    return count, used


class CellMap:
    """Averaged contour points and a table of the nearest one; changed in place by :meth:`insert`.

    Attributes
    ----------
    rows : ndarray, shape (capacity, 5)
        x, y (m), unit normal, sightings; the first `count` hold.
    index : ndarray of int, shape (n, n)
        Number of the tile that covers each square of the plane, -1 for none.
    tiles : ndarray of int, shape (capacity, 32, 32)
        Row of the point nearest to each cell, -1 where none lies within reach.
    x0, y0 : float
        Corner of the table, m.

    Parameters
    ----------
    centre : ndarray, shape (>= 2,)
        m.
    half_width : float
        Points farther than this from the centre, along x or y, are left out, m.
    large : bool
        The tables take twice the memory and hold the points of a whole building, not only `MOST_POINTS`.
    """

    def __init__(self, centre: Floats, half_width: float, *, large: bool = False) -> None:
        side = math.ceil(2.0 * half_width / (CELL * TILE))
        number: type[np.int16 | np.int32] = np.int32 if large else np.int16
        self.index: Tiles = np.full((side, side), -1, number)
        self.tiles: Tiles = np.empty((64, TILE, TILE), number)
        self.rows: Floats = np.empty((1024, COLUMNS))
        self.count = self._used = 0
        self.x0 = float(centre[0]) - 0.5 * side * CELL * TILE
        self.y0 = float(centre[1]) - 0.5 * side * CELL * TILE

    def insert(self, oriented: Floats, pose: Floats) -> None:
        """Take in the oriented points of a scan whose frame lies at `pose`."""
        while self.count + len(oriented) > len(self.rows):
            self.rows = np.concatenate([self.rows, np.empty_like(self.rows)])
        # A point can touch four tiles; hardly any scan takes as many new ones as it has points.
        while self._used + min(len(oriented), self.index.size) > len(self.tiles):
            self.tiles = np.concatenate([self.tiles, np.empty_like(self.tiles)])
        self.count, self._used = _insert(
            self.index, self.tiles, self._used, self.rows, self.count, self.x0, self.y0, oriented, pose
        )

    @property
    def points(self) -> Floats:
        """The averaged points: x, y, nx, ny, sightings; a view."""
        return self.rows[: self.count]
