"""Several robots and a fleet server, each in a process of its own, are killed and started again: nothing is lost."""

import signal
import subprocess
import time
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from contourslam_msgs.msg import FleetPacket
from contourslam_msgs.srv import SaveMap
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Path as Way
from observer import LATCHED, Observer, figures, wait_for
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from conftest import Processes
from contourslam.evaluation.errors import align_first
from contourslam.fleet.facts import Answer, Report
from contourslam.fleet.wire import decode, encode
from contourslam.geometry.poses import compose
from contourslam.maps.file import load_map
from contourslam.maps.saved_map import Contoured
from contourslam.recordings import write_recording
from contourslam.recordings.ros_messages import POSE_COVARIANCE, TRANSFORM, odometry_from
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import SimulatedRun, simulate
from contourslam_ros.fleet_topics import QUALITY, answers_to

CLOSE = 0.1  # m
RATE = 1.5  # of the playing, against the clock
# Both drive through the furnished room, and begin a third of a round apart.
ROBOTS = "red", "blue"
SITES = "red:room, blue:room, robot-1:elsewhere"
FOREIGN = Report("robot-1", 1, 0, ())  # of a program that is none of ours: no topic may have this name


@dataclass
class Placed:
    """A pose in the common map."""

    stamp: float
    frame: str
    pose: np.ndarray
    covariance: np.ndarray


class Robot:
    """One robot: its node, its players, and what is heard of it."""

    def __init__(self, name: str, seed: int, observer: Observer, folder: Path) -> None:
        self.name, self.observer = name, observer
        self.drive: SimulatedRun = simulate(ROOMS["furnished_room"], SimulationConfig(duration=36.0), seed=seed)
        x, y, yaw = self.drive.lidar_mount.tolist()
        messages = (m for m in self.drive.messages() if isinstance(m, LaserScan | Odometry))
        write_recording(folder / "recording", messages, lidar_mount=(x, y, yaw))
        self.processes = Processes(folder / "recording", folder)
        self.common: list[Placed] = []
        self._shifts: list[tuple[int, float]] = []  # from which of these on the stamps are shifted by how much
        observer.node.create_subscription(PoseWithCovarianceStamped, "pose_in_common", self._on_pose, 1000)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        seen = odometry_from(message, POSE_COVARIANCE)
        covariance = np.array(message.pose.covariance).reshape(6, 6)[np.ix_([0, 1, 5], [0, 1, 5])]
        self.common.append(Placed(seen.stamp, message.header.frame_id, seen.pose, covariance))

    def start(self) -> "subprocess.Popen[str]":
        """Start its node."""
        return self.processes.start("slam", namespace=self.name, frame_prefix=f"{self.name}/", fleet=self.name)

    def play(self, *piece: float) -> "subprocess.Popen[str]":
        """Let it drive on; the player waits for the node."""
        return self.processes.play(namespace=self.name, prefix=f"{self.name}/", pieces=[piece], rate=RATE)

    def played(self, player: "subprocess.Popen[str]") -> None:
        """Wait until it has driven."""
        assert player.wait(120.0) == 0
        before = sum(count for count, _ in self._shifts)
        self._shifts.append((len(self.common) - before, self.processes.played(self.name)["shift"]))

    def truth(self) -> np.ndarray:
        """Where it truly was at each pose in common, shape (n, 3)."""
        shifts = np.repeat([shift for _, shift in self._shifts], [count for count, _ in self._shifts])
        stamps = np.array([placed.stamp for placed in self.common[: len(shifts)]])
        return self.drive.truth(stamps - shifts)

    def told(self) -> dict[str, str]:
        """What it last said of the fleet."""
        return figures(self.observer.latest("slam: fleet"))

    def keyframes(self, folder: Path) -> Contoured:
        """Those that it has mapped in this run; no scan is taken in after that."""
        assert self.observer.call(Trigger, "slam/pause").success
        path = folder / f"{self.name}_{time.monotonic_ns()}.cmap"
        answer = self.observer.call(SaveMap, "slam/save", path=str(path))
        assert answer.success, answer.message
        found = load_map(path).keyframes
        assert found is not None
        return found

    def all_is_acknowledged(self) -> bool:
        """Whether it says that the server has all it told."""
        return self.told().get("waiting") == "0"


