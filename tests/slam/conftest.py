"""Observations, maps and covariances made by hand, and dense twins of what the filter does sparsely."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from contourslam.geometry.poses import compose
from contourslam.landmarks import Corners, Walls
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.observation import Observations, observe

Floats = NDArray[np.float64]

NO_WALLS = Walls(np.empty((0, 2, 2)), np.empty((0, 2)), np.empty((0, 2, 2)), np.empty((0, 2, 2, 2)))


def _corners(
    positions: ArrayLike,
    *,
    directions: float | Sequence[float] = 0.0,
    openings: float | Sequence[float] = math.pi / 2,
    convex: bool | Sequence[bool] = True,
    sides: ArrayLike = (1.0, 1.0),
    sigma: float = 0.01,
) -> Corners:
    """Corners in the lidar's frame."""
    rows = np.asarray(positions, dtype=float).reshape(-1, 2)
    k = len(rows)
    return Corners(
        rows,
        np.tile(np.eye(2) * sigma**2, (k, 1, 1)),
        np.broadcast_to(np.asarray(directions, dtype=float), k).copy(),
        np.broadcast_to(np.asarray(openings, dtype=float), k).copy(),
        np.broadcast_to(np.asarray(convex), k).copy(),
        np.broadcast_to(np.asarray(sides, dtype=float), (k, 2)).copy(),
        rows,
    )


def _walls(ends: ArrayLike, *, sigma_angle: float = 0.005, sigma_distance: float = 0.01) -> Walls:
    """Walls in the lidar's frame, each from its first to its last point as a counter-clockwise sweep meets them."""
    points = np.asarray(ends, dtype=float).reshape(-1, 2, 2)
    k = len(points)
    along = points[:, 1] - points[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1)
    lines = np.stack([np.arctan2(normals[:, 1], normals[:, 0]), np.sum(normals * points[:, 0], axis=1)], axis=1)
    covariance = np.diag([sigma_angle**2, sigma_distance**2])
    return Walls(points, lines, np.tile(covariance, (k, 1, 1)), np.tile(np.eye(2) * 1e-4, (k, 2, 1, 1)))


def _see(corners: Corners | None = None, walls: Walls | None = None) -> Observations:
    return observe(_corners([]) if corners is None else corners, NO_WALLS if walls is None else walls)


def _map_of(
    corners: Corners | None = None,
    walls: Walls | None = None,
    *,
    pose: Sequence[float] = (0.0, 0.0, 0.0),
    mount: Sequence[float] = (0.0, 0.0, 0.0),
) -> LandmarkFilter:
    """A filter at `pose` whose landmarks are what the lidar sees from there."""
    filter_ = LandmarkFilter(np.array(pose))
    seen = _see(corners, walls)
    for i in range(len(seen)):
        filter_.add(np.array(mount), seen, i)
    return filter_


def _covariance(size: int, rng: np.random.Generator, sigma: float = 0.1) -> Floats:
    """A random positive definite matrix with strong correlations."""
    root = rng.normal(size=(size, size)) * sigma
    return root @ root.T / size + np.eye(size) * (0.05 * sigma) ** 2


def _full(filter_: LandmarkFilter) -> Floats:
    """Whole covariance of a filter."""
    lower = np.tril(filter_.covariance[: filter_.size, : filter_.size])
    return lower + np.tril(lower, -1).T


@pytest.fixture(scope="session")
def corners_at() -> Callable[..., Corners]:
    return _corners


@pytest.fixture(scope="session")
def walls_at() -> Callable[..., Walls]:
    return _walls


@pytest.fixture(scope="session")
def see() -> Callable[..., Observations]:
    return _see


@pytest.fixture(scope="session")
def map_of() -> Callable[..., LandmarkFilter]:
    return _map_of


@pytest.fixture(scope="session")
def random_covariance() -> Callable[..., Floats]:
    return _covariance


@pytest.fixture(scope="session")
def full() -> Callable[[LandmarkFilter], Floats]:
    return _full


ROOM = [[-3.0, -2.5], [4.0, -2.5], [4.0, 3.0], [1.5, 3.0], [1.5, 2.0], [-3.0, 2.0]]
BOX = [[1.2, -0.4], [1.2, 0.6], [2.4, 0.6], [2.4, -0.4]]
MOUNT = np.array([0.1, 0.0, 0.0])
PERIOD = 0.1


def _drive(
    scans: int = 80,
    *,
    beams: int | Sequence[int] = 360,
    box: Callable[[int], bool] = lambda i: True,
    seed: int = 0,
    sigma: float = 0.005,
    standing_from: int = 10_000,
) -> list[LaserScan | Odometry | TruePose]:
    """A drive round a circle of 0.8 m in a room with an alcove and a box; odometry drifts by some per cent."""
    rng = np.random.default_rng(seed)
    outline = [np.stack([np.array(p), np.roll(p, -1, axis=0)], axis=1) for p in (ROOM, BOX)]
    counts = [beams] if isinstance(beams, int) else list(beams)
    messages: list[LaserScan | Odometry | TruePose] = []
    for i in range(scans):
        stamp = 50.0 + PERIOD * i
        turn = 0.06 * min(i, standing_from)
        true = np.array([0.8 * math.sin(turn), -0.8 * math.cos(turn), math.remainder(turn, 2.0 * math.pi)])
        wheels = np.array([0.83 * math.sin(1.02 * turn), 0.83 * (1.0 - math.cos(1.02 * turn)), 1.02 * turn])
        messages += [Odometry(stamp, np.array([7.0, -3.0, 0.0]) + wheels), TruePose(stamp, true)]
        n = counts[i % len(counts)]
        angles = -math.pi + 2.0 * math.pi / n * np.arange(n)
        lidar = compose(true, MOUNT)
        segments = np.concatenate(outline if box(i) else outline[:1])
        ranges = _cast(segments, lidar[:2], angles + lidar[2]) + sigma * rng.standard_normal(n)
        messages.append(LaserScan(stamp, angles, ranges, np.zeros(n), 0.05, 30.0))
    return messages


def _cast(segments: Floats, origin: Floats, directions: Floats) -> Floats:
    dx, dy = np.cos(directions)[:, None], np.sin(directions)[:, None]
    (ax, ay), (ex, ey) = (segments[:, 0] - origin).T, (segments[:, 1] - segments[:, 0]).T
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (ax * ey - ay * ex) / (dx * ey - dy * ex)
        share = (ax * dy - ay * dx) / (dx * ey - dy * ex)
    return np.where((share >= 0.0) & (share <= 1.0) & (along > 0.0), along, np.inf).min(axis=1)


@pytest.fixture(scope="session")
def drive() -> Callable[..., list[LaserScan | Odometry | TruePose]]:
    return _drive


@pytest.fixture(scope="session")
def mount() -> Floats:
    return MOUNT
