"""Mapping that goes on in a map: first the robot is found there, then the map grows."""

import math
from collections import deque
from collections.abc import Callable, Mapping

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.localization.follow import Localizer
from contourslam.maps.saved_map import SavedMap
from contourslam.replay import continue_mapper, keep_map
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.mapper import Finished, Mapper
from contourslam.slam.result import ScanUpdate

KEPT = 500  # readings: those around the scan with which the robot is found


class Resuming:
    """A mapper that looks for the robot in a saved map, and continues the map from the scan on with which it is found.

    Parameters
    ----------
    saved : SavedMap
    config : Config
    initial_pose : ndarray, shape (3,), optional
        About where the base is in the map: m, m, rad; it is looked for everywhere by default.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    give_up_after : float, optional
        After so much time in vain, s, a new map is begun; never by default.
    begin : callable, optional
        Makes the mapper of the new map; needed with `give_up_after`.

    Raises
    ------
    ContourslamError
        If nothing can be localised in the map.
    """

    def __init__(
        self,
        saved: SavedMap,
        config: Config,
        *,
        initial_pose: Floats | None = None,
        lidar_mount: Floats | None = None,
        give_up_after: float = math.inf,
        begin: Callable[[], Mapper] | None = None,
    ) -> None:
        self._saved, self._config, self._mount = saved, config, lidar_mount
        self._localizer = Localizer(saved, config, initial_pose=initial_pose, lidar_mount=lidar_mount)
        self._mapper: Mapper = self._localizer
        self._readings: deque[Odometry] = deque(maxlen=KEPT)
        self._give_up_after, self._begin = give_up_after, begin
        self._first = math.nan  # stamp of the first scan

    @property
    def localized(self) -> bool:
        """Whether the robot has been found and the map grows."""
        return self._mapper is not self._localizer

    @property
    def start_pose(self) -> Floats:
        """Base in the map where it was found, shape (3,)."""
        return self._mapper.start_pose

    @property
    def odometry_pose(self) -> Floats:
        """Raw odometry at the stamp of the last scan (``T_odom_base``), shape (3,); zeros before the first reading."""
        return self._mapper.odometry_pose

    def push_odometry(self, odometry: Odometry) -> None:
        """Take in one odometry reading."""
        self._mapper.push_odometry(odometry)
        if not self.localized:
            self._readings.append(odometry)

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        """Look for the robot; once it is found, map."""
        update = self._mapper.push_scan(scan)
        if self.localized:
            return update
        if self._localizer.localized:
            return self._go_on(update, scan)
        if math.isnan(self._first):
            self._first = scan.stamp
        if self._begin is not None and scan.stamp - self._first > self._give_up_after:
            return self._hand_over(self._begin(), scan)
        return update

    def corner_map(self) -> CornerMap:
        """Corners of the map as they stand now."""
        return self._mapper.corner_map()

    def wall_map(self) -> WallMap:
        """Walls of the map as they stand now."""
        return self._mapper.wall_map()

    def finish(self) -> Finished | None:
        """Revise the whole drive, where the mapper can."""
        return self._mapper.finish()

    def keep(self, about: Mapping[str, str]) -> SavedMap:
        """Give the map as it is kept."""
        return keep_map(self._mapper, about) if self.localized else self._saved

    def _go_on(self, found: ScanUpdate, scan: LaserScan) -> ScanUpdate:
        mapper = continue_mapper(
            self._saved, found.covariance, self._config, initial_pose=found.pose, lidar_mount=self._mount
        )
        return self._hand_over(mapper, scan)

    def _hand_over(self, mapper: Mapper, scan: LaserScan) -> ScanUpdate:
        for reading in self._readings:
            mapper.push_odometry(reading)
        self._readings.clear()
        self._mapper = mapper
        return mapper.push_scan(scan)
