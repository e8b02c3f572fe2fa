"""A lane with a mapper of its own, fed message by message."""

from collections.abc import Callable

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.detectors import Detector
from contourslam.replay import Stopwatch
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.mapper import Mapper
from contourslam.view.lane import Lane
from contourslam.view.moment import LaneMoment


class FedLane(Lane):
    """A lane that is fed.

    Parameters
    ----------
    config : Config
    detector : Detector
        The mapper's own.
    make : callable
        Makes the mapper; with the arguments of :func:`contourslam.replay.make_mapper`.
    initial_pose, lidar_mount : ndarray, shape (3,), or None
    """

    def __init__(
        self,
        config: Config,
        detector: Detector,
        make: Callable[..., Mapper],
        initial_pose: Floats | None,
        lidar_mount: Floats | None,
    ) -> None:
        self.detector, self._watch = detector, Stopwatch()
        mapper = make(config, detector, initial_pose=initial_pose, lidar_mount=lidar_mount, lap=self._watch)
        mount: Floats = np.array(config.lidar.mount if lidar_mount is None else lidar_mount, dtype=np.float64)
        super().__init__(mapper, config, mount)

    def push_odometry(self, odometry: Odometry) -> None:
        """Hand on one reading."""
        self.mapper.push_odometry(odometry)

    def push_scan(self, scan: LaserScan, elapsed: float) -> LaneMoment:
        """Hand on one scan.

        Raises
        ------
        ContourslamError
            If the mapper cannot use it.
        """
        watch = self._watch
        watch.seconds.clear()
        watch.start()
        return self.take(self.mapper.push_scan(scan), watch.seconds, elapsed)
