"""Two walls that meet, seen by a lidar at a known place."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
Scans = Callable[..., LaserScan]


@pytest.fixture(scope="session")
def corner_scan(scan_of: Scans) -> Callable[..., tuple[LaserScan, Floats, float]]:
    """Scan of one corner, with its true position and its true direction in the lidar's frame."""

    def make(
        *,
        opening_deg: float,
        distance: float,
        aspect: float = 0.0,
        convex: bool = False,
        yaw: float = 0.3,
        side: float = 1.5,
        sigma: float = 0.0,
        beams: int = 500,
        seed: int | np.random.Generator = 0,
    ) -> tuple[LaserScan, Floats, float]:
        """The corner is at the origin and opens towards +x; `aspect` is the lidar's place in half openings."""
        half = 0.5 * math.radians(opening_deg)
        ends = side * np.array([[math.cos(half), math.sin(half)], [math.cos(half), -math.sin(half)]])
        segments = np.stack([np.zeros((2, 2)), ends], axis=1)
        at = aspect * half + (math.pi if convex else 0.0)
        lidar = distance * np.array([math.cos(at), math.sin(at)])
        scan = scan_of(segments, (*lidar, yaw), sigma=sigma, beams=beams, seed=seed)
        turn = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
        return scan, turn @ -lidar, -yaw

    return make
