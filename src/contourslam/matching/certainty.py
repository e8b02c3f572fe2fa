"""How well an alignment fixes a pose: measured on the contours themselves, not reckoned from the noise of a lidar.

What a sum of squares promises is too good three times over. Noisy points find other partners when the scan is moved, so
its pull grows less than their number says, and not at all along a bare corridor, whatever direction noise gives to the
surfaces there. Neighbouring points err alike. And a relative pose has two ends.

The covariance is that of an M-estimator, A^-1 M A^-1 (Huber, "Robust Statistics", 1981, section 6.3): A says how the
pull grows when the scan is pushed, partners found anew; M how much the pull of the parts of a scan scatters, by blocks
of neighbouring points (Liang and Zeger, "Longitudinal data analysis", Biometrika 1986).
"""

import math

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel
from contourslam.matching.cell_map import CellMap, Tiles, nearest
from contourslam.matching.small import invert, turned

WIDTH = 0.05  # of the robust kernel, m: the last one of the alignment
PUSH, PUSH_ANGLE = 0.01, 0.003  # m, rad: about what an alignment errs by
BLOCKS = 6  # parts of a scan that err independently
LEAST = 0.002**2  # m^2: no surface is truer to its line than this
# What a match leaves open where the contours say nothing (m, m, rad), so that its covariance is finite, ...
OPEN = np.diag([1.0 / 10.0**2, 1.0 / 10.0**2, 1.0 / 1.0**2])
# ... and what it never knows better.
FLOOR = np.diag([0.001**2, 0.001**2, math.radians(0.02) ** 2])


@kernel
def pull(
    index: Tiles, tiles: Tiles, rows: Floats, x0: float, y0: float, oriented: Floats, pose: Floats, blocks: int,
    sightings: float,
) -> tuple[Floats, Floats, float, float]:  # fmt: skip
    """Pull of a map on a scan, by blocks of neighbouring points.

    Returns
    -------
    pulls : ndarray, shape (blocks, 3)
        Half the gradient of the robust sum of squares: of a point, its weight times its distance times `lines`.
    stiffness : ndarray, shape (blocks, 3, 3)
        Sums of weights times the squares of `lines`: how the pulls grow if the partners stay the same.
    weights, squares : float
        Sums of the weights, and of the squares of weights times distances.
    """
    pulls, stiffness = np.zeros((blocks, 3)), np.zeros((blocks, 3, 3))
    weights = squares = 0.0
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    line = np.empty(3)
    n = oriented.shape[0]
    for k in range(n):
        rx = cos * oriented[k, 0] - sin * oriented[k, 1]
        ry = sin * oriented[k, 0] + cos * oriented[k, 1]
        x, y = pose[0] + rx, pose[1] + ry
        near = nearest(index, tiles, x - x0, y - y0)
        if near < 0:
            continue
        row = rows[near]
        if row[4] < sightings:
            continue
        nx, ny = cos * oriented[k, 2] - sin * oriented[k, 3], sin * oriented[k, 2] + cos * oriented[k, 3]
        if nx * row[2] + ny * row[3] < 0.7:
            continue
        d = row[2] * (x - row[0]) + row[3] * (y - row[1])
        w = 1.0 / (1.0 + (d / WIDTH) ** 2) ** 2
        line[0], line[1], line[2] = row[2], row[3], row[3] * rx - row[2] * ry
        b = k * blocks // n
        for i in range(3):
            pulls[b, i] += w * d * line[i]
            for j in range(3):
                stiffness[b, i, j] += w * line[i] * line[j]
        weights += w
        squares += (w * d) ** 2
    return pulls, stiffness, weights, squares


