"""Which landmark an observation could be at all: looks first, then the innovation's Mahalanobis distance."""

import math

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.kernels import kernel
from contourslam.slam import observation as look
from contourslam.slam.ekf import covariance_block, landmark_columns
from contourslam.slam.measurement import (
    ANCHOR_X,
    ANCHOR_Y,
    CONVEX,
    CORNER,
    DIRECTION,
    END,
    KIND,
    OPENING,
    START,
    innovation,
)

# What two sightings of one landmark may differ by in looks; far wider than noise, far narrower than two unlike corners.
MAX_DIRECTION_DIFFERENCE = math.radians(40.0)
MAX_OPENING_DIFFERENCE = math.radians(35.0)
MAX_WALL_GAP = 0.5  # along a line, two pieces this close (m) may be one wall
# A direction in doubt by more than this (rad) cannot be corrected by a linear filter, whatever it seems to match.
LINEAR = 0.25
REACH = 2.0  # no landmark farther than this (m) from where it is seen is considered at all


@kernel
def angle_between(a: float, b: float) -> float:
    """Absolute difference of two directions, rad."""
    return abs((a - b + math.pi) % (2.0 * math.pi) - math.pi)


@kernel
def looks_alike(seen: Floats, table: Floats, a: float) -> bool:
    """Whether an observation, moved to the world, can be this landmark by kind, direction, shape and extent.

    `a` is the landmark's first number: the direction of a wall's normal.
    """
    if seen[look.KIND] != table[KIND]:
        return False
    if table[KIND] == CORNER:
        same_way = angle_between(seen[look.DIRECTION], table[DIRECTION]) < MAX_DIRECTION_DIFFERENCE
        same_shape = abs(seen[look.OPENING] - table[OPENING]) < MAX_OPENING_DIFFERENCE
        return bool(same_way and same_shape and seen[look.CONVEX] == table[CONVEX])
    tx, ty = -math.sin(a), math.cos(a)
    first = tx * (seen[look.X1] - table[ANCHOR_X]) + ty * (seen[look.Y1] - table[ANCHOR_Y])
    last = tx * (seen[look.X2] - table[ANCHOR_X]) + ty * (seen[look.Y2] - table[ANCHOR_Y])
    # Walls run with free space to their left, so the normal tells the two faces of a partition apart.
    return bool(last > first and first < table[END] + MAX_WALL_GAP and last > table[START] - MAX_WALL_GAP)


@kernel
def offset_from(seen: Floats, table: Floats, a: float, b: float) -> float:
    """Distance in the world between an observation and a landmark: of two points, or across the wall's line, m."""
    if table[KIND] == CORNER:
        return math.hypot(seen[look.X1] - a, seen[look.Y1] - b)
    nx, ny = math.cos(a), math.sin(a)
    x, y = 0.5 * (seen[look.X1] + seen[look.X2]), 0.5 * (seen[look.Y1] + seen[look.Y2])
    return float(abs(nx * (x - table[ANCHOR_X]) + ny * (y - table[ANCHOR_Y]) - b))


@kernel
def innovation_covariance(covariance: Floats, j: int, by_pose: Floats, by_landmark: Floats, noise: Floats) -> Floats:
    """S = H P H^T + Q for one landmark (eq. 25), 2 x 2."""
    h = np.empty((2, 5))
    h[:, :3], h[:, 3:] = by_pose, by_landmark
    p = covariance_block(covariance, landmark_columns(np.array([j])))
    s = noise.copy()
    for a in range(2):
        for b in range(2):
            for k in range(5):
                for m in range(5):
                    s[a, b] += h[a, k] * p[k, m] * h[b, m]
    return s


@kernel
def compatible_pairs(
    values: Floats, noises: Floats, world: Floats, mean: Floats, covariance: Floats, table: Floats, count: int,
    expected: Floats, by_pose: Floats, by_landmark: Floats, gate: float,
) -> tuple[Ints, Ints, Floats, Floats]:  # fmt: skip
    """Every pair of an observation and a landmark that passes the individual gate.

    Returns
    -------
    seen, landmark : ndarray of int, shape (p,)
    distance : ndarray, shape (p,)
        Squared Mahalanobis distance of the innovation, below `gate`.
    innovations : ndarray, shape (p, 2)
    """
    k = values.shape[0]
    seen, landmark = np.empty(k * count, dtype=np.int64), np.empty(k * count, dtype=np.int64)
    distance, innovations = np.empty(k * count), np.empty((k * count, 2))
    found = 0
    for i in range(k):
        for j in range(count):
            a, b = mean[3 + 2 * j], mean[4 + 2 * j]
            if world[i, look.KIND] != table[j, KIND]:
                continue
            direction = table[j, DIRECTION] if table[j, KIND] == CORNER else a
            if angle_between(world[i, look.DIRECTION], direction) > MAX_DIRECTION_DIFFERENCE:
                continue  # most end here, before the dearer tests
            apart = offset_from(world[i], table[j], a, b)
            if apart > REACH or not looks_alike(world[i], table[j], a):
                continue
            n0, n1 = innovation(table[j, KIND], values[i], expected[j])
            s = innovation_covariance(covariance, j, by_pose[j], by_landmark[j], noises[i])
            angular = s[1, 1] if table[j, KIND] == CORNER else s[0, 0]
            if angular > LINEAR * LINEAR:
                continue
            determinant = s[0, 0] * s[1, 1] - s[0, 1] * s[1, 0]
            d2 = (s[1, 1] * n0 * n0 - 2.0 * s[0, 1] * n0 * n1 + s[0, 0] * n1 * n1) / determinant
            if 0.0 <= d2 < gate:
                seen[found], landmark[found], distance[found] = i, j, d2
                innovations[found, 0], innovations[found, 1] = n0, n1
                found += 1
    return seen[:found], landmark[:found], distance[:found], innovations[:found]
