"""Which corners and walls of a known map a scan shows."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Contours, Floats
from contourslam.detectors import Detector
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import transform
from contourslam.landmarks import Corners, Walls, find_landmarks
from contourslam.landmarks.detect import Lap
from contourslam.maps import SavedMap

LOOK_EVERY = 0.4  # m, or rad turned
NEAR, SAME_WAY = 0.25, math.radians(20.0)  # m, rad: a corner this close, whose bisector points this much the same way
OFF, SAME_NORMAL = (
    0.10,
    math.radians(5.0),
)  # m, rad: a wall whose line is this close and whose normal is this much alike
BEYOND = 0.3  # m by which the middle of what is seen of a wall may lie beyond the known wall's ends


@dataclass(frozen=True, slots=True)
class Sight:
    """What a scan showed: corners and walls found in it, and the ids of the map's among them, ascending."""

    corners: int
    walls: int
    matched: tuple[int, ...]


NO_SIGHT = Sight(0, 0, ())


class Sighted:
    """Corners and walls of a map, and which of them scans show; changed in place by :meth:`look`.

    Parameters
    ----------
    saved : SavedMap
    config : Config
    detector : Detector
    """

    def __init__(self, saved: SavedMap, config: Config, detector: Detector) -> None:
        self._config, self._detector = config, detector
        self._way = LOOK_EVERY  # moved since the last look
        self._corners, self._walls = saved.corners, saved.walls
        run = saved.walls.end_points[:, 1] - saved.walls.end_points[:, 0]
        self._lengths = np.hypot(run[:, 0], run[:, 1])
        self._along = run / np.maximum(self._lengths, 1e-9)[:, None]
        self._normals = np.stack([np.cos(saved.walls.normals), np.sin(saved.walls.normals)], axis=-1)

    def look(self, contours: Contours, lidar: Floats, moved: float, lap: Lap) -> Sight:
        """Find corners and walls in a scan, where the robot has moved since the last look.

        Parameters
        ----------
        contours : Contours
            Of the scan, in the lidar's frame.
        lidar : ndarray, shape (3,)
            The lidar in the map: m, m, rad.
        moved : float
            Since the scan before, m, with 1 rad of turning counted as 1 m.
        lap : callable
            Called with the name of each stage when it is done.
        """
        self._way += moved
        if self._way < LOOK_EVERY:
            return NO_SIGHT
        self._way = 0.0
        found = find_landmarks(contours, self._detector, self._config, lap)
        matched = self.ids(found.corners, found.walls, lidar)
        lap("association")
        return Sight(len(found.corners), len(found.walls), matched)

    def ids(self, corners: Corners, walls: Walls, lidar: Floats) -> tuple[int, ...]:
        """Ids of the landmarks that were seen, ascending, each once: the nearest of those that look alike.

        Parameters
        ----------
        corners : Corners
        walls : Walls
            Both in the lidar's frame.
        lidar : ndarray, shape (3,)
            The lidar in the map: m, m, rad.
        """
        found = {*self._seen_corners(corners, lidar), *self._seen_walls(walls, lidar)}
        return tuple(sorted(found))

    def _seen_corners(self, corners: Corners, lidar: Floats) -> list[int]:
        known = self._corners
        if not len(known.ids) or not len(corners.positions):
            return []
        places = transform(lidar, corners.positions)
        away = np.hypot(*(places[:, None] - known.positions[None]).transpose(2, 0, 1))
        turned = np.abs(wrap(corners.directions[:, None] + lidar[2] - known.directions[None]))
        alike = (corners.convex[:, None] == known.convex[None]) & (turned < SAME_WAY) & (away < NEAR)
        nearest = np.where(alike, away, np.inf).argmin(axis=1)
        ids: list[int] = known.ids[nearest[alike.any(axis=1)]].tolist()
        return ids

    def _seen_walls(self, walls: Walls, lidar: Floats) -> list[int]:
        known = self._walls
        if not len(known.ids) or not len(walls.lines):
            return []
        middles = transform(lidar, walls.end_points.mean(axis=1))[:, None] - known.end_points[None, :, 0]
        along = np.einsum("swc,wc->sw", middles, self._along)
        off = np.abs(np.einsum("swc,wc->sw", middles, self._normals))
        turned = np.abs(wrap(walls.lines[:, None, 0] + lidar[2] - known.normals[None]))
        alike = (turned < SAME_NORMAL) & (off < OFF) & (along > -BEYOND) & (along < self._lengths + BEYOND)
        nearest = np.where(alike, off, np.inf).argmin(axis=1)
        ids: list[int] = known.ids[nearest[alike.any(axis=1)]].tolist()
        return ids
