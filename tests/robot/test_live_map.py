"""The map of a drive that goes on, and the drive itself, fed with a simulated one's messages."""

import math
import time
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, LiveConfig, MotionConfig, SlamConfig
from contourslam.errors import RecordingError
from contourslam.geometry.poses import compose
from contourslam.live.processed import Processed
from contourslam.live.session import Session
from contourslam.recordings import RecordingWriter, open_recording
from contourslam.recordings.picture import Picture
from contourslam.replay import replay
from contourslam.robot.base.odometry import BaseOdometry
from contourslam.robot.base.states import BaseState
from contourslam.robot.bring_up import Openers, Robot, Trouble
from contourslam.robot.config import BaseConfig, LidarPart, RobotConfig
from contourslam.robot.journey import Journey, looks_around
from contourslam.robot.live_map import LiveMap, settings_of
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import SimulatedRun, simulate

ROBOT = RobotConfig()
SETTINGS = settings_of(ROBOT, Config(slam=SlamConfig(walls=True, contour_matching=True)))
JPEG = b"\xff\xd8\xff" + b"\xff\xd9"


@pytest.fixture(scope="module")
def run() -> SimulatedRun:
    return simulate(ROOMS["furnished_room"], SimulationConfig(duration=6.0), 1)


def live_map(run: SimulatedRun) -> LiveMap:
    patient = LiveConfig(max_waiting=1000)  # all comes at once here
    return LiveMap(SETTINGS, patient, lidar_mount=ROBOT.lidar.mount, initial_pose=run.initial_pose)


def settled(made: LiveMap, scans: int) -> None:
    until = time.monotonic() + 30.0
    while len(made.latencies) < scans and time.monotonic() < until:
        time.sleep(0.02)


def state(reading: Odometry, speed: float = 0.0) -> BaseState:
    odometry = BaseOdometry(reading.stamp, reading.pose, np.eye(3), speed, 0.0, np.eye(2), False)
    return BaseState(reading.stamp, (0, 0), (0.0, 0.0), (0.0, 0.0), None, None, None, None, (0.0, 0.0), 0, odometry)


def test_a_live_map_gives_the_poses_of_a_recording_and_a_whole_run(run: SimulatedRun) -> None:
    messages = [m for m in run.messages() if isinstance(m, LaserScan | Odometry)]
    made, scans = live_map(run), sum(isinstance(m, LaserScan) for m in messages)
    assert made.pose() is None and made.last is None
    for message in messages:
        made.push(message)
    settled(made, scans - 1)
    made.close()
    result = made.result({"lidar: unplugged": 1})
    replayed = replay(messages, SETTINGS, initial_pose=run.initial_pose, lidar_mount=ROBOT.lidar.mount)
    count = len(result.stamps)
    assert count >= scans - 1  # the last one may have waited for odometry that no longer came
    assert np.array_equal(result.poses, replayed.poses[:count])
    assert np.allclose(result.odometry, replayed.odometry[:count])
    assert result.readings is not None and len(result.readings.stamps) == len(messages) - scans
    assert result.skipped == {"lidar: unplugged": 1} and result.complete
    pose = made.pose()
    assert pose is not None
    assert np.abs(np.array(pose) - run.truth(result.readings.stamps[-1:])[0]).max() < 0.05


def test_a_robot_that_is_only_watched_is_followed_and_keeps_nothing(run: SimulatedRun) -> None:
    taken: list[float] = []
    begun: list[tuple[object, float]] = []

    class Watching:
        def take(self, processed: Processed) -> None:
            taken.append(processed.stamp)

        def rest(self) -> None:
            """Nothing."""

    def follow(session: Session, mount: NDArray[np.float64]) -> Watching:
        begun.append((session, float(mount[0])))
        return Watching()

    patient = LiveConfig(max_waiting=1000)
    made = LiveMap(SETTINGS, patient, lidar_mount=ROBOT.lidar.mount, onlooker=follow, keeps=False)
    messages = [m for m in run.messages() if isinstance(m, LaserScan | Odometry)]
    for message in messages:
        made.push(message)
    until, scans = time.monotonic() + 30.0, sum(isinstance(m, LaserScan) for m in messages)
    while len(taken) < scans - 1 and time.monotonic() < until:
        time.sleep(0.02)
    made.close()
    assert begun == [(made.session, ROBOT.lidar.x)]
    assert len(taken) >= scans - 1 and made.last is not None and made.last.stamp == taken[-1]
    assert made.pose() is not None
    assert made.latencies.size == 0 and made.result().stamps.size == 0  # what would grow with every scan


def test_the_mapping_is_told_what_the_robot_is() -> None:
    robot = RobotConfig(BaseConfig(wheel_sigma=0.02), LidarPart(x=0.2, y=-0.1, yaw_deg=90.0))
    made = settings_of(robot, Config())
    assert made.lidar.mount == pytest.approx((0.2, -0.1, math.pi / 2))
    assert made.lidar.max_range == 10.0
    assert made.slam.motion.forward_per_sqrt_m == 0.02
    own = Config(slam=SlamConfig(motion=MotionConfig(forward_per_sqrt_m=0.3)))
    assert settings_of(robot, own).slam.motion == own.slam.motion
    wheels = settings_of(RobotConfig(BaseConfig(use_gyro=False)), Config()).slam.motion
    assert wheels.turn_per_sqrt_rad_deg > made.slam.motion.turn_per_sqrt_rad_deg


