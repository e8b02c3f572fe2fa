"""Undoing the robot's motion during a scan: every beam is moved to the lidar's frame at the scan's stamp."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap_angle
from contourslam.geometry.poses import between_one, compose_one, interpolate_one
from contourslam.kernels import kernel
from contourslam.scan.laser_scan import LaserScan

Floats = NDArray[np.float64]


@kernel
def _lidar_motion(times: Floats, base_poses: Floats, T_base_lidar: Floats) -> Floats:
    """Poses of the lidar at `times`, seen from where it is at time 0."""
    motion = np.zeros((times.size, 3))
    if times.size < 2:
        return motion
    for k in range(times.size):
        motion[k] = compose_one(base_poses[k], T_base_lidar)
    start = interpolate_one(times, motion, 0.0, False)
    for k in range(times.size):
        motion[k] = between_one(start, motion[k])
    return motion


@kernel
def _deskew(
    ranges: Floats, angles: Floats, offsets: Floats, valid: NDArray[np.bool_], times: Floats, motion: Floats
) -> tuple[Floats, NDArray[np.int64]]:
    """Points of the valid beams and their beam numbers; `motion` is the lidar at `times` seen from time 0."""
    points = np.empty((ranges.size, 2))
    beams = np.empty(ranges.size, dtype=np.int64)
    count = 0
    knot = 0
    for i in range(ranges.size):
        if not valid[i]:
            continue
        x = y = turn = 0.0
        if times.size > 1:
            # Beams are in the order of time in nearly every lidar, so the knot moves on by at most one or two.
            while knot > 0 and offsets[i] < times[knot]:
                knot -= 1
            while knot < times.size - 2 and offsets[i] > times[knot + 1]:
                knot += 1
            span = times[knot + 1] - times[knot]
            weight = (offsets[i] - times[knot]) / span if span > 0.0 else 0.0
            x = motion[knot, 0] + weight * (motion[knot + 1, 0] - motion[knot, 0])
            y = motion[knot, 1] + weight * (motion[knot + 1, 1] - motion[knot, 1])
            turn = motion[knot, 2] + weight * wrap_angle(motion[knot + 1, 2] - motion[knot, 2])
        bearing = angles[i] + turn
        points[count, 0] = x + ranges[i] * math.cos(bearing)
        points[count, 1] = y + ranges[i] * math.sin(bearing)
        beams[count] = i
        count += 1
    return points[:count], beams[:count]


def deskew(
    scan: LaserScan, valid: NDArray[np.bool_], times: Floats, base_poses: Floats, T_base_lidar: Floats
) -> tuple[Floats, NDArray[np.int64]]:
    """Cartesian points of the valid beams in the lidar's frame at the scan's stamp (eq. 1, with motion undone).

    The motion between two odometry readings is taken as even, which it is to well under a millimetre within a scan.
    Beams before the first or after the last reading are extrapolated at the twist of the nearest two.

    Parameters
    ----------
    scan : LaserScan
    valid : ndarray of bool, shape (n,)
    times : ndarray, shape (k,)
        Times of the odometry readings around the scan, ascending, in s after the scan's stamp; none or one means
        that nothing is known of the motion, and nothing is undone.
    base_poses : ndarray, shape (k, 3)
        Base in the odometry frame at these times (``T_odom_base``).
    T_base_lidar : ndarray, shape (3,)
        Mounting of the lidar.

    Returns
    -------
    points : ndarray, shape (m, 2)
        m.
    beams : ndarray of int, shape (m,)
        Beam number of each point.
    """
    motion = _lidar_motion(times, base_poses, T_base_lidar)
    return _deskew(scan.ranges, scan.angles, scan.offsets, valid, times, motion)
