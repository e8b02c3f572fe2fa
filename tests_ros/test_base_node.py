"""The node base beside a simulated Mega on a pseudo-terminal: it drives as told, and stops when nobody tells it."""

import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry_msgs.msg import Twist, TwistStamped, Vector3
from nav_msgs.msg import Odometry as OdometryMessage
from observer import wait_for
from part_observer import PartObserver
from sensor_msgs.msg import BatteryState, Imu, JointState, MagneticField

from conftest import Processes
from contourslam.recordings.ros_messages import ODOMETRY, TRANSFORM, odometry_from
from contourslam.robot.base import messages
from contourslam.robot.base.messages import Stop
from contourslam_ros.device_messages import stamped

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "robot" / "base"))
from mega_device import BIAS, MegaDevice

TIMEOUT = 0.4  # s, as the node is told
TOPICS = {
    "odom": OdometryMessage,
    "imu__data": Imu,
    "imu__mag": MagneticField,
    "joint_states": JointState,
    "battery_state": BatteryState,
}


class Driven(PartObserver):
    """A robot that can be told to drive."""

    def __init__(self, namespace: str, kind: Any = Twist, topics: dict[str, Any] | None = None) -> None:
        super().__init__(namespace, **(TOPICS if topics is None else topics))
        self._commands = self.node.create_publisher(kind, "cmd_vel", 10)

    def drive(self, message: Any, seconds: float) -> float:
        """Say the same for some seconds; give when it was said last."""
        assert wait_for(lambda: self._commands.get_subscription_count() > 0, 10.0)
        end = time.monotonic() + seconds
        last = 0.0
        while time.monotonic() < end:
            last = time.monotonic()
            self._commands.publish(message)
            time.sleep(0.05)
        return last

    def pose(self) -> np.ndarray:
        return odometry_from(self.messages("odom")[-1], ODOMETRY).pose


def twist(v: float, omega: float = 0.0) -> Twist:
    return Twist(linear=Vector3(x=v), angular=Vector3(z=omega))


@pytest.fixture(scope="module")
def mega(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MegaDevice]:
    made = MegaDevice(tmp_path_factory.mktemp("port") / "ttyBase")
    made.flags = messages.IMU | messages.COMPASS
    yield made
    made.close()


@pytest.fixture(scope="module")
def robot(mega: MegaDevice, parts: Processes, ros: None) -> Iterator[Driven]:
    observer = Driven("r1")
    parts.start("base", namespace="r1", frame_prefix="r1/", port=mega.line.path, cmd_vel_timeout=TIMEOUT)
    assert observer.comes("odom", 50), observer.faults()
    yield observer
    observer.close()


def still(mega: MegaDevice) -> bool:
    return wait_for(lambda: bool(np.abs(mega.speed).max() < 1.0), 3.0)


def test_odometry_comes_fifty_times_a_second_stamped_when_it_was_measured(robot: Driven) -> None:
    stamps = robot.stamps("odom")
    assert np.median(np.diff(stamps)) == pytest.approx(0.02, abs=0.001)
    assert (np.diff(stamps) > 0.0).all()
    assert abs(time.time() - stamps[-1]) < 1.0
    last = robot.messages("odom")[-1]
    assert (last.header.frame_id, last.child_frame_id) == ("r1/odom", "r1/base_link")


def test_the_wheels_turn_as_commanded_and_odometry_follows_them(robot: Driven, mega: MegaDevice) -> None:
    before, ticks = robot.pose(), mega.position.copy()
    robot.drive(twist(0.3, 0.5), 2.0)
    assert still(mega)
    time.sleep(0.2)
    metre = 2.0 * math.pi * 0.05 / 2048
    left, right = (mega.position - ticks) * metre
    assert 0.3 < left < right < 1.0
    after = robot.pose()
    # Where the machine holds the simulated Mega up, its gyroscope misses a little of a turn.
    assert after[2] - before[2] == pytest.approx((right - left) / 0.26, abs=0.15)
    chord = 2.0 * math.sin(0.5 * (after[2] - before[2])) / (after[2] - before[2])
    assert np.hypot(*(after - before)[:2]) == pytest.approx(0.5 * (left + right) * abs(chord), abs=0.05)
    speeds = [message.twist.twist.linear.x for message in robot.messages("odom")]
    assert max(speeds) == pytest.approx(0.3, abs=0.03)


def test_the_transform_is_that_of_the_odometry(robot: Driven) -> None:
    since = {t.header.stamp.sec * 10**9 + t.header.stamp.nanosec: t for t in list(robot.transforms)}
    told = [m for m in robot.messages("odom") if m.header.stamp.sec * 10**9 + m.header.stamp.nanosec in since]
    assert len(told) > 50
    for message in told[::10]:
        transform = since[message.header.stamp.sec * 10**9 + message.header.stamp.nanosec]
        assert (transform.header.frame_id, transform.child_frame_id) == ("r1/odom", "r1/base_link")
        np.testing.assert_allclose(odometry_from(transform, TRANSFORM).pose, odometry_from(message, ODOMETRY).pose)


