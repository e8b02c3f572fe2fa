"""How well an alignment fixes a pose: measured on the contours themselves, not reckoned from the noise of a lidar.

What a sum of squares promises is too good three times over. Noisy points find other partners when the scan is moved, so
its pull grows less than their number says, and not at all along a bare corridor, whatever direction noise gives to the
surfaces there. Neighbouring points err alike. And a relative pose has two ends.

The covariance is that of an M-estimator, A^-1 M A^-1 (Huber, "Robust Statistics", 1981, section 6.3): A says how the
pull grows when the scan is pushed, partners found anew; M how much the pulls of the parts of a scan scatter, by blocks
of neighbouring points (Liang and Zeger, "Longitudinal data analysis", Biometrika 1986).
"""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel
from contourslam.matching.cell_map import CellMap, Tiles, nearest
from contourslam.matching.small import invert, turned

WIDTH = 0.05  # of the robust kernel, m: the last one of the alignment
PUSH, PUSH_ANGLE = 0.01, 0.003  # m, rad: about what an alignment errs by
SURE = 4.0  # information that could be chance, at this many times its variance, is none
BLOCKS = 6  # parts of a scan that err independently
LEAST = 0.002**2  # m^2: no surface is truer to its line than this
# What a match leaves open where the contours say nothing (m, m, rad), so that its covariance is finite, ...
OPEN = np.diag([1.0 / 10.0**2, 1.0 / 10.0**2, 1.0 / 1.0**2])
# ... and what it never knows better.
FLOOR = np.diag([0.001**2, 0.001**2, math.radians(0.02) ** 2])