@kernel
def _measure(
    index: Tiles, tiles: Tiles, rows: Floats, x0: float, y0: float, oriented: Floats, pose: Floats, sightings: float
) -> tuple[Floats, Floats, float]:
    """A and the pattern of M, in the map's axes, and the variance that M has with it, m^2."""
    pulls, parts, weights, squares = pull(index, tiles, rows, x0, y0, oriented, pose, BLOCKS, sightings)
    pattern = parts.sum(axis=0)
    for i in range(3):
        pattern[i, i] += 1e-6
    inverse = invert(pattern)
    # Turns count as much as shifts; the fit has taken up a part of the scatter, which is H_b H^-1 H_b of a block.
    lever = 0.5 * (pattern[0, 0] + pattern[1, 1]) / pattern[2, 2]
    scatter, free = 0.0, 0.0
    for i in range(3):
        scale = lever if i == 2 else 1.0
        for b in range(BLOCKS):
            scatter += scale * pulls[b, i] ** 2
            free += scale * parts[b, i, i]
            for j in range(3):
                for m in range(3):
                    free -= scale * parts[b, i, j] * inverse[j, m] * parts[b, m, i]
    alone = squares / max(weights, 1e-9)
    variance = max(scatter / max(free, 1e-9), alone, LEAST) if free > 0.05 * weights else max(alone, LEAST)
    growth = np.empty((3, 3))
    for i in range(3):
        size = PUSH_ANGLE if i == 2 else PUSH
        pushed = pose.copy()
        pushed[i] = pose[i] + size
        ahead = pull(index, tiles, rows, x0, y0, oriented, pushed, 1, sightings)[0]
        pushed[i] = pose[i] - size
        behind = pull(index, tiles, rows, x0, y0, oriented, pushed, 1, sightings)[0]
        for j in range(3):
            growth[i, j] = (ahead[0, j] - behind[0, j]) / (2.0 * size)
    for i in range(3):
        for j in range(i):
            growth[i, j] = growth[j, i] = 0.5 * (growth[i, j] + growth[j, i])
    return growth, pattern, variance


def contour_information(
    oriented: Floats, cells: CellMap, pose: Floats, least: float = 0.0, sightings: float = 0.0
) -> tuple[Floats, float]:
    """Information that the contours have about the pose of a scan that was aligned to them.

    Parameters
    ----------
    oriented : ndarray, shape (n, 4)
        Points and normals of the scan.
    cells : CellMap
    pose : ndarray, shape (3,)
        Where they were aligned to.
    least : float
        Variance of a point below which it is not taken, m^2.

    Returns
    -------
    information : ndarray, shape (3, 3)
        In the scan's frame; nearly singular where the contours leave a direction open.
    variance : float
        Of a point, larger where neighbours err alike, m^2.
    """
    growth, pattern, variance = _measure(
        cells.index, cells.tiles, cells.rows, cells.x0, cells.y0, oriented, np.asarray(pose, np.float64), sightings
    )
    variance = max(variance, least)
    return turned(growth @ invert(pattern * variance) @ growth, -pose[2]), variance


def match_covariance(
    oriented: Floats, cells: CellMap, pose: Floats, first: Floats, anchor: Floats, blur: float = 0.0
) -> Floats:
    """Covariance of a scan's pose as seen from the scan that its local map began with.

    Both scans have errors of their own: what one sees of a cross wall does not help if the other saw none. An error of
    the first one's heading swings the second one about.

    Parameters
    ----------
    oriented, first : ndarray, shape (n, 4) and (m, 4)
        Points and normals of the scan, and of the one that the map began with, each in its frame.
    cells : CellMap
    pose, anchor : ndarray, shape (3,)
        The two scans in the map.
    blur : float
        Variance of a scan's heading from turns during the scan that are not known, rad^2; taken for both.

    Returns
    -------
    ndarray, shape (3, 3)
        In the frame of the scan.
    """
    limits = FLOOR + np.diag([0.0, 0.0, blur])
    information, variance = contour_information(oriented, cells, pose)
    own = invert(information + OPEN) + limits
    # The first scan lies in the map, and its points near themselves: what they scatter says too little.
    information, _ = contour_information(first, cells, anchor, variance, 2.0)
    others = turned(invert(information + OPEN) + limits, anchor[2] - pose[2])
    # The first scan's error moves the second one as if both sat on the same stiff frame.
    x, y = pose[0] - anchor[0], pose[1] - anchor[1]
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    swing = np.array([[1.0, 0.0, sin * x - cos * y], [0.0, 1.0, cos * x + sin * y], [0.0, 0.0, 1.0]])
    covariance: Floats = own + swing @ others @ swing.T
    return covariance


def exposure(offsets: Floats, elapsed: float) -> float:
    """Variance of a random walk averaged over a scan's beams, as a part of what it is after the time between scans.

    A walk of variance q t, averaged over a span s that begins after a time a, has variance q (a + s / 3).

    Parameters
    ----------
    offsets : ndarray, shape (n,)
        Times of the beams after the scan's stamp, s.
    elapsed : float
        Since the last scan, s.
    """
    if offsets.size == 0 or not 0.0 < elapsed < math.inf:
        return 0.0
    ends = abs(float(offsets[0])), abs(float(offsets[-1]))
    return min((min(ends) + (max(ends) - min(ends)) / 3.0) / elapsed, 1.0)
