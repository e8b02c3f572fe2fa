"""Several scans as one view: what one leaves ambiguous, the way to the next mostly decides."""

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one, transform
from contourslam.localization.view import View, view_of
from contourslam.matching.odometry import ContourOdometry
from contourslam.matching.oriented import move

MERGED = 0.05  # m; of the points in one cell of this size that look the same way, one is kept
MOST_SCANS = 60  # the newest that are kept, about 25 m of way: farther back the motion is no longer known well


class SeveralScans:
    """Scans of one drive laid on each other by their contours; changed in place by every scan.

    Parameters
    ----------
    max_range : float
        No contour point lies farther from the robot than this, m.
    lidar : ndarray, shape (>= 2,), optional
        Where the lidar sits in the frame of the base, m; the origin by default.
    """

    def __init__(self, max_range: float, lidar: Floats | None = None) -> None:
        self._odometry = ContourOdometry(max_range)
        self._lidar = np.zeros(2) if lidar is None else np.asarray(lidar, np.float64)[:2]
        self._kept: list[tuple[Floats, Floats]] = []
        self._newest: Floats = np.empty((0, 4))

    def push(self, oriented: Floats, increment: Floats, noise: Floats) -> None:
        """Take in a scan.

        Parameters
        ----------
        oriented : ndarray, shape (n, 4)
            Its contour points and normals in the frame of the base.
        increment : ndarray, shape (3,)
            Motion since the last scan as the wheels have it, in the frame of the base then; of no matter at the first.
        noise : ndarray, shape (3, 3)
            Its covariance.
        """
        before = self._odometry.keyframes
        self._odometry.push(oriented, increment, noise)
        self._newest = oriented
        if self._odometry.keyframes > before:
            self._kept = [*self._kept, (oriented, self._odometry.pose)][-MOST_SCANS:]

    def view(self) -> View:
        """Everything seen, in the frame of the base at the last scan."""
        points, origins = [self._newest], [np.tile(self._lidar, (len(self._newest), 1))]
        for oriented, pose in reversed(self._kept):
            if oriented is not self._newest:
                seen = between_one(self._odometry.pose, pose)
                points.append(move(oriented, seen))
                origins.append(np.tile(transform(seen, self._lidar), (len(oriented), 1)))
        everything = np.concatenate(points)
        good = np.isfinite(everything).all(axis=1)
        everything, places = everything[good], np.concatenate(origins)[good]
        octants = np.floor(np.arctan2(everything[:, 3], everything[:, 2]) * (4.0 / np.pi) + 0.5) % 8
        keys = np.column_stack([np.floor(everything[:, :2] / MERGED), octants])
        first = np.sort(np.unique(keys, axis=0, return_index=True)[1])  # the newest look at each surface
        return view_of(everything[first], places[first])
