"""Corners and walls of one scan in the form in which the filter takes them: two numbers with covariance each."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.kernels import kernel
from contourslam.landmarks import Corners, Walls
from contourslam.slam.measurement import CORNER, WALL

# Columns of `Observations.looks`.
KIND, DIRECTION, OPENING, CONVEX, X1, Y1, X2, Y2 = range(8)


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
        Kind; direction, opening, convex of a corner; two points: of a corner its position and the lengths of its
        sides, of a wall its ends.
    """

    values: Floats
    noises: Floats
    looks: Floats

    def __len__(self) -> int:
        return len(self.values)


@kernel
def _polar(positions: Floats, covariances: Floats) -> tuple[Floats, Floats]:
    values = np.empty((positions.shape[0], 2))
    noises = np.empty((positions.shape[0], 2, 2))
    for i in range(positions.shape[0]):
        x, y = positions[i, 0], positions[i, 1]
        q = x * x + y * y
        r = math.sqrt(q)
        values[i, 0], values[i, 1] = r, math.atan2(y, x)
        a, b, c, d = x / r, y / r, -y / q, x / q
        xx, xy, yy = covariances[i, 0, 0], covariances[i, 0, 1], covariances[i, 1, 1]
        noises[i, 0, 0] = a * a * xx + 2.0 * a * b * xy + b * b * yy
        noises[i, 1, 1] = c * c * xx + 2.0 * c * d * xy + d * d * yy
        noises[i, 0, 1] = noises[i, 1, 0] = a * c * xx + (a * d + b * c) * xy + b * d * yy
    return values, noises


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
    k = len(corners)
    values, noises = _polar(corners.positions, corners.covariances)
    looks = np.empty((k, 8))
    looks[:, KIND] = CORNER
    looks[:, DIRECTION], looks[:, OPENING], looks[:, CONVEX] = corners.directions, corners.openings, corners.convex
    looks[:, X1 : Y1 + 1], looks[:, X2 : Y2 + 1] = corners.positions, corners.sides
    if len(walls) == 0:
        return Observations(values, noises, looks)
    wall_looks = np.zeros((len(walls), 8))
    wall_looks[:, KIND] = WALL
    wall_looks[:, X1:] = walls.end_points.reshape(-1, 4)
    return Observations(
        np.concatenate([values, walls.lines]),
        np.concatenate([2.0 * noises, 2.0 * walls.covariances]),
        np.concatenate([looks, wall_looks]),
    )


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
