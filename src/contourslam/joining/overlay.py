"""What speaks for laying one map on another, and against it: surfaces that both have, walls that one saw through."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.poses import inverse, transform
from contourslam.joining.verdict import worth
from contourslam.kernels import kernel
from contourslam.localization.free_space import CELL, FreeSpace, see_free
from contourslam.maps.saved_map import Contoured
from contourslam.matching.cell_map import CellMap, Tiles, nearest
from contourslam.matching.oriented import move
from contourslam.matching.squares import averaged

SQUARE = 0.2  # m; the surfaces of one square that look the same way count once
FARTHEST = 10.0  # m; what a keyframe saw beyond this counts neither for nor against: its heading is known too badly
TOUCHES = 0.1  # m; surfaces this near are one
LOOK_ALIKE = 0.7  # cosine between the directions of two surfaces that may be one
CLEAR = 2  # cells of free space all around, for a surface to be where there is none
ROUND = 12.0  # m around the second map, as far as it is shifted


@dataclass(frozen=True, slots=True)
class Tally:
    """Surfaces, m.

    Attributes
    ----------
    agreeing : float
        Of the second map, found in the first.
    found : float
        Of the first map, found in the second.
    through : float
        Of either map, that the other saw through.
    """

    agreeing: float
    found: float
    through: float

    @property
    def contradicted(self) -> float:
        """Part of the surfaces where the other map has looked that it saw through."""
        return self.through / max(self.agreeing + self.found + self.through, 1e-9)

    @property
    def worth(self) -> float:
        """What speaks for it, m."""
        return worth(0.5 * (self.agreeing + self.found), self.through)


@kernel
def _count(
    index: Tiles, tiles: Tiles, rows: Floats, x0: float, y0: float, clear: NDArray[np.bool_], fx: float, fy: float,
    points: Floats, pose: Floats,
) -> tuple[int, int]:  # fmt: skip
    """Points that touch a surface of the map, and points in the middle of its free space."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    touching = amid = 0
    for k in range(points.shape[0]):
        x = pose[0] + cos * points[k, 0] - sin * points[k, 1]
        y = pose[1] + sin * points[k, 0] + cos * points[k, 1]
        near = nearest(index, tiles, x - x0, y - y0)
        if near >= 0:
            row = rows[near]
            nx, ny = cos * points[k, 2] - sin * points[k, 3], sin * points[k, 2] + cos * points[k, 3]
            d = row[2] * (x - row[0]) + row[3] * (y - row[1])
            touching += nx * row[2] + ny * row[3] > LOOK_ALIKE and abs(d) < TOUCHES
        else:
            i, j = math.floor((x - fx) / CELL), math.floor((y - fy) / CELL)
            amid += 0 <= i < clear.shape[1] and 0 <= j < clear.shape[0] and clear[j, i]
    return touching, amid


@kernel
def _counts(
    index: Tiles, tiles: Tiles, rows: Floats, x0: float, y0: float, clear: NDArray[np.bool_], fx: float, fy: float,
    points: Floats, poses: Floats, out: Floats,
) -> None:  # fmt: skip
    """Fill `out` with both numbers at each of the poses."""
    for p in range(poses.shape[0]):
        out[p, 0], out[p, 1] = _count(index, tiles, rows, x0, y0, clear, fx, fy, points, poses[p])


@dataclass(frozen=True, slots=True)
class Surfaces:
    """Surfaces of a map and where it is empty, ready to be held against another's.

    Attributes
    ----------
    points : ndarray, shape (n, 4)
        One a square of 0.2 m: x, y (m), unit normal.
    cells : CellMap
    clear : FreeSpace
        Cells in the middle of what was seen to be empty.
    """

    points: Floats
    cells: CellMap
    clear: FreeSpace


