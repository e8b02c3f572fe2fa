"""Where a map was seen to be empty: the rays from where the robot stood to what it saw there."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel

CELL = 0.1  # m
SHORT = 0.15  # a ray says nothing of the last stretch before what it met, m: cells are coarse and surfaces slant
BODY = 0.2  # m around where the robot stood is free

Cells = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """Cells that were seen to be empty.

    Attributes
    ----------
    free : ndarray of bool, shape (rows, columns)
        Rows along y.
    x0, y0 : float
        Lower corner of the first cell, m.
    """

    free: Cells
    x0: float
    y0: float


@kernel
def _see(free: Cells, x0: float, y0: float, pose: Floats, points: NDArray[np.float32]) -> None:
    """Mark the cells along the rays from a pose to points seen from it, and those under the robot."""
    rows, columns = free.shape
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    x, y = (pose[0] - x0) / CELL, (pose[1] - y0) / CELL
    body = BODY / CELL
    for j in range(max(math.floor(y - body), 0), min(math.floor(y + body), rows - 1) + 1):
        for i in range(max(math.floor(x - body), 0), min(math.floor(x + body), columns - 1) + 1):
            if (i + 0.5 - x) ** 2 + (j + 0.5 - y) ** 2 < body * body:
                free[j, i] = True
    for k in range(points.shape[0]):
        dx = (cos * points[k, 0] - sin * points[k, 1]) / CELL
        dy = (sin * points[k, 0] + cos * points[k, 1]) / CELL
        length = math.hypot(dx, dy)
        steps = math.ceil(1.5 * (length - SHORT / CELL))
        for s in range(steps):
            part = s / (1.5 * length)
            i, j = math.floor(x + part * dx), math.floor(y + part * dy)
            if 0 <= i < columns and 0 <= j < rows:
                free[j, i] = True


def see_free(
    poses: Floats, starts: NDArray[np.int64], points: NDArray[np.float32], low: Floats, high: Floats
) -> FreeSpace:
    """Mark what keyframes saw to be empty.

    Parameters
    ----------
    poses : ndarray, shape (k, 3)
        m, m, rad.
    starts : ndarray of int, shape (k + 1,)
        Rows of `points` that belong to each pose.
    points : ndarray of float32, shape (n, >= 2)
        What was seen, in the frame of its pose, m.
    low, high : ndarray, shape (2,)
        Corners of what the cells shall cover, m.
    """
    columns, rows = (int(n) for n in np.maximum(np.ceil((high - low) / CELL), 1.0))
    out = FreeSpace(np.zeros((rows, columns), np.bool_), float(low[0]), float(low[1]))
    for k, pose in enumerate(poses):
        _see(out.free, out.x0, out.y0, pose, points[starts[k] : starts[k + 1]])
    return out
