"""What keyframes saw of corners and walls: a row of numbers each, kept for the whole drive."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap_angle
from contourslam.geometry.poses import compose_one
from contourslam.kernels import kernel
from contourslam.landmarks import Corners, Walls
from contourslam.slam.measurement import CORNER, WALL

# Columns of a sighting, and of a landmark. X, Y: a corner's position, a wall's middle. DIRECTION: a corner's bisector,
# a wall's normal. START, END: a corner's sides at DIRECTION -+ OPENING / 2, a wall's ends along its tangent from X, Y.
# PXX ... PTT: covariance in the landmark's own frame, x along DIRECTION; of a wall x is across its line, and y is open.
KIND, X, Y, DIRECTION, OPENING, CONVEX, START, END, PXX, PXY, PYY, PXT, PTT = range(13)
COLUMNS = 13

# A corner and the walls that meet in it share their points, and contour matching has used the same points once more:
# each gets its part, so that none is counted twice.
SHARE = 4.0
# Standard deviations that neighbouring scans have in common, beyond the noise of the points: rough and glassy surfaces,
# ranges that depend on the angle of incidence.
POSITION_FLOOR, ANGLE_FLOOR = 0.01, math.radians(0.3)
# Direction of a corner: points off the line by so much tilt a side the more the shorter it is.
SIDE_SIGMA, CORNER_ANGLE_FLOOR = 0.02, math.radians(1.5)


@kernel
def _sight(
    positions: Floats, covariances: Floats, directions: Floats, openings: Floats, convex: NDArray[np.bool_],
    sides: Floats, end_points: Floats, lines: Floats, line_covariances: Floats, mount: Floats,
) -> Floats:  # fmt: skip
    k, w = positions.shape[0], lines.shape[0]
    out = np.zeros((k + w, COLUMNS))
    pose = np.empty(3)
    for i in range(k):
        row, a = out[i], directions[i]
        pose[0], pose[1], pose[2] = positions[i, 0], positions[i, 1], a
        pose = compose_one(mount, pose)
        row[KIND], row[X], row[Y], row[DIRECTION], row[OPENING] = CORNER, pose[0], pose[1], pose[2], openings[i]
        # Along the contour matter lies to the right: at a convex corner the second side is the one at +opening / 2.
        if convex[i]:
            row[CONVEX], row[START], row[END] = 1.0, sides[i, 0], sides[i, 1]
        else:
            row[START], row[END] = sides[i, 1], sides[i, 0]
        c, s = math.cos(a), math.sin(a)
        xx, xy, yy = covariances[i, 0, 0], covariances[i, 0, 1], covariances[i, 1, 1]
        floor = POSITION_FLOOR**2
        row[PXX] = SHARE * (c * c * xx + 2.0 * c * s * xy + s * s * yy + floor)
        row[PXY] = SHARE * (c * s * (yy - xx) + (c * c - s * s) * xy)
        row[PYY] = SHARE * (s * s * xx - 2.0 * c * s * xy + c * c * yy + floor)
        tilt = 0.25 * SIDE_SIGMA**2 * (1.0 / sides[i, 0] ** 2 + 1.0 / sides[i, 1] ** 2)
        row[PTT] = SHARE * (tilt + CORNER_ANGLE_FLOOR**2)
    for i in range(w):
        row, a = out[k + i], lines[i, 0]
        x1, y1, x2, y2 = end_points[i, 0, 0], end_points[i, 0, 1], end_points[i, 1, 0], end_points[i, 1, 1]
        pose[0], pose[1], pose[2] = 0.5 * (x1 + x2), 0.5 * (y1 + y2), a
        along = -math.sin(a) * pose[0] + math.cos(a) * pose[1]  # from the foot of the normal to the middle
        half = 0.5 * math.hypot(x2 - x1, y2 - y1)
        pose = compose_one(mount, pose)
        row[KIND], row[X], row[Y], row[DIRECTION], row[START], row[END] = WALL, pose[0], pose[1], pose[2], -half, half
        tt, dt, dd = line_covariances[i, 0, 0], line_covariances[i, 0, 1], line_covariances[i, 1, 1]
        row[PXX] = SHARE * (dd - 2.0 * along * dt + along * along * tt + POSITION_FLOOR**2)
        row[PXT] = SHARE * (dt - along * tt)
        row[PTT] = SHARE * (tt + ANGLE_FLOOR**2)
    return out


def sight(corners: Corners, walls: Walls, mount: Floats) -> Floats:
    """Rows for the corners and walls of one scan, corners first.

    Parameters
    ----------
    corners, walls
        In the lidar's frame.
    mount : ndarray, shape (3,)
        ``T_base_lidar``.

    Returns
    -------
    ndarray, shape (n, COLUMNS)
        In the base frame.
    """
    return _sight(
        corners.positions, corners.covariances, corners.directions, corners.openings, corners.convex, corners.sides,
        walls.end_points, walls.lines, walls.covariances, mount,
    )  # fmt: skip


@kernel
def to_world(rows: NDArray[np.floating], keys: NDArray[np.integer], poses: Floats) -> Floats:
    """Rows seen from the keyframes `keys`, in the frame in which `poses` gives all keyframes; a copy in float64."""
    out = rows.astype(np.float64)
    for i in range(rows.shape[0]):
        pose = poses[keys[i]]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        x, y = out[i, X], out[i, Y]
        out[i, X], out[i, Y] = pose[0] + c * x - s * y, pose[1] + s * x + c * y
        out[i, DIRECTION] = wrap_angle(out[i, DIRECTION] + pose[2])
    return out


class Sightings:
    """All sightings of a drive, 60 bytes each; changed in place.

    Attributes
    ----------
    rows : ndarray of float32, shape (>= count, COLUMNS)
        In the base frame of their keyframes.
    keys : ndarray of int, shape (>= count,)
        Their keyframes.
    ids : ndarray of int, shape (>= count,)
        Landmark that they were taken for at the time, -1 for none.
    count : int
    """

    def __init__(self) -> None:
        self.count = 0
        self.rows = np.zeros((256, COLUMNS), np.float32)
        self.keys, self.ids = np.zeros(256, np.int32), np.full(256, -1, np.int32)

    def append(self, key: int | NDArray[np.int32], rows: NDArray[np.floating]) -> int:
        """Keep the sightings of a keyframe, or of several that ascend; returns the index of the first."""
        first, until = self.count, self.count + len(rows)
        while until > len(self.keys):
            self.rows = np.concatenate([self.rows, np.zeros_like(self.rows)])
            self.keys = np.concatenate([self.keys, np.zeros_like(self.keys)])
            self.ids = np.concatenate([self.ids, np.full_like(self.ids, -1)])
        self.rows[first:until], self.keys[first:until], self.ids[first:until] = rows, key, -1
        self.count = until
        return first
