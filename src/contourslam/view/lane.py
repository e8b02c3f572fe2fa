"""One back end with one detector, watched scan by scan, and drawn up as a map every so often."""

import sys
from array import array
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.contour.contours import Contours, Floats
from contourslam.geometry.poses import between_one, compose_one
from contourslam.slam.look import Look
from contourslam.slam.mapper import Mapper
from contourslam.slam.result import Loop, ScanUpdate
from contourslam.slam.slam import ContourSlam
from contourslam.view.moment import LaneMoment, Sighting, sighting_of
from contourslam.view.stories import Stories

if TYPE_CHECKING:
    from contourslam.graph import GraphSlam

RECENT = 0.03  # weight of the last scan in the time per stage
TOGETHER = 8  # scans after which it is reckoned anew

METHODS = ("nearby", "search", "constellation")
"""How loops are found, in the order in which the page numbers them."""


def as_graph(mapper: Mapper) -> "GraphSlam | None":
    """Give the mapper itself where it is a graph."""
    if "contourslam.graph" not in sys.modules:  # then GTSAM may not be installed, and the mapper is no graph
        return None
    from contourslam.graph import GraphSlam

    return mapper if isinstance(mapper, GraphSlam) else None


class Lane:
    """What is learnt by watching a mapper; changed in place by each scan.

    Parameters
    ----------
    mapper : Mapper
        It may have mapped the scan that is taken in first, and no more of the drive.
    config : Config
        That of the mapper; its detector names the lane.
    mount : ndarray, shape (3,)
        ``T_base_lidar``.

    Attributes
    ----------
    stories : Stories
    loops : list of Loop
        Closed so far.
    last_pose : ndarray, shape (3,)
        Pose at the last scan as it was known then.
    """

    def __init__(self, mapper: Mapper, config: Config, mount: Floats) -> None:
        self.mapper, self.config, self.mount = mapper, config, mount
        self.stories = Stories()
        self.loops: list[Loop] = []
        self.last_pose: Floats = mapper.start_pose
        self._graph = as_graph(mapper)
        # What shows more of its work than every mapper does.
        self._watched = mapper if isinstance(mapper, ContourSlam) else self._graph
        self._stamps = array("d")  # of all scans: eight bytes each, for a drive may take hours
        self._ties: list[tuple[int, int, int]] = []  # of each loop, numbers of its two scans and of its method
        self._sighting: Sighting | None = None
        self._seconds: dict[str, float] = {}  # of the scans since the stages were last reckoned
        self._milliseconds: dict[str, float] = {}
        self._stages: tuple[tuple[str, float], ...] = ()
        self._odometry_start: Floats | None = None  # where its origin lies

    def take(
        self, update: ScanUpdate, seconds: Mapping[str, float], elapsed: float, *, localized: bool = True
    ) -> LaneMoment:
        """Take in a scan that the mapper has just mapped.

        Parameters
        ----------
        update : ScanUpdate
            What it said of it.
        seconds : mapping of str to float
            CPU time of each stage, s.
        elapsed : float
            When, s: of a recording since its first scan, of a robot since it began to be followed.
        localized : bool
            Whether the mapper knows where the robot is.
        """
        self._stamps.append(update.stamp)
        self._count_time(seconds)
        self.last_pose = update.pose
        look = self.look
        if look is not None and look.stamp == update.stamp:
            self._sighting = sighting_of(look, update.pose, self.mount)
            self.stories.take(elapsed, update, self._sighting)
            if self._graph is not None:  # it closes loops where it looks for landmarks
                self._count_loops(self._graph.loops(len(self.loops)))
        else:
            self.stories.take(elapsed, update, None)
        return LaneMoment(update, self._sighting, self._stages, localized)

    @property
    def at_rest(self) -> bool:
        """Whether the map can be drawn up without a change in what the mapper does next."""
        return self._graph is None or self._graph.at_rest

    def contours(self) -> Contours | None:
        """Those of the last scan, in the lidar's frame; None where the mapper does not show them."""
        return None if self._watched is None else self._watched.contours

    @property
    def look(self) -> Look | None:
        """The newest look at the landmarks; None before the first, or where the mapper does not show it."""
        return None if self._watched is None else self._watched.look

    def odometry(self) -> Floats:
        """Raw odometry at the last scan, moved so that it starts where the estimate starts, shape (3,)."""
        pose = self.mapper.odometry_pose
        if self._odometry_start is None:
            self._odometry_start = compose_one(self.mapper.start_pose, between_one(np.array(pose), np.zeros(3)))
        return compose_one(self._odometry_start, pose)

    def _count_time(self, seconds: Mapping[str, float]) -> None:
        total = self._seconds
        for stage, spent in seconds.items():
            total[stage] = total.get(stage, 0.0) + spent
        scans = len(self._stamps)
        if scans % TOGETHER and scans > TOGETHER:
            return
        count = TOGETHER if scans > TOGETHER else 1
        weight, known = max(RECENT, 1.0 / scans) * count, self._milliseconds
        for stage in total:  # in the order in which they were first met
            before = known.get(stage, 0.0)
            known[stage] = before + weight * (1e3 * total[stage] / count - before)
            total[stage] = 0.0
        self._stages = tuple(known.items())

    def _count_loops(self, loops: tuple[Loop, ...]) -> None:
        """Note which scans each loop ties; one to a place of an earlier drive has an end that is on no way here."""
        if not loops:
            return
        self.loops += loops
        stamps = np.frombuffer(self._stamps).copy()  # no view: it would keep the array from growing
        for loop in loops:
            ends = [np.flatnonzero(stamps == stamp) for stamp in (loop.earlier_stamp, loop.later_stamp)]
            if all(len(found) for found in ends):
                self._ties.append((int(ends[0][-1]), int(ends[1][-1]), METHODS.index(loop.method)))

    def draw(self, knots: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
        """Draw up the map, as arrays for the page.

        Parameters
        ----------
        knots : ndarray of int, shape (k,)
            Scans that are knots.

        Returns
        -------
        dict
            Corners, walls, poses of the knots and ends of the loops, as they stand now; no poses where they are what
            they were at the time, which the knots have.
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
            "loop_methods": np.array([method for _, _, method in self._ties], dtype=np.uint8),
        }

    def _path(self, knots: NDArray[np.int64]) -> tuple[Floats, Floats]:
        """Poses of the knots as they stand now, and ends of the loops: shapes (k, 3) and (n, 2, 2)."""
        if self._graph is None:
            return np.empty((0, 3)), np.empty((0, 2, 2))
        ties = np.array(self._ties, np.int64).reshape(-1, 3)[:, :2]
        path = self._graph.path(np.concatenate([knots, ties.ravel()]))
        return path[: len(knots)], path[len(knots) :, :2].reshape(-1, 2, 2)
