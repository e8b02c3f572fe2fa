from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("mujoco", reason="needs the extra 'simulation'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.simulation.config import YDLIDAR_X4, RobotModel, SimulationConfig
from contourslam.simulation.drive import Drive, drive
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import SimulatedRun, simulate

Floats = NDArray[np.float64]


@pytest.fixture(scope="session")
def full_drive() -> Drive:
    """A whole default drive in the furnished room."""
    return drive(ROOMS["furnished_room"], RobotModel(), 0)


@pytest.fixture(scope="session")
def short_run() -> SimulatedRun:
    """Fifteen seconds in the furnished room with the paper's lidar; a bend of the route is in it."""
    return simulate(ROOMS["furnished_room"], SimulationConfig(duration=15.0), 4)


@pytest.fixture(scope="session")
def x4_run() -> SimulatedRun:
    """Twenty seconds in the furnished room with the YDLidar X4."""
    return simulate(ROOMS["furnished_room"], SimulationConfig(duration=20.0, lidar=YDLIDAR_X4), 4)


@pytest.fixture(scope="session")
def cast_ray() -> Callable[[Floats, Floats, Floats, Floats], Floats]:
    """Ranges in the plane from origins (n, 2) along angles (n,) to segments (s, 2, 2) and circles (k, 3)."""

    def cast(origins: Floats, angles: Floats, segments: Floats, circles: Floats) -> Floats:
        ahead = np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, None, :]
        to_first = segments[None, :, 0] - origins[:, None]
        along = (segments[:, 1] - segments[:, 0])[None]
        with np.errstate(divide="ignore", invalid="ignore"):
            across = ahead[..., 0] * along[..., 1] - ahead[..., 1] * along[..., 0]
            distance = (to_first[..., 0] * along[..., 1] - to_first[..., 1] * along[..., 0]) / across
            part = (to_first[..., 0] * ahead[..., 1] - to_first[..., 1] * ahead[..., 0]) / across
        best = np.where((distance > 0) & (part >= 0) & (part <= 1), distance, np.inf).min(axis=1)
        to_centre = circles[None, :, :2] - origins[:, None]
        nearest = np.sum(to_centre * ahead, axis=2)
        with np.errstate(invalid="ignore"):
            half_chord = np.sqrt(circles[None, :, 2] ** 2 - np.sum(to_centre**2, axis=2) + nearest**2)
        hit = np.where(nearest - half_chord > 0, nearest - half_chord, np.inf)
        return np.minimum(best, hit.min(axis=1, initial=np.inf))

    return cast


@pytest.fixture(scope="session")
def clearance() -> Callable[[Floats, Floats, Floats], Floats]:
    """Distance of points (n, 2) to the nearest of segments (s, 2, 2) and circles (k, 3)."""

    def distance(points: Floats, segments: Floats, circles: Floats) -> Floats:
        along = segments[:, 1] - segments[:, 0]
        from_first = points[:, None] - segments[None, :, 0]
        part = np.clip(np.sum(from_first * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
        to_segments = np.hypot(*np.moveaxis(from_first - part[..., None] * along, 2, 0)).min(axis=1)
        to_circles = np.hypot(*np.moveaxis(points[:, None] - circles[None, :, :2], 2, 0)) - circles[:, 2]
        return np.minimum(to_segments, np.abs(to_circles).min(axis=1, initial=np.inf))

    return distance
