"""All parts together, with parts that do as they are told: the real ones have tests of their own."""

import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from contourslam.recordings.picture import Picture
from contourslam.robot.base.odometry import BaseOdometry
from contourslam.robot.base.states import BaseState
from contourslam.robot.bring_up import Event, Openers, Robot, Trouble, openers
from contourslam.robot.config import BaseConfig, LidarPart, RobotConfig
from contourslam.robot.device_errors import DeviceError, DeviceNotFoundError, DeviceUnpluggedError
from contourslam.scan import LaserScan

Stopped = Callable[[], bool]
JPEG = b"\xff\xd8\xff" + b"\xff\xd9"


def scan(stamp: float) -> LaserScan:
    return LaserScan(stamp, np.array([0.0, 1.0]), np.array([1.0, 1.0]), np.zeros(2), 0.1, 10.0)


def state(stamp: float) -> BaseState:
    odometry = BaseOdometry(stamp, np.zeros(3), np.eye(3), 0.0, 0.0, np.eye(2), False)
    return BaseState(stamp, (0, 0), (0.0, 0.0), (0.0, 0.0), None, None, None, 7.4, (0.0, 0.0), 0, odometry)


class Part:
    """Says something every 10 ms, fails where it is told to, and remembers what was done to it."""

    def __init__(self, make: Callable[[float], Event], log: list[str], name: str) -> None:
        self.make, self.log, self.name = make, log, name
        self.failure: BaseException | None = None
        self.opened = 0
        self.driven: list[tuple[float, float]] = []

    def open(self) -> Any:
        self.opened += 1
        if self.failure is not None and self.opened > 1:
            raise self.failure
        return self

    def _stream(self, stopped: Stopped) -> Iterator[Any]:
        while not stopped():
            if self.failure is not None:
                raise self.failure
            yield self.make(time.time())
            time.sleep(0.01)

    scans = states = frames = _stream

    def drive(self, v: float, omega: float) -> None:
        self.driven.append((v, omega))

    def stop(self) -> None:
        self.log.append(f"{self.name} stops")

    def close(self) -> None:
        self.log.append(f"{self.name} closes")


class Parts:
    def __init__(self) -> None:
        self.log: list[str] = []
        self.lidar = Part(scan, self.log, "lidar")
        self.base = Part(state, self.log, "base")
        self.camera = Part(lambda stamp: Picture(stamp, JPEG, "jpeg"), self.log, "camera")

    def openers(self) -> Openers:
        return Openers(self.lidar.open, self.base.open, self.camera.open)


def until(robot: Robot, wanted: Callable[[Event], bool], seconds: float = 8.0) -> Event:
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        event = robot.next(0.1)
        if event is not None and wanted(event):
            return event
    raise AssertionError("it never came")


def test_all_parts_come_in_one_stream() -> None:
    parts = Parts()
    with Robot(parts.openers()) as robot:
        robot.wait_until_ready()
        for kind in (LaserScan, BaseState, Picture):
            until(robot, lambda event, kind=kind: isinstance(event, kind))
        robot.drive(0.2, 0.1)
        assert robot.state is not None and robot.troubles == {}
    assert parts.base.driven == [(0.2, 0.1)]


def test_a_part_that_fails_is_told_once_and_tried_again_while_the_others_go_on() -> None:
    parts = Parts()
    with Robot(parts.openers()) as robot:
        robot.wait_until_ready()
        parts.lidar.failure = DeviceUnpluggedError("the lidar was unplugged")
        told = until(robot, lambda event: isinstance(event, Trouble))
        assert isinstance(told, Trouble) and (told.part, told.message) == ("lidar", "the lidar was unplugged")
        assert robot.troubles == {"lidar": "the lidar was unplugged"}
        opened = parts.lidar.opened
        since, troubles = time.monotonic(), 0
        while parts.lidar.opened < opened + 2 and time.monotonic() - since < 8.0:
            event = robot.next(0.1)
            troubles += isinstance(event, Trouble)
            assert not isinstance(event, LaserScan) or event.stamp <= told.stamp
        assert troubles == 0  # the same trouble again is no news
        until(robot, lambda event: isinstance(event, BaseState))
        parts.lidar.failure = None
        back = until(robot, lambda event: isinstance(event, Trouble))
        assert isinstance(back, Trouble) and (back.part, back.message) == ("lidar", "")
        until(robot, lambda event: isinstance(event, LaserScan))
        assert robot.troubles == {}


