"""What is said of the robot's parts to those who watch it."""

from contextlib import suppress
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.recordings.picture import Picture
from contourslam.robot.base.messages import BATTERY_LOW, STALLED, WATCHDOG
from contourslam.robot.base.odometry import BaseOdometry
from contourslam.robot.base.states import BaseState
from contourslam.robot.bring_up import READY, Openers, Robot
from contourslam.robot.device_errors import DeviceError
from contourslam.robot.health import PICTURES, TURNS, RobotHealth
from contourslam.scan import LaserScan

JPEG = b"\xff\xd8\xff\xff\xd9"
SCAN = LaserScan(0.0, np.array([0.0]), np.array([1.0]), np.zeros(1), 0.1, 10.0)


def state(flags: int = 0, *, imu: bool = True) -> BaseState:
    odometry = BaseOdometry(0.0, np.zeros(3), np.eye(3), 0.3, 0.1, np.eye(2), False)
    turn = (0.0, 0.0, 0.1) if imu else None
    return BaseState(0.0, (0, 0), (0.0, 0.0), (0.0, 0.0), turn, turn, None, 7.2, (0.0, 0.0), flags, odometry)


class Watched:
    """A robot of three parts, none of which is brought up, on a clock of its own."""

    def __init__(self, *, driven: bool = True) -> None:
        part: Any = SimpleNamespace
        self.robot, self.now = Robot(Openers(part, part, part)), 0.0
        self.health = RobotHealth(self.robot, driven=driven, clock=lambda: self.now)

    def said(self) -> dict[str, Diagnostic]:
        return {one.name: one for one in self.health()}


def test_each_part_that_the_robot_has_is_told_of() -> None:
    watched = Watched()
    assert {name: one.message for name, one in watched.said().items()} == dict.fromkeys(
        ("lidar", "base", "camera"), "starting"
    )
    watched.health.watch(SCAN)
    watched.health.watch(state())
    watched.health.watch(Picture(0.0, JPEG, "jpeg"))
    said = watched.said()
    assert all(one.level is Level.OK for one in said.values())
    assert said["base"].message == "0.30 m/s, 0.10 rad/s, battery 7.2 V"
    assert said["lidar"].message == "it turns" and said["camera"].message == "1 picture"
    lidar_alone = RobotHealth(Robot(Openers(lidar=SimpleNamespace)), driven=False)  # type: ignore[arg-type]
    assert [one.name for one in lidar_alone()] == ["lidar"]


@pytest.mark.parametrize(
    ("flags", "imu", "what"),
    [
        (BATTERY_LOW, True, "the battery is low: charge it"),
        (STALLED, True, "a motor does not turn"),
        (WATCHDOG, True, "its watchdog has stopped it"),
        (0, False, "the IMU does not answer"),
    ],
)
def test_what_is_wrong_with_the_base_is_said_even_if_it_was_so_for_a_moment(flags: int, imu: bool, what: str) -> None:
    watched = Watched()
    watched.health.watch(state(flags, imu=imu))
    if imu and flags != BATTERY_LOW:
        watched.health.watch(state())
    told = watched.said()["base"]
    assert told.level is Level.WARN and what in told.message
    watched.health.watch(state())
    assert watched.said()["base"].level is Level.OK


def test_a_watchdog_is_no_news_of_a_robot_that_nobody_drives() -> None:
    watched = Watched(driven=False)
    watched.health.watch(state(WATCHDOG))
    assert watched.said()["base"].level is Level.OK


def test_a_part_that_has_fallen_silent_or_failed_is_told_with_what_to_do() -> None:
    watched = Watched()
    watched.health.watch(SCAN)
    watched.health.watch(state())
    watched.now = TURNS + 0.1
    said = watched.said()
    assert "no turn of the lidar for 2.1 s" in said["lidar"].message and said["lidar"].level is Level.WARN
    assert "no word from the base for 2.1 s" in said["base"].message

    watched.health.watch(Picture(0.0, JPEG, "jpeg"))
    watched.now += PICTURES + 0.1
    said = watched.said()["camera"]
    assert said.message.startswith("no picture for 10.1 s") and said.level is Level.WARN

    def gone() -> Any:
        raise DeviceError("/dev/ttyUSB0 is not there; plug it in")

    robot = Robot(Openers(lidar=gone))
    with robot, suppress(DeviceError):
        robot.wait_until_ready()
    (lidar,) = RobotHealth(robot, driven=True)()
    assert lidar == Diagnostic(Level.ERROR, "lidar", "/dev/ttyUSB0 is not there; plug it in")


def test_a_part_that_never_spoke_is_told_once_it_has_had_the_time_to_start() -> None:
    watched = Watched()
    watched.now = READY - 0.1
    assert {one.level for one in watched.health()} == {Level.OK}
    watched.now = READY + 0.1
    said = watched.said()
    assert {one.level for one in said.values()} == {Level.WARN}
    assert "no turn of the lidar for 15.1 s" in said["lidar"].message
    assert "no word from the base for 15.1 s" in said["base"].message
    assert "no picture for 15.1 s" in said["camera"].message


def test_a_film_that_has_come_to_its_end_is_no_camera_that_is_silent() -> None:
    film: Any = SimpleNamespace(frames=lambda stopped: iter([Picture(0.0, JPEG, "jpeg")]), close=lambda: None)
    now = 0.0
    robot = Robot(Openers(camera=lambda: film))
    health = RobotHealth(robot, driven=False, clock=lambda: now)
    with robot:
        event = robot.next(60.0)
        assert event is not None
        health.watch(event)
        robot._threads["camera"].join()
        now = 1000.0
        (camera,) = health()
    assert camera == Diagnostic(Level.OK, "camera", "1 picture, and no more are kept")
