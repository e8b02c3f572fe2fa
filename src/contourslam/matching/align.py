"""A scan's contour aligned to a local contour map, point to line, with the wheels' word as the prior."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap_angle
from contourslam.kernels import kernel
from contourslam.matching.cell_map import CellMap, Tiles, nearest
from contourslam.matching.small import solve

POINT_SIGMA = 0.03  # m: noise of a point and of the map it is held against, and what neighbours have in common of it
STEPS = 25
WIDE, NARROW = 0.20, 0.05  # width of the robust kernel at first and at last, m
INLIER = 0.10  # a point this close to its line has found its partner, m


@dataclass(frozen=True, slots=True)
class Alignment:
    """Where a scan lies in a contour map.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Frame of the scan in the map: m, m, rad.
    information : ndarray, shape (3, 3)
        Of the contours alone, without the prior, in the map's axes about the scan's origin; nearly singular where the
        contours leave a direction open.
    pairs : int
        Points that found a partner.
    overlap : float
        Their part of all points.
    residual : float
        Root mean square of their distances, m.
    """

    pose: Floats
    information: Floats
    pairs: int
    overlap: float
    residual: float


@kernel
def _align(
    index: Tiles, tiles: Tiles, rows: Floats, x0: float, y0: float, oriented: Floats, guess: Floats, mean: Floats,
    prior: Floats, wide: float, narrow: float, sigma: float,
) -> tuple[Floats, Floats, int, float]:  # fmt: skip
    """Gauss-Newton; returns pose, information of the contours, pairs, and the rms distance of these."""
    pose = guess.copy()
    h, total, g = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)
    pairs, squares = 0, 0.0
    width = wide
    for step in range(STEPS + 1):
        last = step == STEPS
        h[:], g[:] = 0.0, 0.0
        pairs, squares = 0, 0.0
        cos, sin = math.cos(pose[2]), math.sin(pose[2])
        for k in range(oriented.shape[0]):
            rx = cos * oriented[k, 0] - sin * oriented[k, 1]
            ry = sin * oriented[k, 0] + cos * oriented[k, 1]
            x, y = pose[0] + rx, pose[1] + ry
            near = nearest(index, tiles, x - x0, y - y0)
            if near < 0:
                continue
            row = rows[near]
            nx, ny = cos * oriented[k, 2] - sin * oriented[k, 3], sin * oriented[k, 2] + cos * oriented[k, 3]
            if nx * row[2] + ny * row[3] < 0.7:
                continue
            d = row[2] * (x - row[0]) + row[3] * (y - row[1])
            if abs(d) < INLIER:
                pairs += 1
                squares += d * d
            kernel_weight = 1.0 / (1.0 + (d / width) ** 2)
            w = kernel_weight * kernel_weight / (sigma * sigma)
            lever = row[3] * rx - row[2] * ry
            h[0, 0] += w * row[2] * row[2]
            h[0, 1] += w * row[2] * row[3]
            h[1, 1] += w * row[3] * row[3]
            h[0, 2] += w * row[2] * lever
            h[1, 2] += w * row[3] * lever
            h[2, 2] += w * lever * lever
            g[0] -= w * d * row[2]
            g[1] -= w * d * row[3]
            g[2] -= w * d * lever
        h[1, 0], h[2, 0], h[2, 1] = h[0, 1], h[0, 2], h[1, 2]
        if last:
            break
        off = np.array([mean[0] - pose[0], mean[1] - pose[1], wrap_angle(mean[2] - pose[2])])
        for a in range(3):
            for b in range(3):
                total[a, b] = h[a, b] + prior[a, b]
                g[a] += prior[a, b] * off[b]
        dx, dy, turn = solve(total, g)
        pose[0], pose[1], pose[2] = pose[0] + dx, pose[1] + dy, wrap_angle(pose[2] + turn)
        small = abs(dx) + abs(dy) < 2e-4 and abs(turn) < 2e-4
        if small and width <= narrow:
            break
        if small or step > 2:
            width = max(width * 0.6, narrow)
    return pose, h, pairs, math.sqrt(squares / max(pairs, 1))


def align(
    oriented: Floats,
    cells: CellMap,
    guess: Floats,
    prior: Floats,
    *,
    mean: Floats | None = None,
    wide: float = WIDE,
) -> Alignment:
    """Align a scan to a contour map: Gauss-Newton over point-to-line distances under a narrowing robust kernel.

    Parameters
    ----------
    oriented : ndarray, shape (n, 4)
        Points and normals of the scan, see :func:`contourslam.matching.oriented.oriented_points`.
    cells : CellMap
    guess : ndarray, shape (3,)
        Where to begin: frame of the scan in the map.
    prior : ndarray, shape (3, 3)
        Information of what is known beforehand, in the map's axes about the scan's origin; zeros for nothing.
    mean : ndarray, shape (3,), optional
        What is known beforehand; `guess` by default.
    wide : float
        Width of the robust kernel at first, m.

    Returns
    -------
    Alignment
    """
    start = np.asarray(guess, np.float64)
    pose, h, pairs, residual = _align(
        cells.index, cells.tiles, cells.rows, cells.x0, cells.y0, oriented, start, start if mean is None else mean,
        prior, wide, NARROW, POINT_SIGMA,
    )  # fmt: skip
    return Alignment(pose, h, pairs, pairs / max(len(oriented), 1), residual)
