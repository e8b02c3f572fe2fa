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
# Speeds ahead (m/s) and rates of turn (rad/s), and for how long (s).
WAY = ((0.25, 0.0, 4.0), (0.0, 0.7, 3.0), (0.2, 0.4, 4.0), (0.0, -0.7, 2.0))
CLOSE = 0.05  # m, where the machine is busy with other things


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
    processes.start("slam", namespace="whole", frame_prefix="whole/")
    board = partial(SimulatedBoard, built / "board", built / "mega.elf")
    with RunningWorld(WorldConfig(ROOMS["furnished_room"], seed=1), board, folder) as world:
        robot = RobotConfig(BaseConfig(port=str(world.base_port)), LidarPart(port=str(world.lidar_port)))
        save_robot(folder / "robot.yaml", robot)
        for part in ("lidar", "base"):
            processes.start(part, namespace="whole", frame_prefix="whole/", robot=folder / "robot.yaml")
        assert observer.comes("pose", 3, seconds=120.0), observer.faults()
        for v, omega, seconds in WAY:
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                commands.publish(Twist(linear=Vector3(x=v), angular=Vector3(z=omega)))
                time.sleep(0.05)
        time.sleep(1.5)  # it stops by itself
        record = world.finish()
    yield observer, record
    observer.close()


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
    assert ways.sum() == pytest.approx(sum(abs(v) * seconds for v, _, seconds in WAY), rel=0.25)
    heading = np.unwrap(record.poses[:, 2])
    assert heading[-1] - heading[0] == pytest.approx(sum(omega * seconds for _, omega, seconds in WAY), rel=0.3)


def test_slam_knows_where_it_is(driven: tuple[PartObserver, Record]) -> None:
    observer, record = driven
    assert len(observer.messages("pose")) > 60
    assert np.sqrt((errors(observer, record, "pose") ** 2).mean()) < CLOSE, observer.faults()


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
