"""Mapping that goes on in a map: first the robot is found and followed there, then the map grows."""

import math
from collections import deque
from collections.abc import Callable, Mapping

from contourslam.config import Config, LiveConfig
from contourslam.contour.contours import Floats
from contourslam.localization.follow import Localizer
from contourslam.maps.saved_map import SavedMap
from contourslam.replay import continue_mapper, keep_map
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.mapper import Finished, Mapper
from contourslam.slam.result import ScanUpdate

KEPT = 500  # readings: those around the scan from which on the map grows
LEAST_TIME, LEAST_WAY = 3.0, 2.0  # s, m


class Resuming:
    """A mapper that looks for the robot in a saved map, follows it there for a while, and then continues the map.

    A drive that goes on at a wrong place spoils the map. So the robot must have been followed for `sure_way` or
    `sure_time`; or for `LEAST_TIME` and `LEAST_WAY`, where it then drives out of what the map knows.

    Parameters
    ----------
    saved : SavedMap
    config : Config
    live : LiveConfig
    initial_pose : ndarray, shape (3,), optional
        About where the base is in the map: m, m, rad; it is looked for everywhere by default.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    begin : callable, optional
        Makes the mapper of a new map, which is begun after `give_up_after` in vain; never by default.
    lap : callable, optional
        Called with the name of each stage when it is done, for those who measure time.

    Raises
    ------
    ContourslamError
        If nothing can be localised in the map.
    """

    def __init__(
        self,
        saved: SavedMap,
        config: Config,
        live: LiveConfig,
        *,
        initial_pose: Floats | None = None,
        lidar_mount: Floats | None = None,
        begin: Callable[[], Mapper] | None = None,
        lap: Callable[[str], None] = lambda stage: None,
    ) -> None:
        self._saved, self._config, self._live, self._mount, self._lap = saved, config, live, lidar_mount, lap
        self._localizer = Localizer(saved, config, initial_pose=initial_pose, lidar_mount=lidar_mount, lap=lap)
        self._mapper: Mapper = self._localizer
        self._readings: deque[Odometry] = deque(maxlen=KEPT)
        self._begin = begin
        self._first = math.nan  # stamp of the first scan
        self._found, self._way = math.nan, 0.0  # stamp of the scan since which it is followed, and how far it went
        self._last: Floats | None = None

    @property
    def growing(self) -> bool:
        """Whether the map grows; until then it is as it was saved."""
        return self._mapper is not self._localizer

    @property
    def localized(self) -> bool:
        """Whether the robot has been found."""
        return self.growing or self._localizer.localized

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
        if not self.growing:
            self._readings.append(odometry)

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        """Look for the robot; once it has been found for sure, map."""
        update = self._mapper.push_scan(scan)
        if self.growing:
            return update
        if math.isnan(self._first):
            self._first = scan.stamp
        if self._sure(update):
            return self._hand_over(self._continued(update), scan)
        if self._begin is not None and math.isnan(self._found) and scan.stamp - self._first > self._live.give_up_after:
            return self._hand_over(self._begin(), scan)
        return update

    def _sure(self, update: ScanUpdate) -> bool:
        """Whether the robot has been followed for so long that the map may grow."""
        localized, time = self._localizer.localized, update.stamp - self._found
        if localized and self._last is not None:
            self._way += math.dist(update.pose[:2], self._last[:2])
        if not localized:
            leaves = time > LEAST_TIME and self._way > LEAST_WAY
            self._found, self._way, self._last = math.nan, 0.0, None
            return leaves
        if math.isnan(self._found):
            self._found = update.stamp
        self._last, self._first = update.pose, update.stamp
        return self._way > self._live.sure_way or time > self._live.sure_time

    def corner_map(self) -> CornerMap:
        """Corners of the map as they stand now."""
        return self._mapper.corner_map()

    def wall_map(self) -> WallMap:
        """Walls of the map as they stand now."""
        return self._mapper.wall_map()

    def finish(self) -> Finished | None:
        """Revise the whole drive, where the mapper can."""
        return self._mapper.finish()

    @property
    def standing(self) -> tuple[Mapper, SavedMap | None]:
        """The mapper that works now, and the map in which it localises, or None where it maps."""
        return self._mapper, None if self.growing else self._saved

    def keep(self, about: Mapping[str, str]) -> SavedMap:
        """Give the map as it is kept."""
        return keep_map(self._mapper, about) if self.growing else self._saved

    def _continued(self, found: ScanUpdate) -> Mapper:
        return continue_mapper(
            self._saved, found.covariance, self._config, initial_pose=found.pose, lidar_mount=self._mount, lap=self._lap
        )

    def _hand_over(self, mapper: Mapper, scan: LaserScan) -> ScanUpdate:
        for reading in self._readings:
            mapper.push_odometry(reading)
        self._readings.clear()
        self._mapper = mapper
        return mapper.push_scan(scan)
