"""A lidar amid straight walls, seen by the very stages that the matching gets its points from."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.landmarks import trace
from contourslam.matching.oriented import oriented_points
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
See = Callable[..., Floats]


def _ranges(walls: Floats, pose: Floats, angles: Floats) -> Floats:
    """Distance to the first wall along each beam, inf where there is none."""
    directions = np.stack([np.cos(pose[2] + angles), np.sin(pose[2] + angles)], axis=1)[:, None]
    along, start = walls[:, 2:] - walls[:, :2], walls[:, :2] - pose[:2]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        across = directions[..., 0] * along[:, 1] - directions[..., 1] * along[:, 0]
        r = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
        part = (start[:, 0] * directions[..., 1] - start[:, 1] * directions[..., 0]) / across
    r[~((r > 0.0) & (part >= 0.0) & (part <= 1.0))] = np.inf
    return np.asarray(r.min(axis=1))


def _see(walls: Floats, pose: Floats, chance: np.random.Generator, *, sigma: float = 0.01, beams: int = 360) -> Floats:
    angles = np.linspace(-np.pi, np.pi, beams, endpoint=False)
    ranges = _ranges(walls, np.asarray(pose, float), angles) + sigma * chance.standard_normal(beams)
    ranges[~(ranges < 30.0)] = np.inf
    return oriented_points(trace(LaserScan(0.0, angles, ranges, np.zeros(beams), 0.05, 30.0), Config()))


@pytest.fixture(scope="session")
def see() -> See:
    """Points and normals that a lidar at a pose sees of walls (rows of two ends), in its frame."""
    return _see


@pytest.fixture(scope="session")
def room() -> Floats:
    """Walls of an L-shaped room with a pillar, as rows of two ends; the origin lies inside."""
    corners = np.array([[-3.0, -2.0], [5.0, -2.0], [5.0, 1.0], [1.5, 1.0], [1.5, 4.0], [-3.0, 4.0]])
    pillar = np.array([[-1.6, 1.5], [-1.2, 1.5], [-1.2, 1.9], [-1.6, 1.9]])
    return np.vstack([np.hstack([p, np.roll(p, -1, axis=0)]) for p in (corners, pillar)])


@pytest.fixture(scope="session")
def corridor() -> Floats:
    """Two long parallel walls 2 m apart, along x."""
    return np.array([[-60.0, -1.0, 60.0, -1.0], [60.0, 1.0, -60.0, 1.0]])
