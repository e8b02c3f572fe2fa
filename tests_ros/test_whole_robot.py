"""The nodes of a whole robot, as robot.launch.py starts them.

A simulated room sends the bytes of an X4, and those of a simulated chip that runs the real firmware of the Mega; what
the nodes command goes the same way back.
"""

import shutil
import subprocess
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist, Vector3
from nav_msgs.msg import Odometry as OdometryMessage
from observer import wait_for
from part_observer import PartObserver
from sensor_msgs.msg import Imu
from sensor_msgs.msg import LaserScan as ScanMessage

from conftest import Processes
from contourslam.geometry.poses import between, interpolate
from contourslam.recordings.ros_messages import ODOMETRY, odometry_from
from contourslam.robot.config import BaseConfig, LidarPart, RobotConfig, save_robot
from contourslam.simulation.hardware.board import SimulatedBoard
from contourslam.simulation.hardware.live_world import Record, WorldConfig
from contourslam.simulation.hardware.running_world import RunningWorld
from contourslam.simulation.rooms import ROOMS

FIRMWARE = Path(__file__).parents[1] / "firmware" / "mega"
NEEDED = ("avr-gcc", "avr-objcopy", "make", "cc")
# Speeds ahead (m/s) and rates of turn (rad/s), and until how far (m) or how much (rad) the odometry says it went.
WAY = ((0.25, 0.0, 1.0), (0.0, 0.7, 2.0), (0.2, 0.4, 0.8), (0.0, -0.7, 1.4))
CLOSE = 0.03  # m, as the robot in the loop


@pytest.fixture(scope="module")
def built() -> Path:
    missing = [name for name in NEEDED if shutil.which(name) is None]
    if missing:
        pytest.skip(f"the firmware is not built here without {', '.join(missing)}")
    done = subprocess.run(["make", "-C", str(FIRMWARE), "all", "board"], capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"the firmware is not built here: {done.stderr.strip().splitlines()[-1]}")
    return FIRMWARE / "build"


@pytest.fixture(scope="module")
def driven(
    built: Path, processes: Processes, ros: None, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[PartObserver, Record]]:
    folder = tmp_path_factory.mktemp("robot")
    observer = PartObserver(
        "whole", scan=ScanMessage, odom=OdometryMessage, pose=PoseWithCovarianceStamped, imu__data=Imu
    )
    commands = observer.node.create_publisher(Twist, "cmd_vel", 10)
    board = partial(SimulatedBoard, built / "board", built / "mega.elf")
    with RunningWorld(WorldConfig(ROOMS["furnished_room"], seed=1), board, folder) as world:
        robot = RobotConfig(BaseConfig(port=str(world.base_port)), LidarPart(port=str(world.lidar_port)))
        save_robot(folder / "robot.yaml", robot)
        for part in ("slam", "lidar", "base"):
            processes.start(part, namespace="whole", frame_prefix="whole/", robot=folder / "robot.yaml")
        assert observer.comes("pose", 3, seconds=120.0), observer.faults()
        for v, omega, amount in WAY:
            begun, until = time.monotonic(), time.monotonic() + 60.0
            while gone(observer, begun, turning=v == 0.0) < amount and time.monotonic() < until:
                commands.publish(Twist(linear=Vector3(x=v), angular=Vector3(z=omega)))
                time.sleep(0.05)
        assert wait_for(lambda: observer.messages("odom")[-1].twist.twist.linear.x == 0.0, 30.0)
        time.sleep(2.0)  # also a room that is late has then caught up
        record = world.finish()
    yield observer, record
    observer.close()


def gone(observer: PartObserver, since: float, turning: bool) -> float:
    """How far the odometry went since a time, m, or by how much it turned, rad."""
    poses = np.array([odometry_from(m, ODOMETRY).pose for m in observer.messages("odom", since)]).reshape(-1, 3)
    steps = np.diff(np.unwrap(poses, axis=0), axis=0) if turning else np.diff(poses, axis=0)
    return float(abs(steps[:, 2].sum()) if turning else np.hypot(*steps[:, :2].T).sum())


def errors(observer: PartObserver, record: Record, topic: str) -> np.ndarray:
    """How far off each pose of a topic is, m, where its first is right."""
    readings = [odometry_from(message, ODOMETRY) for message in observer.messages(topic)]
    stamps, poses = np.array([r.stamp for r in readings]), np.array([r.pose for r in readings])
    within = (stamps >= record.stamps[0]) & (stamps <= record.stamps[-1])
    stamps, poses = stamps[within], poses[within]
    truth = interpolate(record.stamps, record.poses, stamps)
    return np.hypot(*(between(poses[0], poses) - between(truth[0], truth))[:, :2].T)


def test_the_robot_goes_where_it_is_told(driven: tuple[PartObserver, Record]) -> None:
    _, record = driven
    ways = np.hypot(*np.diff(record.poses[:, :2], axis=0).T)
    assert ways.sum() == pytest.approx(sum(amount for v, _, amount in WAY if v), abs=0.3)
    # To the left, on in a curve, and back to the right; by how much beyond that is the machine's own delay.
    heading = np.unwrap(record.poses[:, 2]) - record.poses[0, 2]
    assert heading.max() > 3.4
    assert heading[-1] < heading.max() - 1.3


def test_slam_knows_where_it_came_to_rest(driven: tuple[PartObserver, Record]) -> None:
    observer, record = driven
    assert len(observer.messages("pose")) > 60
    off = errors(observer, record, "pose")
    assert off[-1] < CLOSE, observer.faults()
    if record.latest < 0.05:  # else the truth is that of another time: the machine held up the room
        assert np.sqrt((off**2).mean()) < CLOSE, observer.faults()


def test_its_odometry_drifts_little(driven: tuple[PartObserver, Record]) -> None:
    observer, record = driven
    assert errors(observer, record, "odom")[-1] < 0.15
    assert np.median(np.diff(observer.stamps("odom"))) == pytest.approx(0.02, abs=0.001)


def test_the_transforms_join_map_odometry_base_and_lidar(driven: tuple[PartObserver, Record]) -> None:
    observer, _ = driven
    assert observer.places["whole/laser"].header.frame_id == "whole/base_link"
    moving = {(t.header.frame_id, t.child_frame_id) for t in list(observer.transforms)}
    assert {("whole/map", "whole/odom"), ("whole/odom", "whole/base_link")} <= moving
    assert wait_for(lambda: observer.landmarks is not None, 5.0)


def test_scans_and_inertial_sensors_come_at_their_rates(driven: tuple[PartObserver, Record]) -> None:
    observer, _ = driven
    assert 6.0 < 1.0 / np.median(np.diff(observer.stamps("scan"))) < 12.0
    rates = [message.angular_velocity.z for message in observer.messages("imu__data")]
    assert max(rates) == pytest.approx(0.7, abs=0.1)
