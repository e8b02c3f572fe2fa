"""Wheels that are believed wrongly are found out from a drive, and what the drive cannot tell is said."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from contourslam.config import Config, SlamConfig
from contourslam.errors import ConfigError
from contourslam.geometry.poses import compose
from contourslam.recordings import WheelReading, open_recording, write_recording
from contourslam.replay import replay
from contourslam.robot.base.calibration import BaseCalibration, calibrate
from contourslam.robot.base.odometry import arc
from contourslam.robot.base.wheel_track import WheelTrack, read_track, track_from_odometry
from contourslam.robot.config import BaseConfig
from contourslam.scan import LaserScan, TruePose
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.odometry import effective_wheels, read_odometry
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import simulate

STEP, EVERY = 0.02, 7  # s; a scan comes with every 7th reading of the wheels
TRUE = BaseConfig(left_radius=0.0502, right_radius=0.0497, wheel_base=0.255)
BELIEVED = BaseConfig()  # 0.4 to 2 % off
SIGMA = np.array([0.003, 0.003, math.radians(0.1)])  # of SLAM

Floats = np.ndarray


def a_drive(seconds: float, seed: int = 0, swing: float = 0.8, bend: float = 0.0) -> tuple[Floats, Floats, WheelTrack]:
    """Stamps and noisy poses as of SLAM, and the wheels."""
    rng = np.random.default_rng(seed)
    time = STEP * np.arange(round(seconds / STEP))
    v = 0.3 + 0.1 * np.sin(2 * math.pi * time / 5.0)
    omega = swing * np.sin(2 * math.pi * time / 13.0) + bend
    half = 0.5 * omega * TRUE.wheel_base
    rates = np.stack([(v - half) / TRUE.left_radius, (v + half) / TRUE.right_radius], axis=1)
    angles = np.concatenate([np.zeros((1, 2)), np.cumsum(rates * STEP, axis=0)])
    poses = [np.zeros(3)]
    for k in range(len(time)):
        poses.append(arc(poses[-1], v[k] * STEP, 0.0, omega[k] * STEP))
    stamps = 100.0 + STEP * np.arange(len(angles))
    seen = np.array(poses)[::EVERY] + SIGMA * rng.normal(size=(len(poses[::EVERY]), 3))
    return stamps[::EVERY], seen, WheelTrack(stamps, angles, "test")


def errors(found: BaseCalibration, true: tuple[float, float, float]) -> Floats:
    base = found.base
    return np.array([base.left_radius, base.right_radius, base.wheel_base]) / true - 1.0


OF_TRUE = (TRUE.left_radius, TRUE.right_radius, TRUE.wheel_base)


def test_wheels_two_percent_off_are_found_to_a_fifth_of_a_percent_and_the_doubt_is_honest() -> None:
    scores = []
    for seed in range(8):
        found = calibrate(*a_drive(180.0, seed), BELIEVED)
        off = errors(found, OF_TRUE)
        assert np.abs(off).max() < 0.002 and found.warnings == ()
        scores.append(off / found.sigmas)
        assert found.after.way < 0.01 and found.before.turn > 3.0 * found.after.turn
    assert 0.5 < np.sqrt(np.mean(np.square(scores))) < 1.6


def test_what_is_not_of_the_wheels_is_kept() -> None:
    believed = replace(BELIEVED, ticks_per_turn=960, left_sign=-1, port="/dev/ttyACM3")
    found = calibrate(*a_drive(60.0), believed).base
    assert replace(found, left_radius=0.05, right_radius=0.05, wheel_base=0.26) == believed


def test_stamps_that_are_late_are_found_and_do_not_spoil_the_rest() -> None:
    stamps, poses, track = a_drive(180.0)
    found = calibrate(stamps, poses, WheelTrack(track.stamps + 0.06, track.angles, "late"), BELIEVED)
    assert found.lag == pytest.approx(0.06, abs=0.01)
    assert np.abs(errors(found, OF_TRUE)).max() < 0.002


def test_a_lidar_that_sits_elsewhere_is_told_and_does_not_spoil_the_rest() -> None:
    stamps, poses, track = a_drive(180.0)
    said, shift = (0.1, 0.0, 0.0), np.array([0.02, -0.01, math.radians(1.5)])
    lidar = compose(poses, np.array(said) + shift)
    seen = compose(lidar, np.array([-0.1, 0.0, 0.0]))  # what SLAM takes for the base
    found = calibrate(stamps, seen, track, BELIEVED, said)
    np.testing.assert_allclose(found.lidar_shift[:2], shift[:2], atol=0.005)
    assert found.lidar_shift[2] == pytest.approx(shift[2], abs=math.radians(0.2))
    assert np.abs(errors(found, OF_TRUE)).max() < 0.002


def test_pieces_that_are_wrong_do_not_count() -> None:
    stamps, poses, track = a_drive(180.0)
    lost = np.random.default_rng(3).random(len(poses)) < 0.04
    poses[lost] += [0.5, -0.3, 0.4]
    assert np.abs(errors(calibrate(stamps, poses, track, BELIEVED), OF_TRUE)).max() < 0.002


@pytest.mark.parametrize(("swing", "bend"), [(0.0, 0.0), (0.0, 0.4)])
def test_a_drive_that_tells_too_little_is_warned_of(swing: float, bend: float) -> None:
    found = calibrate(*a_drive(120.0, swing=swing, bend=bend), BELIEVED)
    assert any("only; drive curves to both sides" in text for text in found.warnings)
    assert any("wheel base is known to" in text for text in found.warnings)


def test_a_short_drive_is_refused() -> None:
    with pytest.raises(ConfigError, match="drive longer"):
        calibrate(*a_drive(15.0), BELIEVED)


def test_wheels_mixed_up_are_told() -> None:
    stamps, poses, track = a_drive(120.0)
    with pytest.raises(ConfigError, match="mixed up"):
        calibrate(stamps, poses, WheelTrack(track.stamps, -track.angles, "backwards"), BELIEVED)


def test_odometry_is_undone_to_the_angles_it_was_made_of() -> None:
    _, _, track = a_drive(30.0)
    angles = track.angles * [1.0, -0.6]  # also on the spot and backwards
    poses = [np.zeros(3)]
    for left, right in np.diff(angles, axis=0) * [BELIEVED.left_radius, BELIEVED.right_radius]:
        poses.append(arc(poses[-1], (left + right) / 2, 0.0, (right - left) / BELIEVED.wheel_base))
    undone = track_from_odometry(track.stamps, np.array(poses), BELIEVED)
    np.testing.assert_allclose(undone.angles, angles, atol=1e-8)


def test_odometry_that_jumped_is_no_turn_of_the_wheels() -> None:
    poses = np.array([[0.1 * k, 0.0, 0.0] for k in range(5)] + [[0.1 * k - 0.4, 5.0, 2.0] for k in range(5)])
    angles = track_from_odometry(np.arange(10.0), poses, BELIEVED).angles
    assert np.abs(np.diff(angles, axis=0)).max() < 2.5


def test_wheels_that_were_counted_anew_did_not_turn_back(tmp_path: Path) -> None:
    angles = 20.0 + np.arange(10.0)
    angles[6:] -= 26.0  # the driver was started again
    readings = [WheelReading(100.0 + 0.1 * k, (angle, angle), (0.0, 0.0)) for k, angle in enumerate(angles.tolist())]
    scan = LaserScan(102.0, np.linspace(-3.0, 3.0, 30), np.full(30, 2.0), np.zeros(30), 0.1, 10.0)
    write_recording(tmp_path / "run", [*readings, scan])
    track = read_track(open_recording(tmp_path / "run"), BELIEVED)
    np.testing.assert_allclose(track.angles[:, 0], [20, 21, 22, 23, 24, 25, 25, 26, 27, 28])


def test_from_slams_own_trajectory_in_simulation_a_two_percent_error_is_found() -> None:
    config = SimulationConfig(duration=60.0)
    run = simulate(ROOMS["furnished_room"], config, 5)
    run = replace(run, odometry=read_odometry(run.drive, config.robot, 5, errors=(0.02, -0.02)))
    believed = BaseConfig(left_radius=0.05 * 1.02, right_radius=0.05 * 1.02, wheel_base=0.26 * 0.98)
    messages = (message for message in run.messages() if not isinstance(message, TruePose))
    settings = Config(slam=SlamConfig(walls=True, contour_matching=True))
    result = replay(messages, settings, lidar_mount=run.lidar_mount)
    track = track_from_odometry(run.odometry.stamps, run.odometry.poses, believed)
    found = calibrate(result.stamps, result.poses, track, believed, tuple(run.lidar_mount))
    assert np.abs(errors(found, effective_wheels(run.drive))).max() < 0.002
    assert found.after.turn < 0.3 * found.before.turn
