"""Where a lidar sits on the robot, out of its place in space, and scans of lidars that hang upside down."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.errors import ScanError
from contourslam.scan.laser_scan import LaserScan

MOST_TILT = 5.0  # degrees: at 10 m its beam is then 0.9 m too high or too low
LARGEST = 1e3  # m: no robot is larger


@dataclass(frozen=True, slots=True)
class Mounting:
    """Place of a lidar in the base frame.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        ``T_base_lidar``: m, m, rad.
    upside_down : bool
        Its angles count clockwise as seen from above: scans need :func:`mirrored`.
    """

    pose: NDArray[np.float64]
    upside_down: bool


def mounting(translation: ArrayLike, quaternion: ArrayLike, *, frame: str = "the lidar") -> Mounting:
    """Find how a lidar is mounted from the transform base <- lidar.

    Parameters
    ----------
    translation : array_like, shape (3,)
        Of the lidar in the base frame, m.
    quaternion : array_like, shape (4,)
        x, y, z, w.
    frame : str
        Name for the error.

    Returns
    -------
    Mounting

    Raises
    ------
    ScanError
        If the transform is no motion, or its lidar looks more than 5 degrees out of the plane.
    """
    place, turn = np.asarray(translation, dtype=np.float64), np.asarray(quaternion, dtype=np.float64)
    length = math.sqrt(float(turn @ turn)) if turn.shape == (4,) else math.nan
    if place.shape != (3,) or not (abs(length - 1.0) < 0.1 and float(np.abs(place).max()) < LARGEST):
        raise ScanError(
            f"{frame}: translation {place.tolist()} and quaternion {turn.tolist()} are no transform; "
            "check the robot's description"
        )
    x, y, z, w = (turn / length).tolist()
    up = 1.0 - 2.0 * (x * x + y * y)
    tilt = math.degrees(math.acos(min(abs(up), 1.0)))
    if tilt > MOST_TILT:
        raise ScanError(
            f"{frame}: the lidar is tilted by {tilt:.1f} degrees; contourslam needs one that scans level "
            f"(within {MOST_TILT:.0f} degrees): mount it level or correct the robot's description"
        )
    yaw = math.atan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return Mounting(np.array([place[0], place[1], yaw]), up < 0.0)


def mirrored(scan: LaserScan) -> LaserScan:
    """Turn the scan of a lidar that hangs upside down into what it would be the right way up: angles are negated."""
    return LaserScan(scan.stamp, -scan.angles, scan.ranges, scan.offsets, scan.range_min, scan.range_max)
