"""Does the filter know how wrong it is? Monte Carlo with perfect models: its stated covariance must fit its errors."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, MotionConfig, SlamConfig
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose
from contourslam.landmarks import Corners, Walls
from contourslam.scan import LaserScan, Odometry
from contourslam.slam import ContourSlam
from contourslam.slam import slam as module
from contourslam.slam.motion import motion_noise

Floats = NDArray[np.float64]

MOUNT = np.array([0.1, 0.02, 0.1])
NO_WALLS = Walls(np.empty((0, 2, 2)), np.empty((0, 2)), np.empty((0, 2, 2)), np.empty((0, 2, 2, 2)))
# A room of 8 m by 6 m with eight corners in it, far enough apart that none can be taken for another.
LANDMARKS = np.array([[-4, -3], [4, -3], [4, 3], [-4, 3], [0.0, -3], [0.3, 3], [-4, 0.2], [4, -0.4]], dtype=float)
FACING = np.linspace(-3.0, 3.0, 8)


@dataclass(frozen=True)
class World:
    """How well the wheels and the lidar do; the filter is told the truth about both."""

    motion: MotionConfig
    sigma_range: float
    sigma_bearing: float
    reach: float
    loops: int

    def drive(self, rng: np.random.Generator) -> Iterator[tuple[Floats, Floats, Corners]]:
        """True pose, odometry pose and corners seen, step by step, round a circle of 2 m."""
        steps = 60 * self.loops
        step = np.array([2.0 * 2.0 * math.pi / 60, 0.0, 2.0 * math.pi / 60])
        true, wheels = np.array([2.0, 0.0, math.pi / 2]), np.zeros(3)
        for _ in range(steps):
            yield true, wheels, self.look(true, rng)
            # The wheels say `step`; what really happened differs by the noise that the filter allows for.
            sigma = np.sqrt(np.diag(motion_noise(step, self.motion)))
            wheels = compose(wheels, step)
            true = compose(true, step + rng.normal(size=3) * sigma)

    def look(self, true: Floats, rng: np.random.Generator) -> Corners:
        lidar = compose(true, MOUNT)
        local = between(lidar, np.column_stack([LANDMARKS, FACING]))
        near = np.hypot(local[:, 0], local[:, 1]) < self.reach
        local = local[near]
        r = np.hypot(local[:, 0], local[:, 1]) + rng.normal(size=len(local)) * self.sigma_range
        bearing = np.arctan2(local[:, 1], local[:, 0]) + rng.normal(size=len(local)) * self.sigma_bearing
        cos, sin = np.cos(bearing), np.sin(bearing)
        turn = np.stack([np.stack([cos, -r * sin], axis=1), np.stack([sin, r * cos], axis=1)], axis=1)
        noise = np.diag([self.sigma_range**2, self.sigma_bearing**2])
        return Corners(
            np.stack([r * cos, r * sin], axis=1), turn @ noise @ turn.transpose(0, 2, 1), local[:, 2],
            np.full(len(r), math.pi / 2), np.ones(len(r), dtype=bool), np.ones((len(r), 2)), np.zeros((len(r), 2)),
        )  # fmt: skip


@pytest.fixture
def seen(monkeypatch: pytest.MonkeyPatch) -> dict[str, Corners]:
    """The filter takes these corners for what its detector found in the scan."""
    box: dict[str, Corners] = {}
    monkeypatch.setattr(
        module, "find_landmarks", lambda *_, **__: SimpleNamespace(corners=box["corners"], walls=NO_WALLS)
    )
    return box


def run(
    world: World, config: SlamConfig, seed: int, seen: dict[str, Corners], start: Floats | None = None
) -> tuple[Floats, Floats, Floats]:
    """Errors (t, 3), covariances (t, 3, 3), and NIS with its degrees of freedom (t, 2).

    `start` is the standard deviation of the pose where the robot starts; it is known exactly by default.
    """
    slam: ContourSlam | None = None
    rng = np.random.default_rng(seed)
    errors, covariances, nis = [], [], []
    config = replace(config, motion=world.motion, sightings_to_birth=1, max_false_negative_rate=1.0)
    for k, (true, wheels, corners) in enumerate(world.drive(rng)):
        if slam is None:
            doubt = np.full(3, 1e-5) if start is None else start
            slam = ContourSlam(Config(slam=config), initial_pose=true + rng.normal(size=3) * doubt, lidar_mount=MOUNT)
            slam.filter.covariance[:3, :3] = np.diag(doubt**2)
        slam.push_odometry(Odometry(0.1 * k, wheels))
        seen["corners"] = corners
        update = slam.push_scan(LaserScan(0.1 * k, np.empty(0), np.empty(0), np.empty(0), 0.05, 30.0))
        error = update.pose - true
        error[2] = wrap(error[2])
        errors.append(error)
        covariances.append(update.covariance)
        nis.append((update.nis, update.nis_dof))
    return np.array(errors), np.array(covariances), np.array(nis)


def nees(errors: Floats, covariances: Floats) -> Floats:
    return np.einsum("ti,ti->t", errors, np.linalg.solve(covariances, errors[..., None])[..., 0])


def average_nees(runs: list[tuple[Floats, Floats, Floats]]) -> Floats:
    """NEES of each step averaged over the runs, the first five left out, where little is in doubt."""
    each = [np.einsum("ti,ti->t", e, np.linalg.solve(P, e[..., None])[..., 0])[5:] for e, P, _ in runs]
    return np.mean(each, axis=0)


GOOD = World(MotionConfig(0.01, 0.5, 1.0, 0.003), 0.01, 0.005, reach=5.0, loops=2)
POOR = World(MotionConfig(0.05, 3.0, 4.0, 0.02), 0.05, 0.02, reach=5.0, loops=3)
# In the poor world each corner must find its own landmark, or twins would be born and merged.
KNOWN = SlamConfig(association="nearest", nearest_threshold=1.5)
RUNS = 30


@pytest.mark.parametrize("association", ["nearest", "mahalanobis", "mutual", "joint"])
@pytest.mark.parametrize("start", [None, np.array([0.02, 0.02, 0.01])], ids=["known", "doubted"])
def test_the_normalised_error_of_the_pose_is_that_of_a_consistent_filter(
    seen: dict[str, Corners], association: str, start: Floats | None
) -> None:
    stats = pytest.importorskip("scipy.stats", reason="needs the extra 'report'")
    runs = [run(GOOD, SlamConfig(association=association), seed, seen, start) for seed in range(RUNS)]
    average = average_nees(runs)
    low, high = stats.chi2.ppf([0.005, 0.995], 3 * RUNS) / RUNS
    assert low < average.mean() < high, average.mean()
    assert np.mean((average > low) & (average < high)) > 0.9
    # Each correction is as large as the filter expected; where there are gates they cut off the largest.
    nis, dof = np.sum([rows.sum(axis=0) for *_, rows in runs], axis=0)
    assert nis / dof == pytest.approx(1.0 if association == "nearest" else 0.955, abs=0.02)
    inside = np.mean([np.abs(e) < 2.0 * np.sqrt(np.diagonal(P, axis1=1, axis2=2)) for e, P, _ in runs], axis=(0, 1))
    assert (np.abs(inside - 0.954) < (0.05 if start is None else 0.1)).all(), (
        inside
    )  # one start a run rules the heading


def test_first_estimates_gain_no_information_about_the_heading(seen: dict[str, Corners]) -> None:
    # Ranges and bearings say nothing about where north is: the doubt of the start must never shrink. With Jacobians at
    # changing estimates it does (Huang, Mourikis and Roumeliotis 2010).
    start = np.array([1e-5, 1e-5, 0.1])
    for seed in range(4):
        least = {}
        for first_estimates in (True, False):
            _, covariances, _ = run(POOR, replace(KNOWN, first_estimates=first_estimates), seed, seen, start)
            least[first_estimates] = math.sqrt(covariances[:, 2, 2].min()) / start[2]
        assert least[True] > 0.999
        assert least[False] < 0.6


def test_first_estimates_give_a_lower_normalised_error_than_the_latest_ones(seen: dict[str, Corners]) -> None:
    start = np.array([0.1, 0.1, 0.1])
    average = {}
    for first_estimates in (True, False):
        config = replace(KNOWN, first_estimates=first_estimates)
        average[first_estimates] = average_nees([run(POOR, config, seed, seen, start) for seed in range(10)]).mean()
    assert average[True] < 5.0
    assert average[False] > 1.5 * average[True], average