@dataclass
class Seen:
    """What was heard and kept of all that was done."""

    robots: dict[str, Robot]
    server: Observer
    runs: list[Contoured]
    kept: Path
    markers: list[MarkerArray] = field(default_factory=list)
    ways: dict[str, Way] = field(default_factory=dict)
    foreign: list[Answer] = field(default_factory=list)

    @property
    def number(self) -> str:
        """Of the map in which the robots meet."""
        return self.robots["red"].told()["common map"]

    @property
    def frame(self) -> str:
        return f"common_map_{self.number}"


@pytest.fixture(scope="module")
def seen(
    compiled: None, observe: Callable[[str], Observer], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Seen]:
    folder = tmp_path_factory.mktemp("fleet")
    fleet = Processes(Path(), folder)
    listener = observe("")
    robots = {n: Robot(n, seed, observe(n), tmp_path_factory.mktemp(n)) for seed, n in enumerate(ROBOTS, 1)}
    red, blue = robots.values()
    seen = Seen(robots, listener, [], folder / "maps")
    listener.node.create_subscription(MarkerArray, "/fleet/markers", seen.markers.append, LATCHED)
    for name in robots:
        listener.node.create_subscription(Way, f"/fleet/way/{name}", partial(seen.ways.__setitem__, name), LATCHED)
    listener.node.create_subscription(
        FleetPacket, answers_to(FOREIGN.robot), lambda m: seen.foreign.append(decode(bytes(m.data))), QUALITY
    )
    rubbish = listener.node.create_publisher(FleetPacket, "/fleet/reports", 10)

    def the_foreign_robot_is_answered() -> bool:
        """Tell its report, again and again, until it is acknowledged."""
        rubbish.publish(FleetPacket(data=array("B", encode(FOREIGN))))
        return bool(seen.foreign) and seen.foreign[-1].received == 1

    try:
        node = blue.start()
        red.start()
        driving, first = red.play(0.0, 30.0), blue.play(2.0, 8.0)
        # The server comes after the robots, is killed while they drive, and comes back.
        server = fleet.start("fleet_server", folder=folder / "kept", sites=SITES)
        assert wait_for(lambda: all(int(r.told().get("acknowledged", 0)) > 0 for r in robots.values()), 60.0)
        rubbish.publish(FleetPacket(data=array("B", b"CF this is nothing that a robot would say")))
        assert wait_for(lambda: listener.said("refused in the last"), 10.0)
        assert wait_for(the_foreign_robot_is_answered, 20.0)
        server.send_signal(signal.SIGKILL)
        server.wait(10.0)
        fleet.start("fleet_server", folder=folder / "kept", sites=SITES)
        seen.foreign.clear()
        # A robot is started again: what it mapped until then is told by the node that ends, once there is a server.
        blue.played(first)
        seen.runs.append(blue.keyframes(folder))
        assert wait_for(blue.all_is_acknowledged, 30.0)
        node.send_signal(signal.SIGINT)
        assert node.wait(20.0) == 0
        blue.start()
        second = blue.play(8.0, 33.0)
        red.played(driving)
        blue.played(second)
        # They share a map, and drive on in it.
        assert wait_for(lambda: all(r.told()["members"] == "blue, red" for r in robots.values()), 30.0)
        for robot, player in [(red, red.play(30.0, 32.0)), (blue, blue.play(33.0, 35.0))]:
            robot.played(player)
        seen.runs += [robot.keyframes(folder) for robot in robots.values()]
        time.sleep(3.0)  # a robot that stands still tells the last of it after two seconds
        assert wait_for(lambda: all(robot.all_is_acknowledged() for robot in robots.values()), 20.0)
        assert wait_for(the_foreign_robot_is_answered, 20.0)  # though its topic is made of what was kept
        answer = listener.call(SaveMap, "fleet_server/save", path=str(seen.kept))
        assert answer.success, answer.message
        yield seen
    finally:
        for processes in (fleet, *(robot.processes for robot in robots.values())):
            processes.end()


