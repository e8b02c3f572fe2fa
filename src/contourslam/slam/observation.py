"""Corners and walls of one scan in the form in which the filter takes them: two numbers with covariance each."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel
from contourslam.landmarks import Corners, Walls
from contourslam.slam.measurement import CORNER, WALL

# Columns of `Observations.looks`.
KIND, DIRECTION, OPENING, CONVEX, X1, Y1, X2, Y2 = range(8)

JITTER, JITTER_ANGLE = 0.003, math.radians(0.1)  # of the pose of a single scan by contour matching: m, rad


@dataclass(frozen=True, slots=True)
class Observations:
    """What one scan saw, corners first, in the lidar's frame.

    Attributes
    ----------
    values : ndarray, shape (k, 2)
        Range (m) and bearing (rad) of a corner; normal direction (rad) and distance (m) of a wall.
    noises : ndarray, shape (k, 2, 2)
        Their covariance.
    looks : ndarray, shape (k, 8)
        Kind; direction (of a wall, that of its normal); opening and convex of a corner; two points: of a corner its
        position and the lengths of its sides, of a wall its ends.
    """

    values: Floats
    noises: Floats
    looks: Floats

    def __len__(self) -> int:
        return len(self.values)


@kernel
def _observe(
    positions: Floats, covariances: Floats, directions: Floats, openings: Floats, convex: NDArray[np.bool_],
    sides: Floats, end_points: Floats, lines: Floats, line_covariances: Floats,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    k, w = positions.shape[0], lines.shape[0]
    share = 2.0 if w > 0 else 1.0
    values, noises, looks = np.empty((k + w, 2)), np.empty((k + w, 2, 2)), np.zeros((k + w, 8))
    for i in range(k):
        x, y = positions[i, 0], positions[i, 1]
        q = x * x + y * y
        r = math.sqrt(q)
        values[i, 0], values[i, 1] = r, math.atan2(y, x)
        a, b, c, d = x / r, y / r, -y / q, x / q
        xx, xy, yy = share * covariances[i, 0, 0], share * covariances[i, 0, 1], share * covariances[i, 1, 1]
        noises[i, 0, 0] = a * a * xx + 2.0 * a * b * xy + b * b * yy
        noises[i, 1, 1] = c * c * xx + 2.0 * c * d * xy + d * d * yy
        noises[i, 0, 1] = noises[i, 1, 0] = a * c * xx + (a * d + b * c) * xy + b * d * yy
        looks[i, KIND], looks[i, DIRECTION], looks[i, OPENING] = CORNER, directions[i], openings[i]
        looks[i, CONVEX] = 1.0 if convex[i] else 0.0
        looks[i, X1], looks[i, Y1], looks[i, X2], looks[i, Y2] = x, y, sides[i, 0], sides[i, 1]
    for i in range(w):
        j = k + i
        values[j], noises[j] = lines[i], share * line_covariances[i]
        looks[j, KIND], looks[j, DIRECTION] = WALL, lines[i, 0]
        looks[j, X1], looks[j, Y1] = end_points[i, 0]
        looks[j, X2], looks[j, Y2] = end_points[i, 1]
    return values, noises, looks


def observe(corners: Corners, walls: Walls) -> Observations:
    """Put the landmarks of a scan into the filter's form.

    Parameters
    ----------
    corners : Corners
    walls : Walls
        None of them where corners alone are landmarks. A corner and the walls that meet in it come from the same
        points, so with walls each gets half of the information, and none is counted twice.

    Returns
    -------
    Observations
    """
    return Observations(
        *_observe(
            corners.positions, corners.covariances, corners.directions, corners.openings, corners.convex, corners.sides,
            walls.end_points, walls.lines, walls.covariances,
        )
    )  # fmt: skip


@kernel
def _loosen(noises: Floats, looks: Floats) -> Floats:
    out = noises.copy()
    for i in range(looks.shape[0]):
        angular = 1 if looks[i, KIND] == CORNER else 0  # bearing of a corner, direction of a wall
        out[i, angular, angular] += JITTER_ANGLE**2
        out[i, 1 - angular, 1 - angular] += JITTER**2
    return out


def loosened(seen: Observations) -> Observations:
    """Add to the noise what the pose of a single scan jitters by where contour matching gives the motion.

    That jitter comes back to zero within a stretch of contours, so it is no part of the motion's own noise.
    """
    return Observations(seen.values, _loosen(seen.noises, seen.looks), seen.looks)


@kernel
def to_world(pose: Floats, mount: Floats, looks: Floats) -> Floats:
    """The looks seen from the world: directions turned, points moved (a corner's second pair, lengths, stays)."""
    heading = pose[2] + mount[2]
    x0 = pose[0] + math.cos(pose[2]) * mount[0] - math.sin(pose[2]) * mount[1]
    y0 = pose[1] + math.sin(pose[2]) * mount[0] + math.cos(pose[2]) * mount[1]
    cos, sin = math.cos(heading), math.sin(heading)
    out = looks.copy()
    for i in range(looks.shape[0]):
        out[i, DIRECTION] = looks[i, DIRECTION] + heading
        out[i, X1] = x0 + cos * looks[i, X1] - sin * looks[i, Y1]
        out[i, Y1] = y0 + sin * looks[i, X1] + cos * looks[i, Y1]
        if looks[i, KIND] == WALL:
            out[i, X2] = x0 + cos * looks[i, X2] - sin * looks[i, Y2]
            out[i, Y2] = y0 + sin * looks[i, X2] + cos * looks[i, Y2]
    return out
