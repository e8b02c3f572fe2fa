"""An occupancy grid from scans at known poses, gathered scan by scan in bounded memory."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ResultError
from contourslam.kernels import kernel

Floats = NDArray[np.float64]
Counts = NDArray[np.uint16]

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Values of a cell, as in ROS's OccupancyGrid message."""

_FULL = np.iinfo(np.uint16).max


@kernel
def trace_rays(hits: Counts, passes: Counts, origins: Floats, ends: Floats) -> None:
    """Count, for each beam, the cells it crosses and the one it ends in (Amanatides and Woo 1987).

    Parameters
    ----------
    hits, passes : ndarray of uint16, shape (rows, columns)
        Counts, changed in place; they stop at 65535.
    origins, ends : ndarray, shape (n, 2)
        First and last point of each beam as (column, row), in cells; all inside the grid.
    """
    for beam in range(len(ends)):
        x, y = origins[beam, 0], origins[beam, 1]
        column, row = math.floor(x), math.floor(y)
        last_column, last_row = math.floor(ends[beam, 0]), math.floor(ends[beam, 1])
        dx, dy = ends[beam, 0] - x, ends[beam, 1] - y
        step_x, step_y = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        # Fraction of the beam at which it crosses the next cell border in x and in y, and between two such borders.
        each_x = abs(1.0 / dx) if dx != 0.0 else math.inf
        each_y = abs(1.0 / dy) if dy != 0.0 else math.inf
        next_x = (column + (dx > 0) - x) / dx if dx != 0.0 else math.inf
        next_y = (row + (dy > 0) - y) / dy if dy != 0.0 else math.inf
        for _ in range(abs(last_column - column) + abs(last_row - row)):
            if passes[row, column] < _FULL:
                passes[row, column] += 1
            if row == last_row or (next_x < next_y and column != last_column):
                column += step_x
                next_x += each_x
            else:
                row += step_y
                next_y += each_y
        if hits[last_row, last_column] < _FULL:
            hits[last_row, last_column] += 1


class OccupancyGrid:
    """Counts how often beams ended in each cell and how often they crossed it. Mutable: it grows as scans come in.

    Parameters
    ----------
    resolution : float
        Side of a cell, m.
    max_cells : int
        The grid holds no more cells than this (4 bytes each); a larger area doubles the side of its cells instead.
    coarsest : float
        An area that would need cells larger than this, m, is taken for a broken trajectory.
    """

    def __init__(self, resolution: float = 0.05, *, max_cells: int = 25_000_000, coarsest: float = 1.0) -> None:
        if not (math.isfinite(resolution) and resolution > 0):
            raise ResultError(f"the side of a map cell must be a positive number of metres, got {resolution!r}")
        self.resolution = resolution
        self.corner = np.zeros(2, dtype=np.int64)
        """Column and row of the first cell, counted from the world's origin."""
        self.hits: Counts = np.zeros((0, 0), dtype=np.uint16)
        self.passes: Counts = np.zeros((0, 0), dtype=np.uint16)
        self._max_cells = max_cells
        self._coarsest = coarsest

    def add(self, origins: Floats, ends: Floats) -> None:
        """Add beams.

        Parameters
        ----------
        origins, ends : ndarray, shape (n, 2)
            Where each beam started and ended in the world frame, m.

        Raises
        ------
        ResultError
            If a point is not finite or lies so far out that no map of this size could hold it.
        """
        if len(ends) == 0:
            return
        points = np.concatenate([origins, ends])
        low, high = points.min(axis=0), points.max(axis=0)
        if not (np.isfinite(low).all() and np.isfinite(high).all()):
            raise ResultError("a beam of the occupancy map is not finite; check the trajectory")
        self._reserve(low, high)
        shift = self.corner.astype(np.float64)
        trace_rays(self.hits, self.passes, origins / self.resolution - shift, ends / self.resolution - shift)

    def _reserve(self, low: Floats, high: Floats) -> None:
        """Make the grid cover the box from `low` to `high`, m, with room to grow on the sides that moved."""
        while True:
            # One cell more on every side: a point may round into the next cell once it is counted from the corner.
            first = np.floor(low / self.resolution) - 1
            last = np.floor(high / self.resolution) + 2
            shape = np.array(self.hits.shape[::-1])
            if shape.all():
                first, last = np.minimum(first, self.corner), np.maximum(last, self.corner + shape)
            if float(np.prod(last - first)) <= self._max_cells:
                break
            if self.resolution * 2 > self._coarsest:
                raise ResultError(
                    f"the map would span {(last - first)[0] * self.resolution:.0f} by "
                    f"{(last - first)[1] * self.resolution:.0f} m; check the trajectory, or raise the cell size"
                )
            self._coarsen()
        if shape.all() and (first == self.corner).all() and (last == self.corner + shape).all():
            return
        margin = np.ceil(0.25 * (last - first))
        roomy_first = np.where(first < self.corner, first - margin, first) if shape.all() else first
        roomy_last = np.where(last > self.corner + shape, last + margin, last) if shape.all() else last
        if float(np.prod(roomy_last - roomy_first)) <= self._max_cells:
            first, last = roomy_first, roomy_last
        self._move(first.astype(np.int64), last.astype(np.int64))

    def _move(self, first: NDArray[np.int64], last: NDArray[np.int64]) -> None:
        columns, rows = last - first
        x, y = self.corner - first
        for name in ("hits", "passes"):
            old: Counts = getattr(self, name)
            new = np.zeros((int(rows), int(columns)), dtype=np.uint16)
            if old.size:
                new[y : y + old.shape[0], x : x + old.shape[1]] = old
            setattr(self, name, new)
        self.corner = first

    def _coarsen(self) -> None:
        """Double the side of the cells, adding up four counts into one."""
        if self.hits.size:
            first = 2 * (self.corner // 2)
            last = 2 * -(-(self.corner + np.array(self.hits.shape[::-1])) // 2)
            self._move(first, last)
            self.corner = first // 2
            for name in ("hits", "passes"):
                fine = getattr(self, name).astype(np.uint32)
                coarse = fine[::2, ::2] + fine[1::2, ::2] + fine[::2, 1::2] + fine[1::2, 1::2]
                setattr(self, name, np.minimum(coarse, _FULL).astype(np.uint16))
        self.resolution *= 2

    def cells(self, *, min_hit_rate: float = 0.25) -> tuple[NDArray[np.int8], tuple[float, float]]:
        """Give the grid, cut to what was seen.

        Parameters
        ----------
        min_hit_rate : float
            A cell is occupied where at least this part of the beams that reached it ended there.

        Returns
        -------
        cells : ndarray of int8, shape (rows, columns)
            FREE, OCCUPIED or UNKNOWN; the first row has the smallest y.
        origin : tuple of float
            x and y of the outer corner of the first cell, m.
        """
        seen = (self.hits > 0) | (self.passes > 0)
        if not seen.any():
            return np.full((1, 1), UNKNOWN, dtype=np.int8), (0.0, 0.0)
        rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
        window = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
        hits, passes = self.hits[window].astype(np.float64), self.passes[window].astype(np.float64)
        occupied = (hits > 0) & (hits >= min_hit_rate * (hits + passes))
        cells = np.where(occupied, OCCUPIED, np.where(seen[window], FREE, UNKNOWN)).astype(np.int8)
        first = (self.corner + np.array([columns[0], rows[0]])) * self.resolution
        return cells, (float(first[0]), float(first[1]))
