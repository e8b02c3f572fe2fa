from collections.abc import Callable

import numpy as np
import pytest

from contourslam.errors import ConfigError
from contourslam.simulation.config import RobotModel
from contourslam.simulation.drive import Drive, drive
from contourslam.simulation.pieces import Box
from contourslam.simulation.room import Room
from contourslam.simulation.rooms import ROOMS

ROBOT = RobotModel()


def test_a_drive_lasts_three_minutes_and_two_laps(full_drive: Drive) -> None:
    assert full_drive.times[-1] >= 180.0
    assert full_drive.laps >= 2.0
    # counted again from the truth: the robot comes back through its first metre
    near = np.hypot(*(full_drive.poses[:, :2] - full_drive.poses[0, :2]).T) < 0.3
    assert np.count_nonzero(np.diff(near.astype(int)) == 1) >= 2


def test_it_drives_about_as_fast_as_asked_and_turns_gently(full_drive: Drive) -> None:
    step = full_drive.times[1]
    speed = np.hypot(*np.diff(full_drive.poses[:, :2], axis=0).T) / step
    turn = np.abs(np.diff(np.unwrap(full_drive.poses[:, 2]))) / step
    assert 0.34 < speed.mean() < 0.42
    assert speed.max() < 0.5
    assert turn.max() <= 1.0
    assert turn.max() > 0.3


def test_it_stands_still_when_the_clock_starts(full_drive: Drive) -> None:
    assert full_drive.times[0] == 0.0
    np.testing.assert_array_equal(full_drive.wheel_angles[0], 0.0)
    assert np.hypot(*(full_drive.poses[1, :2] - full_drive.poses[0, :2])) < 1e-4


def test_it_stays_on_its_wheels(full_drive: Drive) -> None:
    tilt_deg = np.degrees(np.arccos(full_drive.rotations[:, 2, 2]))
    assert tilt_deg.max() < 0.3
    assert np.abs(full_drive.positions[:, 2] - ROBOT.wheel_radius).max() < 1e-3


def test_wheels_slip_so_that_even_true_wheels_lose_the_way(full_drive: Drive) -> None:
    rolled = np.diff(full_drive.wheel_angles, axis=0) * ROBOT.wheel_radius
    forward = rolled.mean(axis=1)
    path = np.hypot(*np.diff(full_drive.poses[:, :2], axis=0).T).sum()
    assert 0.001 < forward.sum() / path - 1.0 < 0.03
    heading = full_drive.poses[0, 2] + np.cumsum((rolled[:, 1] - rolled[:, 0]) / ROBOT.wheel_base)
    end = full_drive.poses[0, :2] + [np.sum(forward * np.cos(heading)), np.sum(forward * np.sin(heading))]
    assert np.hypot(*(end - full_drive.poses[-1, :2])) > 0.02


@pytest.mark.parametrize(
    ("name", "duration"), [("furnished_room", None), ("office_corridor", 140.0), ("large_hall", 170.0)]
)
def test_the_robot_drives_a_lap_of_every_room_without_touching_anything(
    name: str, duration: float | None, full_drive: Drive, clearance: Callable[..., np.ndarray]
) -> None:
    room = ROOMS[name]
    driven = full_drive if duration is None else drive(room, ROBOT, 1, duration=duration)
    assert driven.laps > 1.0
    for height in (0.02, 0.1, 0.2):
        gap = clearance(driven.poses[::25, :2], room.segments(height), room.circles(height))
        assert gap.min() > ROBOT.body_radius + 0.1


def test_seeds_vary_the_drive() -> None:
    room = ROOMS["furnished_room"]
    first, again, other = (drive(room, ROBOT, seed, duration=1.0) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.positions, again.positions)
    np.testing.assert_array_equal(first.wheel_angles, again.wheel_angles)
    assert np.abs(first.poses[0] - other.poses[0]).max() > 1e-3


def test_truth_between_two_steps_lies_between_their_poses(full_drive: Drive) -> None:
    middle = full_drive.truth(np.array([20.001]))[0]
    np.testing.assert_allclose(middle, (full_drive.poses[10000] + full_drive.poses[10001]) / 2, atol=1e-6)


def test_a_robot_that_is_stuck_says_where() -> None:
    blocked = Room(
        "blocked",
        "a box across the way",
        ((0, 0), (6, 0), (6, 3), (0, 3)),
        (Box(3.0, 1.5, 0.3, 3.0, 1.0),),
        ((1.0, 1.0), (5.0, 1.0), (5.0, 2.0)),
    )
    with pytest.raises(ConfigError, match=r"blocked: the robot got stuck at \(2\.\d+, "):
        drive(blocked, ROBOT, 0)


def test_progress_runs_up_to_one() -> None:
    done: list[float] = []
    drive(ROOMS["furnished_room"], ROBOT, 0, duration=1.0, progress=done.append)
    assert done == sorted(done)
    assert 0.0 < done[0] < 0.1 and done[-1] > 0.95