def test_a_scan_that_sees_next_to_nothing_is_not_mapped(run: SimulatedRun) -> None:
    scan = next(m for m in run.messages() if isinstance(m, LaserScan))
    assert looks_around(scan)
    ranges = np.where(np.abs(scan.angles) < 0.8, scan.ranges, np.nan)
    assert not looks_around(LaserScan(scan.stamp, scan.angles, ranges, scan.offsets, scan.range_min, scan.range_max))


def test_a_journey_maps_and_records_all_that_comes(run: SimulatedRun, tmp_path: Path) -> None:
    made = live_map(run)
    with RecordingWriter(tmp_path / "bag") as writer:
        journey = Journey(Robot(Openers()), made, writer)
        for message in run.messages():
            if isinstance(message, LaserScan):
                journey.take(message)
            elif isinstance(message, Odometry):
                journey.take(state(message))
        journey.take(Picture(6.0, JPEG, "jpeg"))
        journey.take(Trouble(6.0, "camera", "it is gone"))
    settled(made, journey.scans - 1)
    made.close()
    assert journey.scans == len(run.scans) and journey.pictures == 1
    assert [trouble.message for trouble in journey.troubles] == ["it is gone"]
    recording = open_recording(tmp_path / "bag")
    assert sum(isinstance(m, LaserScan) for m in recording.messages()) == journey.scans
    assert len(list(recording.pictures())) == 1
    assert journey.sight().pose is None  # the base said its last word long ago


def test_where_the_robot_is_now_goes_on_from_the_bases_last_word(run: SimulatedRun) -> None:
    made, now = live_map(run), time.time()
    journey = Journey(Robot(Openers()), made)
    scan = run.scans[0]
    journey.take(state(Odometry(now - 0.4, np.zeros(3))))
    journey.take(LaserScan(now - 0.4, scan.angles, scan.ranges, np.zeros_like(scan.offsets), 0.1, 30.0))
    journey.take(state(Odometry(now - 0.2, np.zeros(3)), speed=0.5))
    settled(made, 1)
    sight = journey.sight()
    made.close()
    assert sight.pose is not None and sight.sigma < 0.05
    gone = np.hypot(*(np.array(sight.pose) - run.initial_pose)[:2])
    assert gone == pytest.approx(0.5 * (time.time() - now + 0.2), abs=0.05)


def test_a_mapping_that_stands_still_leaves_the_robot_blind(run: SimulatedRun) -> None:
    ahead = [0.0]
    made = LiveMap(SETTINGS, LiveConfig(), lidar_mount=ROBOT.lidar.mount, clock=lambda: time.monotonic() + ahead[0])
    journey = Journey(Robot(Openers()), made)
    for message in run.messages():
        if isinstance(message, LaserScan | Odometry) and journey.scans < 3:
            journey.take(message if isinstance(message, LaserScan) else state(message))
    settled(made, 2)
    assert journey.sight().blind < 4.0
    ahead[0] = 5.0
    assert journey.sight().blind > 4.0
    made.close()


def test_odometry_that_leaps_hides_the_pose_until_the_map_has_taken_it_in(run: SimulatedRun) -> None:
    made, leap = live_map(run), np.array([3.0, -2.0, 0.0])
    messages = [m for m in run.messages() if isinstance(m, LaserScan | Odometry)]
    half = len(messages) // 2
    for message in messages[:half]:
        made.push(message)
    settled(made, 5)
    assert made.pose() is not None
    later = [Odometry(m.stamp, compose(leap, m.pose)) if isinstance(m, Odometry) else m for m in messages[half:]]
    begun = next(at for at, message in enumerate(later, 1) if isinstance(message, Odometry))
    for message in later[:begun]:
        made.push(message)
    assert made.pose() is None
    for message in later[begun:]:
        made.push(message)
    until = time.monotonic() + 30.0
    while made.pose() is None and time.monotonic() < until:
        time.sleep(0.02)
    assert made.pose() is not None
    made.close()


def test_a_recording_that_fails_is_told_once_and_ends_nothing_else(run: SimulatedRun) -> None:
    class Full:
        calls = 0

        def write(self, message: object) -> None:
            self.calls += 1
            raise RecordingError("the disk is full")

    made, full = live_map(run), Full()
    journey = Journey(Robot(Openers()), made, full)  # type: ignore[arg-type]  # a writer that only fails
    for scan in run.scans[:5]:
        journey.take(scan)
    made.close()
    assert full.calls == 1 and journey.scans == 5
    assert [trouble.part for trouble in journey.troubles] == ["recording"]


def test_the_motors_stop_when_the_journey_ends_by_an_error(run: SimulatedRun) -> None:
    made, robot = live_map(run), Robot(Openers())
    stops: list[int] = []
    robot.stop = lambda: stops.append(1)  # type: ignore[method-assign]  # to see that it is called
    with pytest.raises(ZeroDivisionError):
        Journey(robot, made).go(lambda sight, dt: (1 / 0, 0.0), lambda: False)
    made.close()
    assert stops