@kernel
def pull(
    index: Tiles, tiles: Tiles, rows: Floats, x0: float, y0: float, oriented: Floats, pose: Floats, sightings: float,
    pulls: Floats, parts: Floats,
) -> float:  # fmt: skip
    """Pull of a map on a scan, half the gradient of the robust sum of squares, by blocks of neighbouring points.

    Parameters
    ----------
    sightings : float
        Points of the map that were seen less often do not count.
    pulls : ndarray, shape (blocks, 3)
        Is filled: sums of weight times distance times the direction in which the pose changes the distance.
    parts : ndarray, shape (blocks, 3, 3) or (0, 3, 3)
        Is filled where there is room: sums of weight times the square of that direction.

    Returns
    -------
    float
        Mean square of the distances, m^2.
    """
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    pulls[:], parts[:] = 0.0, 0.0
    weights = squares = 0.0
    n, blocks = oriented.shape[0], pulls.shape[0]
    for k in range(n):
        rx = cos * oriented[k, 0] - sin * oriented[k, 1]
        ry = sin * oriented[k, 0] + cos * oriented[k, 1]
        x, y = pose[0] + rx, pose[1] + ry
        near = nearest(index, tiles, x - x0, y - y0)
        if near < 0:
            continue
        row = rows[near]
        a, b = row[2], row[3]
        nx, ny = cos * oriented[k, 2] - sin * oriented[k, 3], sin * oriented[k, 2] + cos * oriented[k, 3]
        if row[4] < sightings or nx * a + ny * b < 0.7:
            continue
        d = a * (x - row[0]) + b * (y - row[1])
        v = 1.0 / (1.0 + (d / WIDTH) ** 2)
        w, lever = v * v, b * rx - a * ry
        out = pulls[k * blocks // n]
        out[0] += w * d * a
        out[1] += w * d * b
        out[2] += w * d * lever
        if parts.shape[0]:
            h = parts[k * blocks // n]
            h[0, 0] += w * a * a
            h[0, 1] += w * a * b
            h[1, 1] += w * b * b
            h[0, 2] += w * a * lever
            h[1, 2] += w * b * lever
            h[2, 2] += w * lever * lever
            weights += w
            squares += w * w * d * d
    for i in range(parts.shape[0]):
        h = parts[i]
        h[1, 0], h[2, 0], h[2, 1] = h[0, 1], h[0, 2], h[1, 2]
    return squares / max(weights, 1e-9)


@kernel
def _scatter(pulls: Floats, parts: Floats, whole: Floats) -> float:
    """Variance of a point by which the blocks' pulls scatter as they do, m^2; 0 where the fit leaves nothing to see."""
    inverse = invert(whole)
    lever = 0.5 * (whole[0, 0] + whole[1, 1]) / whole[2, 2]  # so that turns count as much as shifts
    scatter, free = 0.0, 0.0
    for b in range(pulls.shape[0]):
        # The fit has taken up a part of what the block would scatter: H_b H^-1 H_b.
        for i in range(3):
            scale = lever if i == 2 else 1.0
            taken = 0.0
            for j in range(3):
                for k in range(3):
                    taken += parts[b, i, j] * inverse[j, k] * parts[b, k, i]
            scatter += scale * pulls[b, i] ** 2
            free += scale * (parts[b, i, i] - taken)
    return scatter / free if free > 0.05 * (whole[0, 0] + whole[1, 1]) else 0.0


@kernel
def _sandwich(a: Floats, m: Floats) -> Floats:
    """A M A for the symmetric part of A; spelled out, for Numba's own product of matrices needs SciPy."""
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                for n in range(3):
                    out[i, j] += 0.25 * (a[i, k] + a[k, i]) * m[k, n] * (a[n, j] + a[j, n])
    return out


@kernel
def _temper(information: Floats, chance: Floats) -> None:
    """Take from the information about the position what may be chance, direction by direction; in place.

    A push ahead and one back differ by chance alone where a wall is straight, for then each finds other partners.
    """
    angle = 0.5 * math.atan2(2.0 * information[0, 1], information[0, 0] - information[1, 1])
    c, s = math.cos(angle), math.sin(angle)
    for x, y in ((c, s), (-s, c)):
        known = x * x * information[0, 0] + 2.0 * x * y * information[0, 1] + y * y * information[1, 1]
        doubtful = SURE * (x * x * chance[0, 0] + 2.0 * x * y * chance[0, 1] + y * y * chance[1, 1])
        less = 1.0 - math.sqrt(max(1.0 - doubtful / max(known, 1e-12), 0.0))
        for i in range(3):  # S I S with S = 1 - less u u^T
            along = x * information[0, i] + y * information[1, i]
            information[0, i] -= less * x * along
            information[1, i] -= less * y * along
        for i in range(3):
            along = x * information[i, 0] + y * information[i, 1]
            information[i, 0] -= less * x * along
            information[i, 1] -= less * y * along


@kernel
def _hold(
    index: Tiles, tiles: Tiles, rows: Floats, x0: float, y0: float, oriented: Floats, pose: Floats, sightings: float
) -> tuple[Floats, float]:  # fmt: skip
    """Information of a scan's pose in the map, in the scan's frame, and the variance of a point."""
    pulls, parts = np.empty((BLOCKS, 3)), np.empty((BLOCKS, 3, 3))
    alone = pull(index, tiles, rows, x0, y0, oriented, pose, sightings, pulls, parts)
    whole = np.zeros((3, 3))
    for i in range(3):
        whole[i, i] = 1e-6
    for b in range(BLOCKS):
        whole += parts[b]
    variance = max(_scatter(pulls, parts, whole), alone, LEAST)
    growth, chance = np.empty((3, 3)), np.empty((3, 3))
    here, ahead, behind, none = np.zeros(3), np.empty((1, 3)), np.empty((1, 3)), np.empty((0, 3, 3))
    for b in range(BLOCKS):
        here += pulls[b]
    for i in range(3):
        size = PUSH_ANGLE if i == 2 else PUSH
        pushed = pose.copy()
        pushed[i] = pose[i] + size
        pull(index, tiles, rows, x0, y0, oriented, pushed, sightings, ahead, none)
        pushed[i] = pose[i] - size
        pull(index, tiles, rows, x0, y0, oriented, pushed, sightings, behind, none)
        for j in range(3):
            growth[i, j] = (ahead[0, j] - behind[0, j]) / (2.0 * size)
            chance[i, j] = (ahead[0, j] + behind[0, j] - 2.0 * here[j]) / (2.0 * size)
    inverse = invert(whole)
    out = _sandwich(growth, inverse)
    _temper(out, _sandwich(chance, inverse))
    return turned(out / variance, -pose[2]), variance


@kernel
def _as_seen(own: Floats, pose: Floats, others: Floats, anchor: Floats) -> Floats:
    """Covariance of one scan as seen from another, in its own frame, from what each has in its frame."""
    x, y = pose[0] - anchor[0], pose[1] - anchor[1]
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    # The other one's error moves this one as if both sat on the same stiff frame.
    gx, gy = sin * x - cos * y, cos * x + sin * y
    p = turned(others, anchor[2] - pose[2])
    out = own + p
    out[0, 0] += 2.0 * gx * p[0, 2] + gx * gx * p[2, 2]
    out[0, 1] += gx * p[1, 2] + gy * p[0, 2] + gx * gy * p[2, 2]
    out[1, 1] += 2.0 * gy * p[1, 2] + gy * gy * p[2, 2]
    out[0, 2] += gx * p[2, 2]
    out[1, 2] += gy * p[2, 2]
    out[1, 0], out[2, 0], out[2, 1] = out[0, 1], out[0, 2], out[1, 2]
    return out


@dataclass(frozen=True, slots=True)
class Hold:
    """What a map knows of the pose of a scan in it.

    Attributes
    ----------
    information : ndarray, shape (3, 3)
        In the scan's frame; nearly singular where the contours leave a direction open.
    variance : float
        Of a point, larger where neighbours err alike, m^2; the information is inversely proportional to it.
    """

    information: Floats
    variance: float

    def covariance(self, variance: float, blur: float) -> Floats:
        """Covariance of the pose, in the scan's frame.

        Parameters
        ----------
        variance : float
            Of a point, if that is more than its own, m^2.
        blur : float
            Variance of the heading from turns during the scan that are not known, rad^2.
        """
        out = invert(self.information * min(self.variance / variance, 1.0) + OPEN) + FLOOR
        out[2, 2] += blur
        return out


def hold(oriented: Floats, cells: CellMap, pose: Floats, *, inside: bool = False) -> Hold:
    """Measure how well a map holds a scan that was aligned to it.

    Parameters
    ----------
    oriented : ndarray, shape (n, 4)
        Points and normals of the scan.
    cells : CellMap
    pose : ndarray, shape (3,)
        Where they were aligned to.
    inside : bool
        The scan is a part of the map: points of the map that no other scan saw do not count.
    """
    sightings = 2.0 if inside else 0.0
    points = np.asarray(oriented, np.float64)
    return Hold(*_hold(cells.index, cells.tiles, cells.rows, cells.x0, cells.y0, points, pose, sightings))


def match_covariance(own: Hold, pose: Floats, first: Hold, anchor: Floats, blur: float = 0.0) -> Floats:
    """Covariance of a scan's pose as seen from the scan that its local map began with.

    Both scans have errors of their own: what one sees of a cross wall does not help if the other saw none. An error of
    the first one's heading swings the second one about.

    Parameters
    ----------
    own, first : Hold
        Of the scan, and of the one that the map began with. The points of that one lie in the map near themselves, and
        are taken to scatter no less than the other's.
    pose, anchor : ndarray, shape (3,)
        The two scans in the map.
    blur : float
        Variance of a scan's heading from turns during the scan that are not known, rad^2; taken for both.

    Returns
    -------
    ndarray, shape (3, 3)
        In the frame of the scan.
    """
    return _as_seen(own.covariance(own.variance, blur), pose, first.covariance(own.variance, blur), anchor)


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
