"""One drive through the furnished room in MuJoCo, replayed through every detector."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("mujoco", reason="needs the extra 'simulation'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.config import Config, SlamConfig
from contourslam.detectors import DETECTORS
from contourslam.geometry.angles import wrap
from contourslam.replay import replay
from contourslam.simulation.config import YDLIDAR_X4, SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import SimulatedRun, simulate
from contourslam.slam import RunResult

Floats = NDArray[np.float64]

CORNERS, WALLS = Config(), Config(slam=SlamConfig(walls=True))


@pytest.fixture(scope="module")
def furnished_room() -> SimulatedRun:
    return simulate(ROOMS["furnished_room"], SimulationConfig(duration=30.0), 2)


def rmse(result: RunResult, poses: Floats) -> Floats:
    assert result.truth is not None
    errors = poses - result.truth
    errors[:, 2] = wrap(errors[:, 2])
    return np.sqrt(np.mean(errors**2, axis=0))


def check_result(result: RunResult, run: SimulatedRun) -> None:
    """What every run must keep, whatever its accuracy."""
    assert result.complete
    assert result.skipped == {}
    assert len(run.scans) - 1 <= len(result.stamps) <= len(run.scans)  # the last one may lack its odometry
    assert np.isfinite(result.poses).all()
    assert min(np.linalg.eigvalsh(covariance).min() for covariance in result.covariances) > 0.0


@pytest.mark.parametrize("detector", DETECTORS)
def test_every_detector_beats_raw_odometry_clearly(furnished_room: SimulatedRun, detector: str) -> None:
    mount = furnished_room.lidar_mount
    result = replay(furnished_room.messages(), replace(CORNERS, detector=detector), lidar_mount=mount)
    check_result(result, furnished_room)
    mapped, raw = rmse(result, result.poses), rmse(result, result.odometry)
    assert np.hypot(*mapped[:2]) < 0.4 * np.hypot(*raw[:2]), (mapped, raw)
    assert np.hypot(*mapped[:2]) < 0.04
    assert mapped[2] < 0.01
    assert len(result.corner_map.ids) >= 10


@pytest.mark.parametrize("detector", DETECTORS)
def test_walls_make_it_better_still(furnished_room: SimulatedRun, detector: str) -> None:
    mount = furnished_room.lidar_mount
    result = replay(furnished_room.messages(), replace(WALLS, detector=detector), lidar_mount=mount)
    check_result(result, furnished_room)
    mapped = rmse(result, result.poses)
    assert np.hypot(*mapped[:2]) < 0.01
    assert mapped[2] < 0.004
    assert len(result.wall_map.ids) >= 10


def test_the_corners_of_the_map_stand_where_the_room_has_corners(furnished_room: SimulatedRun) -> None:
    result = replay(furnished_room.messages(), WALLS, lidar_mount=furnished_room.lidar_mount)
    corners = result.corner_map
    often = corners.observed > 30
    true = furnished_room.room.corners(furnished_room.lidar.mount_height)
    apart = np.linalg.norm(corners.positions[often][:, None] - true.positions, axis=2)
    nearest = apart.argmin(axis=1)
    assert often.sum() >= 8
    assert (apart.min(axis=1) < 0.05).mean() > 0.9
    assert (corners.convex[often] == true.convex[nearest]).mean() > 0.9
    assert (np.cos(corners.directions[often] - true.directions[nearest]) > 0.98).mean() > 0.9
    # What should have been seen mostly was.
    assert corners.failed.sum() < 0.15 * (corners.failed.sum() + corners.observed.sum())


@pytest.mark.parametrize("config", [CORNERS, WALLS], ids=["corners", "walls"])
def test_a_run_replayed_twice_is_the_same_run(furnished_room: SimulatedRun, config: Config) -> None:
    first, second = (
        replay(furnished_room.messages(), config, lidar_mount=furnished_room.lidar_mount) for _ in range(2)
    )
    np.testing.assert_array_equal(first.poses, second.poses)
    np.testing.assert_array_equal(first.covariances, second.covariances)


def test_a_cheap_lidar_with_varying_beams_maps_the_room_too() -> None:
    run = simulate(ROOMS["furnished_room"], SimulationConfig(duration=20.0, lidar=YDLIDAR_X4), 3)
    assert len({scan.ranges.size for scan in run.scans}) > 3
    result = replay(run.messages(), WALLS, lidar_mount=run.lidar_mount)
    check_result(result, run)
    mapped = rmse(result, result.poses)
    assert np.hypot(*mapped[:2]) < 0.02
    assert mapped[2] < 0.01
