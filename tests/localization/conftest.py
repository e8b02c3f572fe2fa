"""Maps made by hand: scans of rooms of line segments, taken at known poses; and walls alone."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.landmarks import trace
from contourslam.maps.saved_map import Contoured, SavedMap
from contourslam.matching.oriented import oriented_points
from contourslam.scan import LaserScan
from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]


def _no_walls() -> WallMap:
    none, ids = np.empty(0), np.empty(0, np.int64)
    return WallMap(ids, np.empty((0, 2, 2)), np.empty((0, 2, 2, 2)), none, np.empty((0, 2, 2)), ids, ids)


def _no_corners() -> CornerMap:
    none, ids = np.empty(0), np.empty(0, np.int64)
    return CornerMap(ids, np.empty((0, 2)), np.empty((0, 2, 2)), none, none, np.empty(0, bool), ids, ids)


@pytest.fixture(scope="session")
def points_of() -> Callable[[LaserScan], Floats]:
    """Contour points of a scan, lidar and base in one."""
    return lambda scan: oriented_points(trace(scan, Config()))


@pytest.fixture(scope="session")
def saved_at(scan_of: Callable[..., LaserScan], points_of: Callable[[LaserScan], Floats]) -> Callable[..., SavedMap]:
    """A map of keyframes seen from poses, without corners or walls."""

    def make(segments: Floats, poses: Floats) -> SavedMap:
        points = [points_of(scan_of(segments, pose, sigma=0.01, seed=k)) for k, pose in enumerate(poses)]
        n = len(poses)
        keyframes = Contoured(
            np.arange(float(n)), np.array(poses), np.tile(1e-4 * np.eye(3), (n, 1, 1)), np.zeros(n),
            np.cumsum([0, *map(len, points)]), np.concatenate([np.empty((0, 4)), *points]).astype(np.float32),
            np.zeros(n, np.int64),
        )  # fmt: skip
        return SavedMap(_no_corners(), _no_walls(), keyframes)

    return make


@pytest.fixture(scope="session")
def walls_alone() -> Callable[[Floats], SavedMap]:
    """A map of walls: segments with free space on their left."""

    def make(segments: Floats) -> SavedMap:
        along, n = segments[:, 1] - segments[:, 0], len(segments)
        small = np.tile(1e-4 * np.eye(2), (n, 1, 1))
        normals = np.arctan2(-along[:, 0], along[:, 1])  # to the right: into the wall
        walls = WallMap(
            np.arange(n), segments, np.repeat(small[:, None], 2, axis=1), normals, small, np.full(n, 5), np.full(n, 0)
        )
        return SavedMap(_no_corners(), walls)

    return make
