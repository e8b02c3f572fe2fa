"""One back end with one detector: fed scan by scan, drawn up as a map every so often."""

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.contour.contours import Contours, Floats
from contourslam.detectors import Detector
from contourslam.replay import Stopwatch
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.mapper import Mapper
from contourslam.slam.result import Loop
from contourslam.slam.slam import ContourSlam
from contourslam.view.moment import LaneMoment, Sighting, sighting_of
from contourslam.view.stories import Stories

if TYPE_CHECKING:
    from contourslam.graph import GraphSlam

RECENT = 0.03  # weight of the last scan in the time per stage


METHODS = ("nearby", "search", "constellation")
"""How loops are found, in the order in which the page numbers them."""


def as_graph(mapper: Mapper) -> "GraphSlam | None":
    """Give the mapper itself where it is a graph."""
    if "contourslam.graph" not in sys.modules:  # then GTSAM may not be installed, and the mapper is no graph
        return None
    from contourslam.graph import GraphSlam

    return mapper if isinstance(mapper, GraphSlam) else None


class Lane:
    """A mapper and what is learnt by watching it.

    Parameters
    ----------
    config : Config
        That of the mapper; its detector names the lane.
    detector : Detector
        The mapper's own.
    make : callable
        Makes the mapper; with the arguments of :func:`contourslam.replay.make_mapper`.
    initial_pose, lidar_mount : ndarray, shape (3,), or None

    Attributes
    ----------
    mapper : Mapper
    stories : Stories
    loops : list of Loop
        Closed so far.
    """

    def __init__(
        self,
        config: Config,
        detector: Detector,
        make: Callable[..., Mapper],
        initial_pose: Floats | None,
        lidar_mount: Floats | None,
    ) -> None:
        self.config, self.detector = config, detector
        self._watch = Stopwatch()
        self.mapper = make(config, detector, initial_pose=initial_pose, lidar_mount=lidar_mount, lap=self._watch)
        self.mount: Floats = np.array(config.lidar.mount if lidar_mount is None else lidar_mount, dtype=np.float64)
        self.stories = Stories()
        self.loops: list[Loop] = []
        self._graph = as_graph(self.mapper)
        # What shows more of its work than every mapper does.
        self._watched = self.mapper if isinstance(self.mapper, ContourSlam) else self._graph
        self._scan_at: dict[float, int] = {}
        self._sighting: Sighting | None = None
        self._poses: list[Floats] = []
        self._milliseconds: dict[str, float] = {}
        self._scans = 0

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
        update = self.mapper.push_scan(scan)
        self._count_time(watch.seconds)
        self._scan_at[scan.stamp] = len(self._poses)
        self._poses.append(update.pose)
        if self._graph is not None:
            self.loops += self._graph.loops(len(self.loops))
        look = None if self._watched is None else self._watched.look
        if look is not None and look.stamp == scan.stamp:
            self._sighting = sighting_of(look, update.pose, self.mount)
            self.stories.take(elapsed, update, self._sighting)
        else:
            self.stories.take(elapsed, update, None)
        return LaneMoment(update, self._sighting, tuple(self._milliseconds.items()))

    @property
    def last_pose(self) -> Floats:
        """Pose at the last scan as it was known then, shape (3,)."""
        return self._poses[-1]

    @property
    def at_rest(self) -> bool:
        """Whether the map can be drawn up without a change in what the mapper does next."""
        return self._graph is None or self._graph.at_rest

    def contours(self) -> Contours | None:
        """Those of the last scan, in the lidar's frame; None where the mapper does not show them."""
        return None if self._watched is None else self._watched.contours

    def _count_time(self, seconds: dict[str, float]) -> None:
        self._scans += 1
        weight = max(RECENT, 1.0 / self._scans)
        known = self._milliseconds
        for stage in dict.fromkeys((*known, *seconds)):  # in the order in which they were first met
            before = known.get(stage, 0.0)
            known[stage] = before + weight * (1e3 * seconds.get(stage, 0.0) - before)

    def draw(self, knots: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """Draw up the map, as arrays for the page.

        Parameters
        ----------
        knots : ndarray of int, shape (k,)
            Scans that are knots.

        Returns
        -------
        dict
            Corners, walls, poses of the knots and ends of the loops, as they stand now.
        """
        corners, walls = self.mapper.corner_map(), self.mapper.wall_map()
        path, ends = self._path(knots)
        p = corners.covariances.reshape(-1, 4)
        return {
            "corner_ids": corners.ids.astype(np.int32),
            "corners": corners.positions.astype(np.float32),
            "covariances": p[:, [0, 1, 3]].astype(np.float32),
            "directions": corners.directions.astype(np.float32),
            "openings": corners.openings.astype(np.float32),
            "convex": corners.convex.astype(np.uint8),
            "observed": corners.observed.astype(np.int32),
            "failed": corners.failed.astype(np.int32),
            "wall_ids": walls.ids.astype(np.int32),
            "walls": walls.end_points.reshape(-1, 4).astype(np.float32),
            "path": path.astype(np.float32),
            "loops": ends.reshape(-1, 4).astype(np.float32),
            "loop_methods": np.array([METHODS.index(loop.method) for loop in self.loops], dtype=np.uint8),
        }

    def _path(self, knots: NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Poses of the knots as they stand now, and ends of the loops: shapes (k, 3) and (n, 2, 2)."""
        if self._graph is None:
            return np.array([self._poses[i] for i in knots.tolist()]).reshape(-1, 3), np.empty((0, 2, 2))
        path = self._graph.path()
        at = [(self._scan_at[loop.earlier_stamp], self._scan_at[loop.later_stamp]) for loop in self.loops]
        return path[knots], path[np.array(at, np.int64).reshape(-1, 2), :2]
