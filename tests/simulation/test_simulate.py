from dataclasses import replace

import numpy as np
import pytest

from contourslam.errors import ConfigError
from contourslam.geometry.poses import compose, interpolate
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.config import YDLIDAR_X4, SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import SimulatedRun, simulate

ROOM = ROOMS["furnished_room"]


def as_bytes(run: SimulatedRun) -> list[bytes]:
    return [
        np.append(m.stamp, [m.ranges, m.angles] if isinstance(m, LaserScan) else m.pose).tobytes()
        for m in run.messages()
    ]


@pytest.mark.parametrize("config", [SimulationConfig(duration=2.0), SimulationConfig(duration=2.0, lidar=YDLIDAR_X4)])
def test_the_same_seed_gives_bit_equal_messages_and_another_seed_others(config: SimulationConfig) -> None:
    first, again, other = (as_bytes(simulate(ROOM, config, seed)) for seed in (7, 7, 8))
    assert first == again
    assert len(first) > 200
    assert first != other


def test_the_lidar_does_not_change_the_driving(short_run: SimulatedRun, x4_run: SimulatedRun) -> None:
    common = len(short_run.drive.times)
    np.testing.assert_array_equal(short_run.drive.poses, x4_run.drive.poses[:common])


@pytest.mark.parametrize("fixture", ["short_run", "x4_run"])
def test_a_scan_comes_right_after_the_odometry_that_covers_its_last_beam(
    fixture: str, request: pytest.FixtureRequest
) -> None:
    run: SimulatedRun = request.getfixturevalue(fixture)
    odometry_stamp, true_stamp, scans = -1.0, -1.0, 0
    for message in run.messages():
        if isinstance(message, LaserScan):
            last_beam = message.stamp + message.offsets[-1]
            assert last_beam <= odometry_stamp + 1e-9 < last_beam + 0.0201
            assert true_stamp >= odometry_stamp
            scans += 1
        elif isinstance(message, Odometry):
            assert message.stamp > odometry_stamp
            odometry_stamp = message.stamp
        else:
            assert message.stamp > true_stamp
            true_stamp = message.stamp
    assert scans == len(run.scans)


@pytest.mark.parametrize("fixture", ["short_run", "x4_run"])
def test_the_truth_is_published_with_the_odometry_and_at_each_scan(
    fixture: str, request: pytest.FixtureRequest
) -> None:
    run: SimulatedRun = request.getfixturevalue(fixture)
    messages = list(run.messages())
    true = [m for m in messages if isinstance(m, TruePose)]
    stamps = {m.stamp for m in true}
    assert {m.stamp for m in messages if not isinstance(m, TruePose)} <= stamps
    # in between, interpolating the messages is good to a tenth of a millimetre
    at = np.array(run.drive.times[7::13])
    carried = interpolate(np.array([m.stamp for m in true]), np.array([m.pose for m in true]), at)
    assert np.abs(carried[:, :2] - run.truth(at)[:, :2]).max() < 1e-4


def test_odometry_put_at_the_initial_pose_starts_out_on_the_truth(short_run: SimulatedRun) -> None:
    stamps = short_run.odometry.stamps[:26]
    world = compose(short_run.initial_pose, short_run.odometry.poses[:26])
    assert np.abs(world - short_run.truth(stamps)).max() < 0.01


def test_measuring_again_changes_the_ranges_and_nothing_else(short_run: SimulatedRun) -> None:
    again = short_run.with_noise(0.05, 3)
    assert again.drive is short_run.drive and again.odometry is short_run.odometry
    assert again.lidar == replace(short_run.lidar, sigma_range=0.05)
    errors = np.concatenate([m.ranges - i.ranges for m, i in zip(again.scans, again.ideal_scans, strict=True)])
    assert errors.std() == pytest.approx(0.05, rel=0.02)
    exact = short_run.with_noise(0.0)
    for measured, ideal in zip(exact.scans, exact.ideal_scans, strict=True):
        np.testing.assert_array_equal(measured.ranges, ideal.ranges)


def test_the_noise_in_the_configuration_replaces_the_lidar_own() -> None:
    run = simulate(ROOM, SimulationConfig(duration=1.0, noise=0.03, lidar=YDLIDAR_X4), 2)
    assert (run.lidar.sigma_range, run.lidar.sigma_relative) == (0.03, 0.0)
    same = simulate(ROOM, SimulationConfig(duration=1.0, lidar=YDLIDAR_X4), 2).with_noise(0.03)
    assert as_bytes(run) == as_bytes(same)


def test_the_lidar_sits_ahead_of_the_axle(short_run: SimulatedRun) -> None:
    np.testing.assert_array_equal(short_run.lidar_mount, [0.1, 0.0, 0.0])


@pytest.mark.parametrize("name", ROOMS)
def test_every_room_can_be_simulated(name: str) -> None:
    done: list[float] = []
    run = simulate(ROOMS[name], SimulationConfig(duration=1.0), 0, progress=done.append)
    assert len(run.scans) == 10
    assert all(np.isfinite(scan.ranges).mean() > 0.95 for scan in run.scans)
    assert done == sorted(done) and done[-1] > 0.85


@pytest.mark.parametrize("wrong", [{"duration": 0.0}, {"speed": 0.0}, {"speed": 9.0}, {"noise": -0.01}])
def test_a_configuration_that_cannot_be_is_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigError, match=f"SimulationConfig.{next(iter(wrong))}"):
        SimulationConfig(**wrong)
