"""A saved map made ready to be localised in: contours, where it is empty, tables to search, corners and walls."""

import math
from collections import OrderedDict

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.errors import ContourslamError, MapError
from contourslam.localization.free_space import CELL, FreeSpace, see_free
from contourslam.localization.global_search import Standing, standing_on
from contourslam.maps.saved_map import Contoured, SavedMap
from contourslam.matching.cell_map import CellMap
from contourslam.matching.constellation import Constellation
from contourslam.matching.oriented import move
from contourslam.matching.search_grid import SearchGrid, build_search_grid
from contourslam.matching.squares import averaged

MERGED = 0.05  # m; points of one cell of this size that look the same way are one
SEARCH_CELLS = (0.1, 0.2, 0.4)  # m; the first that the tables hold the map at
PATCH, REACH = 16.0, 30.0  # m; the contours around a pose are those of its patch, and so far beyond
ALL_AT_ONCE = 20_000  # points of a map that is one patch
KEPT = 24  # patches held ready
SIDE = 0.25  # m of each side of a corner that a map of landmarks alone is sure of
MARGIN = 2.0  # m around a map of landmarks alone in which the robot may be


class KnownMap:
    """A map to be localised in. It does not change; patches of its contours are put together when asked for.

    Attributes
    ----------
    points : ndarray, shape (n, 4)
        Contour points, merged, and unit normals, which point into free space: m, frame of the map.
    free : FreeSpace or None
        None in a map of landmarks alone.
    grid : SearchGrid
    standing : Standing
    landmarks : Constellation

    Parameters
    ----------
    saved : SavedMap

    Raises
    ------
    MapError
        If the map holds nothing.
    ContourslamError
        If it spreads over more than the search can hold.
    """

    def __init__(self, saved: SavedMap) -> None:
        self.landmarks = landmarks_of(saved)
        frames = saved.keyframes
        self.free: FreeSpace | None = None
        if frames is not None and len(frames):
            self.points = averaged(_in_the_map(frames), MERGED)
        else:
            self.points = averaged(_drawn(self.landmarks), MERGED)
        if not len(self.points):
            raise MapError("the map holds no contours, corners or walls: there is nothing to localise in")
        low, high = self.points[:, :2].min(axis=0), self.points[:, :2].max(axis=0)
        if frames is not None and len(frames):
            low, high = (
                np.minimum(low, frames.poses[:, :2].min(axis=0)),
                np.maximum(high, frames.poses[:, :2].max(axis=0)),
            )
            self.free = see_free(frames.poses, frames.starts, frames.points, low - CELL, high + CELL)
        self.grid = _search_grid(self.points)
        self.standing = _standing(self.grid, self.free, low - MARGIN, high + MARGIN)
        self._patches: OrderedDict[tuple[int, int], CellMap] = OrderedDict()
        self._low, self._high = low, high

    def around(self, pose: Floats) -> CellMap:
        """Contours around a pose (m, m, rad), as far as a lidar sees."""
        if len(self.points) <= ALL_AT_ONCE:
            key, centre = (0, 0), 0.5 * (self._low + self._high)
            half = 0.5 * float((self._high - self._low).max()) + 1.0
        else:
            key = math.floor(float(pose[0]) / PATCH), math.floor(float(pose[1]) / PATCH)
            centre, half = (np.array(key) + 0.5) * PATCH, 0.5 * PATCH + REACH
        if key in self._patches:
            self._patches.move_to_end(key)
            return self._patches[key]
        cells = CellMap(centre, half)
        away = np.abs(self.points[:, :2] - centre).max(axis=1)
        inside = np.flatnonzero(away < half)
        # The nearest first: should there be more than the tables hold, the farthest are left out.
        cells.insert(self.points[inside[np.argsort(away[inside], kind="stable")]], np.zeros(3))
        self._patches[key] = cells
        if len(self._patches) > KEPT:
            self._patches.popitem(last=False)
        return cells


def landmarks_of(saved: SavedMap) -> Constellation:
    """All corners and walls of a map."""
    corners, walls = saved.corners, saved.walls
    return Constellation(
        corners.positions, corners.directions, corners.openings, corners.convex, walls.normals, walls.end_points
    )


def _in_the_map(frames: Contoured) -> Floats:
    contours = [move(frames.contour(k).astype(np.float64), pose) for k, pose in enumerate(frames.poses)]
    points = np.concatenate(contours)
    return points[np.isfinite(points).all(axis=1)]


def _drawn(landmarks: Constellation) -> Floats:
    """Contour points of walls, and of the sides of corners."""
    rows = [np.empty((0, 4))]
    for (first, last), normal in zip(landmarks.end_points, landmarks.normals, strict=True):
        rows.append(along(first, last, normal + math.pi))
    for corner, direction, opening, convex in zip(
        landmarks.corners, landmarks.directions, landmarks.openings, landmarks.convex, strict=True
    ):
        for side in (-0.5, 0.5):
            angle = direction + side * opening
            end = corner + SIDE * np.array([math.cos(angle), math.sin(angle)])
            inward = angle - math.copysign(0.5 * math.pi, side)  # into the angle that the sides enclose
            rows.append(along(corner, end, inward + math.pi if convex else inward))
    return np.concatenate(rows)


def along(first: Floats, last: Floats, normal: float) -> Floats:
    """Contour points from `first` to `last` whose normal, into free space, points to `normal` (rad): x, y, nx, ny."""
    count = max(math.ceil(math.hypot(*(last - first)) / MERGED), 1)
    parts = (np.arange(count) + 0.5) / count
    points = first + parts[:, None] * (last - first)
    return np.column_stack([points, np.tile([math.cos(normal), math.sin(normal)], (count, 1))])


def _search_grid(points: Floats) -> SearchGrid:
    for cell in SEARCH_CELLS[:-1]:
        try:
            return build_search_grid(points[:, :2], points[:, 2:], cell=cell, sigma=cell)
        except ContourslamError:
            continue
    return build_search_grid(points[:, :2], points[:, 2:], cell=SEARCH_CELLS[-1], sigma=SEARCH_CELLS[-1])


def _standing(grid: SearchGrid, free: FreeSpace | None, low: Floats, high: Floats) -> Standing:
    """Positions in the middles of the search grid's cells at which a robot can be: in or beside free ones."""
    if free is not None:
        rows, columns = np.nonzero(free.free)
        spots = np.column_stack([columns, rows]) * CELL + (free.x0 + 0.5 * CELL, free.y0 + 0.5 * CELL)
        if len(spots):
            low, high = spots.min(axis=0) - CELL, spots.max(axis=0) + CELL
    first = np.floor((low - grid.origin) / grid.cell)
    size = np.floor((high - grid.origin) / grid.cell) - first + 1
    positions = np.ones((int(size[1]), int(size[0])), np.bool_)
    if free is not None:
        positions[:] = False
        for dx in (-CELL, 0.0, CELL):
            for dy in (-CELL, 0.0, CELL):
                at = (np.floor((spots + np.array([dx, dy]) - grid.origin) / grid.cell) - first).astype(np.int64)
                at = np.clip(at, 0, size.astype(np.int64) - 1)
                positions[at[:, 1], at[:, 0]] = True
    return standing_on(positions, first + 0.5)
