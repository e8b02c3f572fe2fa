"""What speaks for and against a pose in a known map: surfaces found where they should be, and walls looked through."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel
from contourslam.localization.free_space import CELL, Cells, FreeSpace
from contourslam.localization.view import View
from contourslam.matching.cell_map import CellMap, Tiles, nearest

SIGMA = 0.05  # m; how far a surface may lie off the map's: noise, and the map's own errors
LOOK_ALIKE = 0.7  # cosine between the directions of two surfaces that may be one
STRIDE = 0.15  # m; a ray goes on by so much where no surface is near
NEAR_WALL = 0.06  # m; a ray that comes this close to a point of a wall has reached it ...
FACING = 0.35  # ... where the wall faces it: cosine of the angle between ray and normal
BEFORE = 0.35  # m; a wall this close before what the ray met is taken for that


@dataclass(frozen=True, slots=True)
class Evidence:
    """How a view agrees with the map at a pose, each a weight of the view's points.

    Attributes
    ----------
    total : float
        Of all points.
    found : float
        Points that touch a surface of the map, the less the farther they are off it.
    new : float
        Points amid what the map knows to be empty: things that have come.
    through : float
        Points seen through surfaces of the map: things that have gone, or it is not here.
    """

    total: float
    found: float
    new: float
    through: float


@kernel
def _weigh(
    index: Tiles, tiles: Tiles, rows: Floats, x0: float, y0: float, free: Cells, fx: float, fy: float, points: Floats,
    origins: Floats, weights: Floats, pose: Floats, out: Floats,
) -> None:  # fmt: skip
    """Fill `out` with the weights of all points, of those found, new, and seen through walls."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    out[:] = 0.0
    for k in range(points.shape[0]):
        w = weights[k]
        out[0] += w
        x = pose[0] + cos * points[k, 0] - sin * points[k, 1]
        y = pose[1] + sin * points[k, 0] + cos * points[k, 1]
        near = nearest(index, tiles, x - x0, y - y0)
        likelihood = 0.0
        if near >= 0:
            row = rows[near]
            nx, ny = cos * points[k, 2] - sin * points[k, 3], sin * points[k, 2] + cos * points[k, 3]
            if nx * row[2] + ny * row[3] > LOOK_ALIKE:
                d = row[2] * (x - row[0]) + row[3] * (y - row[1])
                along = max(math.hypot(x - row[0], y - row[1]) - abs(d) - 0.1, 0.0)
                likelihood = math.exp(-0.5 * (d * d + along * along) / (SIGMA * SIGMA))
                out[1] += w * likelihood
        if near < 0 and free.size:
            i, j = math.floor((x - fx) / CELL), math.floor((y - fy) / CELL)
            if 0 <= i < free.shape[1] and 0 <= j < free.shape[0] and free[j, i]:
                out[2] += w
        ox = pose[0] + cos * origins[k, 0] - sin * origins[k, 1]
        oy = pose[1] + sin * origins[k, 0] + cos * origins[k, 1]
        length = math.hypot(x - ox, y - oy)
        if length < BEFORE:
            continue
        dx, dy = (x - ox) / length, (y - oy) / length
        s = 0.1
        while s < length - BEFORE:
            px, py = ox + s * dx, oy + s * dy
            near = nearest(index, tiles, px - x0, py - y0)
            if near < 0:
                s += STRIDE
                continue
            row = rows[near]
            away = math.hypot(px - row[0], py - row[1])
            if away < NEAR_WALL and row[2] * dx + row[3] * dy < -FACING:
                out[3] += w
                break
            s += max(away - 0.5 * NEAR_WALL, 0.05)


NOWHERE: Cells = np.empty((0, 0), np.bool_)


def weigh(view: View, cells: CellMap, free: FreeSpace | None, pose: Floats) -> Evidence:
    """Hold a view against the map at a pose.

    Parameters
    ----------
    view : View
    cells : CellMap
        Contours around the pose.
    free : FreeSpace or None
    pose : ndarray, shape (3,)
        Base in the map: m, m, rad.
    """
    out = np.empty(4)
    empty, fx, fy = (NOWHERE, 0.0, 0.0) if free is None else (free.free, free.x0, free.y0)
    _weigh(
        cells.index, cells.tiles, cells.rows, cells.x0, cells.y0, empty, fx, fy, view.points, view.origins,
        view.weights, np.asarray(pose, np.float64), out,
    )  # fmt: skip
    return Evidence(*(float(v) for v in out))