def test_silence_stops_the_robot(robot: Driven, mega: MegaDevice) -> None:
    last = robot.drive(twist(0.3), 1.0)
    assert np.abs(mega.speed).min() > 1000.0
    assert wait_for(lambda: isinstance(mega.commands[-1][1], Stop), 3.0)
    assert TIMEOUT - 0.05 < mega.commands[-1][0] - last < TIMEOUT + 0.6
    assert still(mega)
    assert mega.stopped_by_watchdog == 0


def test_what_is_no_number_stops_the_robot_and_is_not_obeyed(robot: Driven, mega: MegaDevice) -> None:
    robot.drive(twist(0.3), 0.5)
    robot.drive(twist(math.nan), 0.2)
    assert isinstance(mega.commands[-1][1], Stop)
    assert still(mega)


def test_covariances_are_filled_and_grow_with_the_way(robot: Driven) -> None:
    first, last = (np.array(robot.messages("odom")[i].pose.covariance).reshape(6, 6) for i in (0, -1))
    plane = np.ix_([0, 1, 5], [0, 1, 5])
    assert (np.linalg.eigvalsh(last[plane]) > 0.0).all()
    assert (np.diag(last[plane]) > np.diag(first[plane])).all()
    assert np.sqrt(last[0, 0]) < 0.1
    twists = np.array(robot.messages("odom")[-1].twist.covariance).reshape(6, 6)
    assert (np.linalg.eigvalsh(twists[np.ix_([0, 5], [0, 5])]) > 0.0).all()
    imu = robot.messages("imu__data")[-1]
    assert imu.orientation_covariance[0] == -1.0
    for covariance in (imu.angular_velocity_covariance, imu.linear_acceleration_covariance):
        assert (np.diag(np.array(covariance).reshape(3, 3)) > 0.0).all()


def test_imu_compass_wheels_and_battery_are_told_in_si_units(robot: Driven) -> None:
    imu = robot.messages("imu__data")[-1]
    assert imu.header.frame_id == "r1/base_link"
    assert imu.linear_acceleration.z == pytest.approx(9.807)
    assert imu.angular_velocity.z == pytest.approx(BIAS / 4096, abs=0.001)
    assert robot.messages("imu__mag")
    wheels = robot.messages("joint_states")
    assert wheels[-1].name == ["left_wheel", "right_wheel"]
    assert wheels[-1].position[1] - wheels[0].position[1] > 6.0
    assert robot.messages("battery_state")[-1].voltage == pytest.approx(7.4)


def test_all_is_told_well_and_a_low_battery_is_not(robot: Driven, mega: MegaDevice) -> None:
    assert robot.is_well("base: base", since=time.monotonic())
    since = time.monotonic()
    mega.flags |= messages.BATTERY_LOW
    assert robot.hears("the battery is low", since=since)
    mega.flags = messages.BATTERY_LOW
    assert robot.hears("the battery is low", "the IMU does not answer", since=since)
    mega.flags = messages.IMU


def test_a_base_unplugged_is_named_and_drives_again_when_it_is_back(robot: Driven, mega: MegaDevice) -> None:
    before, gone = robot.pose(), time.monotonic()
    mega.unplug()
    assert robot.hears("no word from the base", since=gone), robot.faults()
    back = time.monotonic()
    mega.plug()
    assert robot.comes("odom", 20, since=back), robot.faults()
    assert robot.is_well("base: base", since=back)
    # The odometry goes on from where it was, though the Mega counts from zero again.
    assert np.abs(robot.pose() - before).max() < 0.02
    robot.drive(twist(0.3), 1.0)
    assert still(mega)
    time.sleep(0.2)
    assert np.hypot(*(robot.pose() - before)[:2]) > 0.15


def test_an_old_command_is_not_obeyed_and_a_node_that_ends_stops_the_robot(
    parts: Processes, ros: None, tmp_path: Path
) -> None:
    mega, robot = MegaDevice(tmp_path / "base"), Driven("r2", TwistStamped, {"odom": OdometryMessage})
    try:
        node = parts.start("base", namespace="r2", port=mega.line.path, stamped_cmd_vel=True, publish_tf=False)
        assert robot.comes("odom", 10), robot.faults()
        robot.drive(TwistStamped(header=stamped(time.time() - 5.0, ""), twist=twist(0.3)), 0.3)
        assert mega.drives() == []
        robot.drive(TwistStamped(header=stamped(time.time(), ""), twist=twist(0.3)), 0.4)
        assert mega.drives()[-1].left > 500
        node.terminate()
        assert node.wait(20.0) == 0
        assert isinstance(mega.commands[-1][1], Stop)
        assert still(mega)
        assert "odom" not in {t.header.frame_id for t in robot.transforms}
    finally:
        robot.close()
        mega.close()
