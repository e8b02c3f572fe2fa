"""The last odometry readings, asked for the motion between scans and during one."""

from bisect import bisect_left, bisect_right

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import interpolate_one
from contourslam.scan import Odometry


class OdometryBuffer:
    """Readings since the last scan, ascending in time; changed in place.

    Only differences between readings count, never the odometry's own origin.
    """

    def __init__(self) -> None:
        self._stamps: list[float] = []
        self._poses: list[Floats] = []

    def __len__(self) -> int:
        return len(self._stamps)

    def push(self, odometry: Odometry) -> None:
        """Take in a reading. One stamped before others takes their place: the clock was set back, the wheels not."""
        while self._stamps and odometry.stamp <= self._stamps[-1]:
            self._stamps.pop()
            self._poses.pop()
        self._stamps.append(odometry.stamp)
        self._poses.append(odometry.pose)

    def during(self, start: float, end: float) -> tuple[Floats, Floats]:
        """Readings that cover the time from `start` to `end`, and one more to either side; older ones are forgotten.

        Returns
        -------
        times : ndarray, shape (k,)
            After `start`, s.
        poses : ndarray, shape (k, 3)
            ``T_odom_base``.
        """
        first = max(bisect_right(self._stamps, start) - 1, 0)
        # One reading before the start stays as well: with two, the motion can be extrapolated.
        first = max(min(first, len(self._stamps) - 2), 0)
        del self._stamps[:first], self._poses[:first]
        last = bisect_left(self._stamps, end) + 1
        return np.array(self._stamps[:last]) - start, np.array(self._poses[:last]).reshape(-1, 3)

    @staticmethod
    def pose_at_start(times: Floats, poses: Floats) -> Floats:
        """Pose of the odometry at the start asked for, interpolated, never extrapolated."""
        return interpolate_one(times, poses, 0.0, True)
