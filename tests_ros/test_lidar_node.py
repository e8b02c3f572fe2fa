"""The node lidar beside a simulated X4 on a pseudo-terminal, through a day of its life."""

import math
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from observer import wait_for
from part_observer import PartObserver
from sensor_msgs.msg import LaserScan as ScanMessage
from std_srvs.srv import Trigger

from conftest import Processes
from contourslam.recordings.ros_messages import scan_from
from contourslam.simulation.hardware.plugged_x4 import PluggedX4, square_room

RATE = 7.0  # turns a second, about
TURN = round(5000 / RATE) / 5000  # s
ROBOT = """lidar:
  x: 0.12
  yaw_deg: 180.0
  height: 0.25
"""


@pytest.fixture(scope="module")
def device(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PluggedX4]:
    with PluggedX4(tmp_path_factory.mktemp("port") / "ttyLidar", rate=RATE) as made:
        yield made


@pytest.fixture(scope="module")
def robot(
    device: PluggedX4, parts: Processes, ros: None, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[PartObserver]:
    observer = PartObserver("r1", scan=ScanMessage)
    file = tmp_path_factory.mktemp("robot") / "robot.yaml"
    file.write_text(ROBOT)
    parts.start("lidar", namespace="r1", frame_prefix="r1/", port=device.line.path, robot=file)
    assert observer.comes("scan", 20), observer.faults()
    yield observer
    observer.close()


def test_scans_come_at_the_lidars_rate_stamped_when_they_were_measured(robot: PartObserver, device: PluggedX4) -> None:
    scans = [scan_from(message, False) for message in robot.messages("scan")]
    assert {message.header.frame_id for message in robot.messages("scan")} == {"r1/laser"}
    stamps = np.array([scan.stamp for scan in scans])
    assert np.diff(stamps) == pytest.approx(TURN, abs=0.02)
    assert device.lidar.begun is not None
    turns = (stamps - device.lidar.begun) / TURN
    assert turns == pytest.approx(np.rint(turns), abs=0.1)
    for scan in scans:
        assert scan.offsets[-1] == pytest.approx(TURN, abs=0.01)
        assert scan.ranges == pytest.approx(square_room(scan.angles), abs=0.06, nan_ok=True)


def test_the_standard_fields_of_a_scan_agree_with_each_other(robot: PartObserver) -> None:
    for message in robot.messages("scan"):
        count = len(message.ranges)
        assert message.angle_max == pytest.approx(message.angle_min + (count - 1) * message.angle_increment, abs=1e-4)
        assert abs(message.angle_increment) * count == pytest.approx(2.0 * math.pi, abs=1e-3)
        assert message.scan_time == pytest.approx(count * message.time_increment, rel=1e-5)


def test_where_the_lidar_sits_is_said_as_the_robots_file_has_it(robot: PartObserver) -> None:
    place = robot.places["r1/laser"]
    assert place.header.frame_id == "r1/base_link"
    t, q = place.transform.translation, place.transform.rotation
    assert (t.x, t.y, t.z) == (0.12, 0.0, 0.25)
    assert (q.z, q.w) == pytest.approx((1.0, 0.0))


def test_all_is_told_well(robot: PartObserver) -> None:
    since = time.monotonic()
    assert robot.is_well("lidar: lidar", since)
    told = robot.latest("lidar: lidar")
    values = {value.key: value.value for value in told.values}
    assert float(values["turns (1/s)"]) == pytest.approx(RATE, abs=0.2)
    assert int(values["beams"]) == round(5000 / RATE)


def test_a_lidar_unplugged_is_named_and_its_scans_go_on_when_it_is_back(robot: PartObserver, device: PluggedX4) -> None:
    gone = time.monotonic()
    device.unplug()
    assert robot.hears("there is no such port", since=gone), robot.faults()
    assert not robot.comes("scan", since=time.monotonic(), seconds=0.5)
    back = time.monotonic()
    device.plug()
    assert robot.comes("scan", 5, since=back), robot.faults()
    assert robot.is_well("lidar: lidar", since=back)
    stamps = robot.stamps("scan")
    assert (np.diff(stamps) > 0.0).all()


def test_a_silent_lidar_is_named_with_what_to_try(robot: PartObserver, device: PluggedX4) -> None:
    since = time.monotonic()
    device.lidar.silent = device.lidar.deaf = True
    assert robot.hears("no data within", "check the lidar's power", since=since), robot.faults()
    device.lidar.silent = device.lidar.deaf = False
    assert robot.comes("scan", 5, since=time.monotonic()), robot.faults()


def test_the_motor_rests_while_it_is_told_to(robot: PartObserver, device: PluggedX4) -> None:
    assert robot.call(Trigger, "lidar/stop_motor").success
    assert wait_for(lambda: not device.lidar.scanning, 1.0)  # the command is still on the wire
    assert robot.is_well("lidar: lidar", since=time.monotonic())
    assert "at rest" in robot.latest("lidar: lidar").message
    since = time.monotonic()
    time.sleep(0.5)
    assert not robot.messages("scan", since)
    assert robot.call(Trigger, "lidar/start_motor").success
    assert robot.comes("scan", 5, since=since), robot.faults()


def test_a_file_that_cannot_be_read_ends_the_node(parts: Processes, tmp_path: Path) -> None:
    assert parts.start("lidar", namespace="r2", robot=tmp_path / "absent.yaml").wait(30.0) == 1