def stamps_of_drives(path: Path) -> list[np.ndarray]:
    """Stamps of the keyframes of each drive in a map."""
    kept = load_map(path).keyframes
    assert kept is not None
    return [kept.stamps[kept.drives == drive] for drive in np.unique(kept.drives)]


def text(status: DiagnosticStatus | None) -> str:
    return "" if status is None else status.message


def test_nothing_is_lost_or_doubled_when_server_and_robots_are_started_again(seen: Seen) -> None:
    drives = [d for path in seen.kept.iterdir() for d in stamps_of_drives(path)]
    told = sorted((run.stamps for run in seen.runs), key=lambda stamps: stamps[0])
    assert len(drives) == len(told) == 3
    for kept, said in zip(sorted(drives, key=lambda stamps: stamps[0]), told, strict=True):
        np.testing.assert_allclose(kept, said, atol=1e-3)


def test_robots_that_meet_are_right_in_the_frame_that_they_share(seen: Seen) -> None:
    shared = []
    for robot in seen.robots.values():
        mine = zip(robot.common, robot.truth(), strict=False)
        shared.append([(placed.pose, true) for placed, true in mine if placed.frame == seen.frame])
        assert len(shared[-1]) >= 10
    poses, truth = map(np.array, zip(*(shared[0] + shared[1]), strict=True))
    off = align_first(poses, truth) - truth
    assert np.hypot(off[:, 0], off[:, 1]).max() < CLOSE


def test_a_pose_in_common_has_a_covariance_and_is_always_a_number(seen: Seen) -> None:
    for robot in seen.robots.values():
        assert np.isfinite([placed.pose for placed in robot.common]).all()
        assert np.linalg.eigvalsh([placed.covariance for placed in robot.common]).min() > 0.0


def test_the_transforms_lead_from_the_common_map_to_that_of_the_robot(seen: Seen) -> None:
    for name, robot in seen.robots.items():
        heard = [t for t in list(seen.server.transforms) if t.child_frame_id == f"{name}/map"]
        assert heard[-1].header.frame_id == seen.frame
        last = odometry_from(heard[-1], TRANSFORM).pose
        placed = robot.common[-1]
        (own,) = [pose for _, stamp, pose, _ in robot.observer.poses if stamp == placed.stamp]
        assert np.hypot(*(compose(last, own) - placed.pose)[:2]) < CLOSE


def test_rubbish_is_a_fault_in_the_diagnostics_and_nothing_else(seen: Seen) -> None:
    assert seen.server.said("refused in the last")
    assert "robots" in text(seen.server.latest("fleet_server: robots"))


def test_a_robot_whose_name_ros_has_no_topics_for_is_answered_also_after_a_restart(seen: Seen) -> None:
    assert {(answer.robot, answer.received) for answer in seen.foreign} == {("robot-1", 1)}


def test_common_maps_and_ways_are_drawn(seen: Seen) -> None:
    assert wait_for(lambda: bool(seen.markers) and set(seen.ways) == set(seen.robots), 10.0)
    drawn = {marker.ns: marker for marker in seen.markers[-1].markers}
    assert len(drawn[f"map {seen.number}: walls"].points) > 10
    assert {f"map {seen.number}: way of {name}" for name in seen.robots} <= set(drawn)
    assert all(len(way.poses) > 5 and way.header.frame_id == seen.frame for way in seen.ways.values())


def test_each_joint_is_told_with_its_evidence(seen: Seen) -> None:
    told = figures(seen.server.latest("fleet_server: joints"))
    assert told
    assert all("ties by" in evidence and "corners" in evidence for evidence in told.values())
