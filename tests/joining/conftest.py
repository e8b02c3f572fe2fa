"""Maps made by hand: scans along a way through rooms of line segments, laid in a frame of their own."""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.geometry.poses import between, compose
from contourslam.landmarks import trace
from contourslam.maps.saved_map import Contoured, SavedMap
from contourslam.matching.oriented import oriented_points
from contourslam.scan import LaserScan
from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]
STEP = 0.4  # m between two keyframes


def _no_landmarks() -> tuple[CornerMap, WallMap]:
    none, ids = np.empty(0), np.empty(0, np.int64)
    return (
        CornerMap(ids, np.empty((0, 2)), np.empty((0, 2, 2)), none, none, np.empty(0, bool), ids, ids),
        WallMap(ids, np.empty((0, 2, 2)), np.empty((0, 2, 2, 2)), none, np.empty((0, 2, 2)), ids, ids),
    )


def _poses_along(way: tuple[tuple[float, float], ...]) -> Floats:
    rows = []
    for a, b in pairwise(way):
        count = max(round(math.dist(a, b) / STEP), 1)
        heading = math.atan2(b[1] - a[1], b[0] - a[0])
        rows += [(*(np.array(a) + k / count * np.subtract(b, a)), heading) for k in range(count)]
    return np.array(rows)


@pytest.fixture(scope="session")
def walked(scan_of: Callable[..., LaserScan]) -> Callable[..., SavedMap]:
    """A map of a way through a room, whose frame lies at `frame` in the room; without corners or walls."""

    def make(
        segments: Floats,
        way: tuple[tuple[float, float], ...],
        *,
        frame: tuple[float, float, float] = (0.0, 0.0, 0.0),
        seed: int = 0,
    ) -> SavedMap:
        poses, chance = _poses_along(way), np.random.default_rng(seed)
        contours = [
            oriented_points(trace(scan_of(segments, pose, beams=240, sigma=0.01, seed=chance), Config()))
            for pose in poses
        ]
        n = len(poses)
        frames = Contoured(
            np.arange(float(n)), between(np.array(frame), poses), np.tile(1e-4 * np.eye(3), (n, 1, 1)), np.zeros(n),
            np.cumsum([0, *map(len, contours)]), np.concatenate(contours).astype(np.float32), np.zeros(n, np.int64),
        )  # fmt: skip
        return SavedMap(*_no_landmarks(), frames)

    return make


@pytest.fixture(scope="session")
def moved() -> Callable[..., SavedMap]:
    """The same map in a frame that lies at `frame` in the old one."""

    def make(saved: SavedMap, frame: tuple[float, float, float]) -> SavedMap:
        from dataclasses import replace

        assert saved.keyframes is not None
        poses = between(np.array(frame), saved.keyframes.poses)
        assert np.allclose(compose(np.array(frame), poses)[:, :2], saved.keyframes.poses[:, :2])
        return replace(saved, keyframes=replace(saved.keyframes, poses=poses))

    return make
