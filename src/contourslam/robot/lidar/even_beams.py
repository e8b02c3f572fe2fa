"""Scans put on evenly spaced beams, which is all that the standard message of ROS, and so a recording, can say."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.scan import LaserScan

_JOINED, _JOINED_SHARE = 0.05, 0.05  # m and share of the range: neighbours closer than this are on one surface


def even_beams(scan: LaserScan) -> LaserScan:
    """Read a whole turn off at evenly spaced angles, as many as it has beams.

    Between two neighbours on one surface, 1/r is interpolated, which on a flat wall is exact to a few micrometres;
    elsewhere the nearer neighbour is taken. A beam with no neighbour within a step and a half is NaN. The times are
    made even too: the X4's own differ from these by less than 1 ms, but near things by up to 4 ms.

    Parameters
    ----------
    scan : LaserScan
        Of a lidar that turns one way all around.

    Returns
    -------
    LaserScan
        Angles from the first beam's on, falling where the lidar turns clockwise; the stamp is the first one's time.
    """
    count = scan.angles.size
    if count < 3:
        return scan
    step = 2.0 * math.pi / count
    falling = float(np.median(np.diff(np.unwrap(scan.angles)))) < 0.0
    sign = -1.0 if falling else 1.0
    # Angles since the turn's first beam, in the sense of turning; the seam is where it began, not at pi.
    around = sign * (scan.angles - scan.angles[0])
    order = np.argsort(around % (2.0 * math.pi), kind="stable")
    around, ranges, offsets = (around % (2.0 * math.pi))[order], scan.ranges[order], scan.offsets[order]
    wanted = step * np.arange(count, dtype=np.float64)
    right = np.clip(np.searchsorted(around, wanted, side="left"), 1, count - 1)
    left = right - 1
    a, b = around[left], around[right]
    weight = np.clip((wanted - a) / np.maximum(b - a, 1e-12), 0.0, 1.0)
    near, distance = np.where(weight < 0.5, left, right), np.minimum(np.abs(wanted - a), np.abs(wanted - b))
    with np.errstate(divide="ignore", invalid="ignore"):
        between = 1.0 / ((1.0 - weight) / ranges[left] + weight / ranges[right])
        joined = np.abs(ranges[left] - ranges[right]) < _JOINED + _JOINED_SHARE * ranges[left]
    joined &= (b - a < 2.5 * step) & (ranges[left] > 0.0) & (ranges[right] > 0.0)
    made: NDArray[np.float64] = np.where(joined, between, ranges[near])
    made[distance > 1.5 * step] = math.nan
    begin, speed = _even_times(wanted, around, offsets)
    angles = scan.angles[0] + sign * wanted
    return LaserScan(scan.stamp + begin, angles, made, speed * wanted, scan.range_min, scan.range_max)


def _even_times(
    wanted: NDArray[np.float64], around: NDArray[np.float64], offsets: NDArray[np.float64]
) -> tuple[float, float]:
    """Time at angle 0 (s after the stamp) and time for each radian, by the middle of what the beams say."""
    speed = float(offsets.max() - offsets.min()) / max(float(around[-1] - around[0]), 1e-6)
    return float(np.median(offsets - speed * around)), speed
