"""Corners: the two sides of a candidate, each a fitted line, intersected; with covariance."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.config import LandmarkConfig
from contourslam.contour.contours import Contours, Floats, Ints
from contourslam.kernels import kernel
from contourslam.landmarks.line_fit import fit_line, grow_line
from contourslam.landmarks.roundness import is_round


@dataclass(frozen=True, slots=True)
class Corners:
    """Corners seen in one scan, one row each, in the lidar's frame at the scan's stamp.

    Attributes
    ----------
    positions : ndarray, shape (k, 2)
        m.
    covariances : ndarray, shape (k, 2, 2)
        m².
    directions : ndarray, shape (k,)
        Bisector of the sides, pointing into the angle they enclose, rad.
    openings : ndarray, shape (k,)
        Angle between the sides, in (0, pi), rad.
    convex : ndarray of bool, shape (k,)
        True where matter fills the angle, as at the edge of a box; false for the corner of a room.
    sides : ndarray, shape (k, 2)
        Length of each side as far as it was seen straight, m.
    vertices : ndarray, shape (k, 2)
        Raw contour point from which the refinement began, m.
    """

    positions: Floats
    covariances: Floats
    directions: Floats
    openings: Floats
    convex: NDArray[np.bool_]
    sides: Floats
    vertices: Floats

    def __len__(self) -> int:
        return len(self.directions)


@kernel
def intersect(
    n1x: float, n1y: float, c1x: float, c1y: float, n2x: float, n2y: float, c2x: float, c2y: float
) -> tuple[float, float, float]:
    """Intersection of two lines given by normal and centroid, and the sine of the angle between them."""
    sine = n1x * n2y - n1y * n2x
    if abs(sine) < 1e-9:
        return 0.0, 0.0, 0.0
    r1, r2 = n1x * c1x + n1y * c1y, n2x * c2x + n2y * c2y
    return (n2y * r1 - n1y * r2) / sine, (n1x * r2 - n2x * r1) / sine, sine


@kernel
def _refine(
    points: Floats, starts: Ints, closed: np.ndarray, candidates: Floats, sigma: float, min_side: float,
    max_side: float, min_points: int, min_opening: float, max_opening: float, floor: float, refined: bool,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Rows of x, y, direction, opening, convex, first side, second side, vertex x, vertex y; and covariances."""
    rows = np.empty((candidates.size, 9))
    covariances = np.empty((candidates.size, 2, 2))
    count = 0
    for q in range(candidates.size):
        guess = round(candidates[q])
        c = int(np.searchsorted(starts, guess, side="right")) - 1
        if c >= closed.size:  # the closing vector of a ring ends at the first point of the contour
            c, guess = closed.size - 1, starts[closed.size - 1]
        a, b = starts[c], starts[c + 1]
        n = b - a
        low, high = (guess - n // 2, guess + n // 2) if closed[c] else (a, b - 1)
        vertex = guess
        x = y = n1x = n1y = n2x = n2y = 0.0
        found = False
        var1 = var2 = 0.0
        side1 = side2 = 0.0
        tail1x = tail1y = tail2x = tail2y = 0.0
        for turn in range(3):
            # The point at the vertex may belong to either side, so it is left out of both.
            first, second = vertex - 1, vertex + 1
            end1 = grow_line(points, first, -1, low, a, n, min_side, max_side, sigma)
            end2 = grow_line(points, second, 1, high, a, n, min_side, max_side, sigma)
            found = (
                end1 >= low and end2 >= second and first - end1 + 1 >= min_points and end2 - second + 1 >= min_points
            )
            if not found:
                break
            line1 = fit_line(points, end1, first, a, n, sigma)
            line2 = fit_line(points, second, end2, a, n, sigma)
            n1x, n1y, c1x, c1y, o1, a1, s1 = line1
            n2x, n2y, c2x, c2y, o2, a2, s2 = line2
            x, y, sine = intersect(n1x, n1y, c1x, c1y, n2x, n2y, c2x, c2y)
            found = sine != 0.0
            if not found:
                break
            var1 = o1 + a1 * ((x - c1x) ** 2 + (y - c1y) ** 2)
            var2 = o2 + a2 * ((x - c2x) ** 2 + (y - c2y) ** 2)
            i1, i2 = a + (end1 - a) % n, a + (end2 - a) % n
            tail1x, tail1y, tail2x, tail2y = points[i1, 0], points[i1, 1], points[i2, 0], points[i2, 1]
            side1 = math.hypot(tail1x - x, tail1y - y)
            side2 = math.hypot(tail2x - x, tail2y - y)
            # The candidate may be a point or two off; go on from the point nearest to the intersection.
            nearest, best = vertex, 1e18
            for k in range(max(vertex - 8, low), min(vertex + 8, high) + 1):
                i = a + (k - a) % n
                d = (points[i, 0] - x) ** 2 + (points[i, 1] - y) ** 2
                if d < best:
                    nearest, best = k, d
            if turn == 2 or nearest == vertex:
                # A true corner lies on its contour: at most a beam's step from the nearest point.
                i, j = a + (nearest - 1 - a) % n, a + (nearest + 1 - a) % n
                step = 0.5 * math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
                # Only now are the sides free of points from round the corner, so that they must be straight.
                found = (
                    s1 < 3.0
                    and s2 < 3.0
                    and math.sqrt(best) <= step + 4.0 * sigma
                    and not is_round(points, end1, vertex, end2, a, n, line1, line2)
                )
                break
            vertex = nearest
        if not found or side1 < min_side or side2 < min_side:
            continue
        u1x, u1y, u2x, u2y = (tail1x - x) / side1, (tail1y - y) / side1, (tail2x - x) / side2, (tail2y - y) / side2
        # Sides along the fitted lines: their ends carry the noise of one point.
        t1, t2 = u1y * n1x - u1x * n1y, u2y * n2x - u2x * n2y
        f1, f2 = (1.0 if t1 > 0.0 else -1.0), (1.0 if t2 > 0.0 else -1.0)
        u1x, u1y, u2x, u2y = -n1y * f1, n1x * f1, -n2y * f2, n2x * f2
        opening = math.acos(min(max(u1x * u2x + u1y * u2y, -1.0), 1.0))
        if opening < min_opening or opening > max_opening:
            continue
        convex = u1x * u2y - u1y * u2x > 0.0
        raw = a + (guess - a) % n
        if refined:
            # n_i . p = rho_i, A = [n1; n2], Cov = A^-1 diag(q1, q2) A^-T.
            sine2 = (n1x * n2y - n1y * n2x) ** 2
            covariances[count, 0, 0] = (n2y * n2y * var1 + n1y * n1y * var2) / sine2 + floor * floor
            covariances[count, 1, 1] = (n2x * n2x * var1 + n1x * n1x * var2) / sine2 + floor * floor
            covariances[count, 0, 1] = -(n2x * n2y * var1 + n1x * n1y * var2) / sine2
            covariances[count, 1, 0] = covariances[count, 0, 1]
        else:
            # The vertex is one noisy point, somewhere within a step of the true corner.
            x, y = points[raw, 0], points[raw, 1]
            i, j = a + (max(guess - 1, low) - a) % n, a + (min(guess + 1, high) - a) % n
            step = 0.5 * math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1])
            covariances[count] = np.eye(2) * (sigma * sigma + step * step + floor * floor)
        rows[count, 0], rows[count, 1] = x, y
        rows[count, 2] = math.atan2(u1y + u2y, u1x + u2x)
        rows[count, 3], rows[count, 4] = opening, 1.0 if convex else 0.0
        rows[count, 5], rows[count, 6] = side1, side2
        rows[count, 7], rows[count, 8] = points[raw, 0], points[raw, 1]
        twice = False  # two candidates can lead to one corner
        for other in range(count):
            twice = twice or math.hypot(rows[other, 0] - x, rows[other, 1] - y) < 0.5 * min_side
        if not twice:
            count += 1
    return rows[:count], covariances[:count]


