import math

import numpy as np
import pytest

from contourslam.geometry.motion import unicycle_step
from contourslam.geometry.poses import compose
from contourslam.simulation.config import RobotModel
from contourslam.simulation.drive import Drive
from contourslam.simulation.odometry import read_odometry

ROBOT = RobotModel()


def test_odometry_drifts_away_from_the_truth(full_drive: Drive) -> None:
    errors = []
    for seed in range(8):
        odometry = read_odometry(full_drive, ROBOT, seed)
        believed = compose(full_drive.poses[0], odometry.poses)
        errors.append(np.hypot(*(believed - full_drive.truth(odometry.stamps))[:, :2].T).max())
    assert errors[0] > 0.2
    assert np.median(errors) > 0.2
    assert max(errors) < 5.0


def test_wheels_are_believed_wrong_by_a_half_to_one_and_a_half_per_cent(full_drive: Drive) -> None:
    runs = [read_odometry(full_drive, ROBOT, seed) for seed in range(20)]
    errors = np.array([(run.radius_error, run.base_error) for run in runs])
    assert (np.abs(errors) >= 0.005).all() and (np.abs(errors) <= 0.015).all()
    assert (errors > 0).any(axis=0).all() and (errors < 0).any(axis=0).all()
    assert len(np.unique(errors)) == errors.size


def test_encoders_count_whole_ticks_at_fifty_hertz(full_drive: Drive) -> None:
    odometry = read_odometry(full_drive, ROBOT, 0)
    np.testing.assert_allclose(np.diff(odometry.stamps), 0.02, atol=1e-9)
    assert odometry.ticks.dtype == np.int64
    turned = full_drive.wheel_angles[::10] / (2 * math.pi) * ROBOT.ticks_per_turn
    below = turned - odometry.ticks
    assert (below >= 0).all() and (below < 1).all()


def test_a_reading_is_eq_28_of_the_ticks_with_the_believed_wheels(full_drive: Drive) -> None:
    odometry = read_odometry(full_drive, ROBOT, 3)
    radius, base = ROBOT.wheel_radius * (1 + odometry.radius_error), ROBOT.wheel_base * (1 + odometry.base_error)
    index = 1234
    left, right = np.diff(odometry.ticks[index : index + 2], axis=0)[0] * 2 * math.pi / 2048 * radius
    expected = unicycle_step(odometry.poses[index], (left + right) / 2 / 0.02, (right - left) / base / 0.02, 0.02)
    assert odometry.poses[index + 1] == pytest.approx(expected, abs=1e-12)
    np.testing.assert_array_equal(odometry.poses[0], 0.0)
