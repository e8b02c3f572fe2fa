"""Runs and rooms made up for the tests, with known answers."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from contourslam.evaluation.ground_truth import GroundTruth
from contourslam.geometry.poses import compose
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import RunResult


def _corner_map(observed: list[int], failed: list[int]) -> CornerMap:
    n = len(observed)
    return CornerMap(
        ids=np.arange(n, dtype=np.int64),
        positions=np.zeros((n, 2)),
        covariances=np.tile(np.eye(2) * 1e-4, (n, 1, 1)),
        directions=np.zeros(n),
        openings=np.full(n, np.pi / 2),
        convex=np.zeros(n, dtype=bool),
        observed=np.array(observed, dtype=np.int64),
        failed=np.array(failed, dtype=np.int64),
    )


def _wall_map(observed: list[int], failed: list[int]) -> WallMap:
    n = len(observed)
    return WallMap(
        ids=np.arange(n, dtype=np.int64),
        end_points=np.zeros((n, 2, 2)),
        end_point_covariances=np.zeros((n, 2, 2, 2)),
        normals=np.zeros(n),
        line_covariances=np.zeros((n, 2, 2)),
        observed=np.array(observed, dtype=np.int64),
        failed=np.array(failed, dtype=np.int64),
    )


def _circle_drive(steps: int = 400, radius: float = 2.0) -> np.ndarray:
    angle = np.linspace(0.0, 3 * np.pi, steps)
    heading = -((-(angle + np.pi / 2) + np.pi) % (2 * np.pi) - np.pi)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), heading])


@pytest.fixture
def corner_map() -> Callable[..., CornerMap]:
    """A map of landmarks with the given o and f."""
    return _corner_map


@pytest.fixture
def wall_map() -> Callable[..., WallMap]:
    return _wall_map


@pytest.fixture
def circle_drive() -> Callable[..., np.ndarray]:
    """One and a half rounds on a circle: the heading passes the cut at pi."""
    return _circle_drive


@pytest.fixture
def make_run() -> Callable[..., RunResult]:
    """A run whose errors are Gaussian with exactly the stated covariance."""

    def make(seed: int = 0, scale: float = 1.0, steps: int = 400, **changes: Any) -> RunResult:
        rng = np.random.default_rng(seed)
        truth = _circle_drive(steps)
        factor = np.array([[0.01, 0.0, 0.0], [0.004, 0.02, 0.0], [0.001, 0.002, 0.003]])
        error = scale * rng.standard_normal((steps, 3)) @ factor.T
        poses = truth + error
        poses[:, 2] = -((-poses[:, 2] + np.pi) % (2 * np.pi) - np.pi)
        dof = rng.integers(0, 5, steps) * 2
        nis = np.where(dof > 0, rng.chisquare(np.maximum(dof, 1)), 0.0)
        result = RunResult(
            detector="matched_filter",
            stamps=0.1 * np.arange(steps),
            poses=poses,
            covariances=np.tile(factor @ factor.T, (steps, 1, 1)),
            odometry=compose(np.array([0.1, 0.0, 0.05]), truth),
            truth=truth,
            nis=nis,
            nis_dof=dof.astype(np.int64),
            matched_count=(dof // 2).astype(np.int64),
            corner_count=np.full(steps, 5, dtype=np.int64),
            wall_count=np.full(steps, 3, dtype=np.int64),
            corner_map=_corner_map([8, 5, 10], [2, 5, 0]),
            wall_map=_wall_map([], []),
            seconds={"contour": 0.1, "detection": 0.3},
            skipped={"no odometry": 2},
        )
        return replace(result, **changes)

    return make


@pytest.fixture
def square_room() -> GroundTruth:
    """A room of 6 m by 4 m around the origin with a box of 1 m (x from 1 to 2, y from -1 to 0) in it."""
    room = np.array([[-3.0, -2.0], [3.0, -2.0], [3.0, 2.0], [-3.0, 2.0]])
    box = np.array([[1.0, -1.0], [2.0, -1.0], [2.0, 0.0], [1.0, 0.0]])
    segments = np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in (room, box)])
    inward = np.radians([45.0, 135.0, -135.0, -45.0])
    return GroundTruth(
        segments=segments,
        circles=np.empty((0, 3)),
        positions=np.concatenate([room, box]),
        directions=np.concatenate([inward, inward]),
        openings=np.full(8, np.pi / 2),
        convex=np.array([False] * 4 + [True] * 4),
    )