def surfaces_of(frames: Contoured, keyframes: Ints, poses: Floats) -> Surfaces:
    """Surfaces seen from keyframes at poses, shape (n, 3), where they lie or were laid."""
    contours = [np.asarray(frames.contour(int(key)), np.float64) for key in keyframes]
    contours = [c[np.isfinite(c).all(axis=1) & (np.hypot(c[:, 0], c[:, 1]) < FARTHEST)] for c in contours]
    points = np.concatenate([np.empty((0, 4)), *(move(c, p) for c, p in zip(contours, poses, strict=True))])
    low, high = poses[:, :2].min(axis=0) - FARTHEST - 1.0, poses[:, :2].max(axis=0) + FARTHEST + 1.0
    starts = np.cumsum([0, *map(len, contours)])
    seen = np.concatenate([np.empty((0, 4)), *contours]).astype(np.float32)
    clear = _clear(see_free(poses, starts, seen, low, high))
    points = averaged(points, SQUARE)
    cells = CellMap(0.5 * (low + high), 0.5 * float((high - low).max()), large=True)
    cells.insert(points, np.zeros(3))
    at = np.floor((points[:, :2] - (clear.x0, clear.y0)) / CELL).astype(np.int64)
    # What the map itself saw through has come or gone: it proves nothing where it is, and nothing where it is not.
    return Surfaces(np.ascontiguousarray(points[~clear.free[at[:, 1], at[:, 0]]]), cells, clear)


def _clear(seen: FreeSpace) -> FreeSpace:
    """Cells whose neighbours within `CLEAR` are free too."""
    out = seen.free.copy()
    for axis in (0, 1):
        before = out.copy()
        for step in range(1, CLEAR + 1):
            for sign in (-1, 1):
                out &= np.roll(before, sign * step, axis)
    return FreeSpace(out, seen.x0, seen.y0)


class Overlay:
    """A map laid on another.

    Attributes
    ----------
    first : Surfaces
        Of the whole first map.
    second : Surfaces
        Of the second, in the frame of the first.
    centre : ndarray, shape (2,)
        Middle of the second map's surfaces, m.

    Parameters
    ----------
    first, second : Surfaces
    """

    def __init__(self, first: Surfaces, second: Surfaces) -> None:
        self.first, self.second = first, second
        low, high = second.points[:, :2].min(axis=0) - ROUND, second.points[:, :2].max(axis=0) + ROUND
        near = (first.points[:, :2] > low).all(axis=1) & (first.points[:, :2] < high).all(axis=1)
        self._near = np.ascontiguousarray(first.points[near])
        self.centre = second.points[:, :2].mean(axis=0)

    def tally(self, pose: Floats) -> Tally:
        """Count with the second map's surfaces moved by a pose in the first's frame, which is zero as it was laid."""
        agreeing, amid = _held(self.first, self.second.points, pose)
        found, through = _held(self.second, self._near, inverse(pose))
        return Tally(SQUARE * agreeing, SQUARE * found, SQUARE * (amid + through))

    def worths(self, poses: Floats, most: int) -> Floats:
        """Worth at many poses, shape (n, 3), as about so many points of each map have it, m."""
        touching, amid = _sampled(self.first, self.second.points, poses, most)
        found, through = _sampled(self.second, self._near, inverse(poses), most)
        return worth(0.5 * SQUARE * (touching + found), SQUARE * (amid + through))

    def shifted(self, shifts: Floats) -> Floats:
        """Poses of the second map after shifts of its middle and turns about it, rows of m, m, rad."""
        cos, sin = np.cos(shifts[..., 2]), np.sin(shifts[..., 2])
        x, y = self.centre
        return np.stack(
            [x + shifts[..., 0] - cos * x + sin * y, y + shifts[..., 1] - sin * x - cos * y, shifts[..., 2]], axis=-1
        )

    def shift(self, pose: Floats) -> Floats:
        """Shift that a pose is; the inverse of :meth:`shifted`."""
        return np.array([*(transform(pose, self.centre) - self.centre), pose[2]])


def _held(against: Surfaces, points: Floats, pose: Floats) -> tuple[int, int]:
    cells, clear = against.cells, against.clear
    return _count(
        cells.index, cells.tiles, cells.rows, cells.x0, cells.y0, clear.free, clear.x0, clear.y0, points, pose
    )


def _sampled(against: Surfaces, points: Floats, poses: Floats, most: int) -> tuple[Floats, Floats]:
    """The same at many poses, of some of the points, grown to all."""
    some = np.ascontiguousarray(points[:: max(len(points) // most, 1)])
    cells, clear, out = against.cells, against.clear, np.empty((len(poses), 2))
    _counts(cells.index, cells.tiles, cells.rows, cells.x0, cells.y0, clear.free, clear.x0, clear.y0, some, poses, out)
    out *= len(points) / max(len(some), 1)
    return out[:, 0], out[:, 1]