def refine_corners(contours: Contours, candidates: Floats, sigma_range: float, config: LandmarkConfig) -> Corners:
    """Refine candidates to corners: fit a line to each side on the raw contour and intersect the two.

    Candidates are dropped whose sides are too short, not straight, nearly in one line, or round as on a column, and
    those whose lines meet away from the contour. The covariance follows from the two fits: ``A p = rho`` with the
    normals in ``A`` gives ``A^-1 diag(q) A^-T``, where q_i is the variance of line i at the corner.

    Parameters
    ----------
    contours : Contours
        Raw contours.
    candidates : ndarray, shape (k,)
        Indices among their points; fractions are rounded.
    sigma_range : float
        Standard deviation of a range, m.
    config : LandmarkConfig

    Returns
    -------
    Corners
        At most k.
    """
    rows, covariances = _refine(
        contours.points, contours.starts, contours.closed, candidates, sigma_range, config.min_side, config.max_side,
        config.min_side_points, math.radians(config.min_opening_deg), math.radians(config.max_opening_deg),
        config.position_floor, config.refined,
    )  # fmt: skip
    # Copies: a column of one row is contiguous and one of two is not, and Numba compiles for each anew, in mid-drive.
    places, directions, openings, sides, raw = (
        rows[:, part].copy() for part in (slice(0, 2), 2, 3, slice(5, 7), slice(7, 9))
    )
    return Corners(places, covariances, directions, openings, rows[:, 4] > 0.5, sides, raw)