def test_the_motors_stop_before_anything_else_ends_whatever_the_reason() -> None:
    parts = Parts()
    with pytest.raises(KeyboardInterrupt), Robot(parts.openers()) as robot:
        robot.wait_until_ready()
        raise KeyboardInterrupt
    assert parts.log[0] == "base stops"
    assert set(parts.log[1:]) >= {"lidar closes", "base closes", "camera closes"}
    driven = len(parts.base.driven)
    robot.drive(1.0, 0.0)  # a late command moves nothing
    assert len(parts.base.driven) == driven


def test_a_lidar_that_is_not_there_is_an_error_before_the_drive() -> None:
    parts = Parts()

    def none() -> Any:
        raise DeviceNotFoundError("no lidar was found")

    with Robot(Openers(none, parts.base.open)) as robot, pytest.raises(DeviceError, match="no lidar was found"):
        robot.wait_until_ready()


def test_a_camera_that_is_not_there_stops_nobody() -> None:
    parts = Parts()

    def none() -> Any:
        raise DeviceNotFoundError("no camera was found")

    with Robot(Openers(parts.lidar.open, parts.base.open, none)) as robot:
        events = robot.wait_until_ready()
        events.append(until(robot, lambda event: isinstance(event, Trouble) or "camera" in robot.troubles))
        assert robot.troubles == {"camera": "no camera was found"}


def test_a_film_in_the_cameras_place_is_shown_once() -> None:
    parts = Parts()

    class Reel(Part):
        def frames(self, stopped: Stopped) -> Iterator[Any]:
            yield from (self.make(0.1 * number) for number in range(2))

    reel = Reel(lambda stamp: Picture(stamp, JPEG, "jpeg"), parts.log, "camera")
    with Robot(Openers(parts.lidar.open, parts.base.open, reel.open)) as robot:
        for _ in range(2):
            until(robot, lambda event: isinstance(event, Picture))
        time.sleep(1.3)  # longer than until a part that failed is tried again
    assert reel.opened == 1 and parts.log.count("camera closes") == 1


def test_a_part_that_never_says_a_word_is_named() -> None:
    parts, held = Parts(), threading.Event()

    class Mute(Part):
        def _stream(self, stopped: Stopped) -> Iterator[Any]:
            held.wait(5.0)
            yield from ()

        scans = _stream

    mute = Mute(scan, parts.log, "lidar")
    with Robot(Openers(mute.open, parts.base.open)) as robot:
        with pytest.raises(DeviceError, match="the lidar said nothing within 0 s"):
            robot.wait_until_ready(seconds=0.3)
        held.set()


def test_a_bug_in_a_part_is_not_hidden() -> None:
    parts = Parts()
    parts.lidar.failure = ZeroDivisionError("a bug")
    with Robot(parts.openers()) as robot, pytest.raises(ZeroDivisionError):
        until(robot, lambda event: False)


def test_the_real_parts_are_opened_by_the_robots_file() -> None:
    config = RobotConfig(BaseConfig(port="/nowhere/base"), LidarPart(port="/nowhere/lidar"))
    found = openers(config)
    assert found.lidar is not None and found.base is not None and found.camera is None
    for opened, name in ((found.lidar, "lidar"), (found.base, "base")):
        with pytest.raises(DeviceNotFoundError, match=f"/nowhere/{name}"):
            opened()
