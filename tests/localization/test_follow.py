"""A robot followed in a map from another drive: found, kept, lost and found again, and never believed elsewhere."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.errors import MapError
from contourslam.evaluation.consistency import nees
from contourslam.evaluation.errors import pose_errors
from contourslam.geometry.poses import compose, inverse
from contourslam.localization.follow import Localizer
from contourslam.localization.known_map import KnownMap
from contourslam.localization.locate import NOT_FOUND, Locator
from contourslam.localization.posterior import Located
from contourslam.localization.view import View
from contourslam.maps import SavedMap
from contourslam.scan import LaserScan, Odometry, TruePose

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.graph import GraphSlam, kept
from contourslam.robot.route import sample_route
from contourslam.simulation.buildings import Building
from contourslam.simulation.chance import FLAWS, stream
from contourslam.simulation.config import LidarModel
from contourslam.simulation.follower import Habits
from contourslam.simulation.gliding import Tick, glide
from contourslam.simulation.long_drive import LongDrive
from contourslam.simulation.pieces import Box
from contourslam.simulation.room import Room
from contourslam.simulation.rooms import ROOMS

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose

ROOM = ROOMS["furnished_room"]
LIDAR = LidarModel(samples_per_second=3600.0, turn_rate=10.0)
MOUNT = np.array([LIDAR.mount_x, 0.0, 0.0])
CONFIG = Config(back_end="graph")
PER_SECOND = 10  # scans


class Lap(LongDrive):
    """A drive round the route of a room, from somewhere on it."""

    def ticks(self) -> Iterator[Tick]:
        chance, route, driven = stream(self.seed, FLAWS), sample_route(self.building.room.route), 0.0
        first = int(chance.integers(0, len(route)))
        way = [
            tuple((route[(first + k) % len(route)] + chance.uniform(-0.08, 0.08, 2)).tolist())
            for k in range(0, int(100 * self.length) + 200, 40)
        ]
        for tick in glide(way, Habits(self.speed, 0.1, 20.0, 1.0)):
            yield tick
            driven += tick.advance
            if driven >= self.length:
                return


@cache
def drive(seed: int, length: float = 10.0, room: Room = ROOM) -> tuple[Message, ...]:
    return tuple(Lap(Building(room, {}, {}), length, seed, 0.4, LIDAR).messages())


def first_pose(messages: Iterable[Message]) -> Floats:
    return next(m.pose for m in messages if isinstance(m, TruePose))


@cache
def mapped(seed: int = 100) -> SavedMap:
    messages = drive(seed, 22.0)
    slam = GraphSlam(CONFIG, initial_pose=first_pose(messages), lidar_mount=MOUNT)
    for message in messages:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            slam.push_scan(message)
    slam.finish()
    return kept(slam, {})


@cache
def finder(seed: int = 100) -> Locator:
    return Locator(KnownMap(mapped(seed)))


class Nobody:
    """Finds nothing."""

    def find(self, view: View) -> Located:
        return NOT_FOUND


def localizer(pose: Floats | None = None, saved: SavedMap | None = None) -> Localizer:
    look = finder() if saved is None else Nobody()
    return Localizer(saved or mapped(), CONFIG, finder=look, initial_pose=pose, lidar_mount=MOUNT)


@dataclass(frozen=True)
class Way:
    """What a localiser said at each scan, and the truth."""

    poses: Floats
    covariances: Floats
    truth: Floats
    quality: Floats
    localized: NDArray[np.bool_]

    @property
    def off(self) -> Floats:
        """Distance from the true place, m."""
        return np.hypot(*(self.poses - self.truth)[:, :2].T)

    @property
    def rmse(self) -> float:
        """Of the place, while localised, m."""
        return float(np.sqrt(np.mean(self.off[self.localized] ** 2)))

    def nees(self) -> Floats:
        return nees(pose_errors(self.poses, self.truth), self.covariances)


def follow(robot: Localizer, messages: Iterable[Message]) -> Way:
    said, truth, localized, true = [], [], [], np.zeros(3)
    for message in messages:
        if isinstance(message, TruePose):
            true = message.pose
        elif isinstance(message, Odometry):
            robot.push_odometry(message)
        else:
            said.append(robot.push_scan(message))
            truth.append(true)
            localized.append(robot.localized)
            np.testing.assert_allclose(said[-1].covariance, said[-1].covariance.T, rtol=1e-9)
            assert np.linalg.eigvalsh(said[-1].covariance)[0] > 0.0
    return Way(
        np.array([u.pose for u in said]),
        np.array([u.covariance for u in said]),
        np.array(truth),
        np.array([u.quality for u in said]),
        np.array(localized),
    )


def carried_off(messages: Iterable[Message], first: int, last: int) -> Iterator[Message]:
    """The drive without the scans from `first` to `last`, while the wheels stand still and time goes on."""
    scans, held = 0, np.zeros(3)
    origin: Floats | None = None
    for message in messages:
        scans += isinstance(message, LaserScan)
        carried = first <= scans < last
        if isinstance(message, TruePose):
            yield message
        elif isinstance(message, LaserScan):
            if not carried:
                yield message
        elif carried:
            yield replace(message, pose=held)
        else:
            if scans >= last and origin is None:
                origin = compose(held, inverse(message.pose))
            held = message.pose if origin is None else compose(origin, message.pose)
            yield replace(message, pose=held)


def refurnished(part: float, seed: int, shift: float = 0.4) -> Room:
    """The room with a part of its furniture moved and turned."""
    chance, pieces = np.random.default_rng(seed), []
    for piece in ROOM.pieces:
        if chance.random() < part and piece.x > 0.31:
            x, y = np.clip(np.array([piece.x, piece.y]) + chance.uniform(-shift, shift, 2), 0.4, [7.6, 5.6]).tolist()
            piece = replace(piece, x=x, y=y)
            if isinstance(piece, Box):
                piece = replace(piece, yaw_deg=piece.yaw_deg + chance.uniform(-40.0, 40.0))
        pieces.append(piece)
    return replace(ROOM, pieces=tuple(pieces))


def test_told_about_where_it_is_the_robot_is_followed_to_millimetres() -> None:
    messages = drive(200)
    way = follow(localizer(first_pose(messages) + np.array([0.3, -0.2, 0.15])), messages)
    assert way.localized[3:].all()
    assert way.rmse < 0.01
    assert (way.quality[3:] > 0.9).all()


@pytest.mark.parametrize("seed", [201, 202])
def test_told_nothing_the_robot_finds_itself_within_a_second_and_says_so_only_then(seed: int) -> None:
    way = follow(localizer(), drive(seed))
    found = int(np.argmax(way.localized))
    assert 0 < found < PER_SECOND
    assert way.localized[found:].all()
    assert way.off[found:].max() < 0.03
    assert (way.quality[:found] == 0.0).all()
    assert way.covariances[0, 0, 0] + way.covariances[0, 1, 1] > 4.0
    assert way.covariances[0, 2, 2] > 3.0


def test_the_stated_covariance_holds_against_the_truth() -> None:
    values = []
    for k in range(3):
        finder_of_map = Locator(KnownMap(mapped(100 + k)))
        for seed in (210 + k, 211 + k):
            messages = drive(seed)
            robot = Localizer(
                mapped(100 + k), CONFIG, finder=finder_of_map, initial_pose=first_pose(messages), lidar_mount=MOUNT
            )
            values.append(follow(robot, messages).nees()[10:].mean())
    assert 1.0 < np.mean(values) < 6.0
    assert max(values) < 12.0


def test_carried_away_the_robot_is_right_again_within_two_seconds() -> None:
    messages = list(carried_off(drive(200, 14.0), 120, 220))
    way = follow(localizer(first_pose(messages)), messages)
    down = 119
    assert np.hypot(*(way.truth[down] - way.truth[down - 1])[:2]) > 1.0
    assert way.off[down] > 0.5
    assert way.off[down + 2 * PER_SECOND :].max() < 0.05
    assert way.localized[down + 2 * PER_SECOND :].all()
    wrong = (way.off > 0.1) & way.localized
    assert wrong.sum() <= 8
    assert (way.quality[wrong] < 0.5).all()


def test_without_odometry_for_five_seconds_the_robot_stays_localised() -> None:
    messages = [m for m in drive(200) if not (isinstance(m, Odometry) and 8.0 < m.stamp < 13.0)]
    way = follow(localizer(first_pose(messages)), messages)
    assert way.localized[3:].all()
    assert way.off[3:].max() < 0.05


def test_without_any_odometry_scans_are_undone_the_motion_that_the_map_shows() -> None:
    messages = [m for m in drive(200) if not isinstance(m, Odometry)]
    way = follow(localizer(first_pose(messages)), messages)
    assert way.localized[3:].all()
    assert way.rmse < 0.01  # 20 mm where a scan is taken as if the robot stood still


@pytest.mark.parametrize("fault", ["odometry_begins_late", "scans_stop", "all_stops", "time_runs_back"])
def test_what_a_recording_can_throw_at_it_leaves_the_robot_where_it_is(fault: str) -> None:
    messages = drive(200)
    late = {
        "odometry_begins_late": [m for m in messages if not (isinstance(m, Odometry) and m.stamp < 8.0)],
        "scans_stop": [m for m in messages if not (isinstance(m, LaserScan) and 8.0 < m.stamp < 13.0)],
        "all_stops": [m for m in messages if not 8.0 < m.stamp < 13.0],
        "time_runs_back": [*(m for m in messages if m.stamp < 12.0), *messages],
    }[fault]
    way = follow(localizer(first_pose(messages)), late)
    assert way.localized[-PER_SECOND:].all()
    assert way.localized[3:].mean() > 0.9
    assert way.rmse < 0.02


def test_wheels_that_stall_or_spin_do_not_pull_the_robot_along() -> None:
    slip, seen = np.array([0.3, 0.0, 0.2]), 0
    messages: list[Message] = []
    for message in drive(200):
        seen += isinstance(message, LaserScan)
        wheels = np.zeros(3) if seen < 80 else slip  # they spin once
        messages.append(
            replace(message, pose=compose(message.pose, wheels)) if isinstance(message, Odometry) else message
        )
    way = follow(localizer(first_pose(messages)), messages)
    assert way.localized[3:].all()
    assert way.off[3:].max() < 0.05


@pytest.mark.parametrize(("part", "seed"), [(0.2, 1), (0.5, 0), (0.5, 1)])
def test_moved_furniture_lowers_the_quality_and_moves_nothing(part: float, seed: int) -> None:
    messages = drive(300 + seed, room=refurnished(part, seed))
    way = follow(localizer(first_pose(messages)), messages)
    assert way.localized[3:].all()
    assert way.off[3:].max() < 0.03
    assert way.quality[3:].min() < 0.95


@pytest.mark.parametrize("name", ["office_corridor", "large_hall"])
@pytest.mark.parametrize("told", [False, True])
def test_in_another_building_the_robot_is_never_believed_to_be_found(name: str, told: bool) -> None:
    messages = drive(400, room=ROOMS[name])
    way = follow(localizer(np.array([4.0, 2.0, 0.0]) if told else None), messages)
    assert not way.localized.any()
    assert (way.quality == 0.0).all()


def test_scans_that_show_nothing_leave_the_robot_to_its_wheels() -> None:
    messages: list[Message] = []
    for message in drive(200):
        blind = isinstance(message, LaserScan) and 8.0 < message.stamp < 9.0
        messages.append(replace(message, ranges=np.full(message.ranges.shape, np.inf)) if blind else message)
    way = follow(localizer(first_pose(messages)), messages)
    sigma = np.sqrt(np.trace(way.covariances[:, :2, :2], axis1=1, axis2=2))
    assert sigma[89] > 3.0 * sigma[79]
    assert way.off[3:].max() < 0.15
    assert way.off[-20:].max() < 0.02


def test_a_robot_outside_of_the_map_goes_on_by_itself_and_comes_back() -> None:
    whole = mapped()
    frames = whole.keyframes
    assert frames is not None
    # A map that ends in the middle of the room: what lies beyond was never seen.
    kept_points = [frames.contour(k)[_left(frames.contour(k), frames.poses[k])] for k in range(len(frames))]
    starts = np.cumsum([0, *map(len, kept_points)])
    half = replace(whole, keyframes=replace(frames, starts=starts, points=np.concatenate(kept_points)))
    messages = drive(202, 24.0)
    start = next(i for i, m in enumerate(messages) if isinstance(m, TruePose) and m.pose[0] < 2.5)
    messages = messages[start:]
    way = follow(localizer(first_pose(messages), half), messages)
    assert (way.truth[:, 0] > 6.0).any()
    assert way.off[2:].max() < 0.15
    assert way.localized[-1] or way.truth[-1, 0] > 4.0


def _left(points: NDArray[np.float32], pose: Floats) -> NDArray[np.bool_]:
    x = pose[0] + math.cos(pose[2]) * points[:, 0] - math.sin(pose[2]) * points[:, 1]
    return np.asarray(x < 4.5)


def test_a_map_of_walls_alone_is_followed_too() -> None:
    messages = drive(200)
    robot = localizer(first_pose(messages), replace(mapped(), keyframes=None))
    way = follow(robot, messages)
    assert way.localized[5:].mean() > 0.9
    assert way.rmse < 0.03


def test_a_map_of_nothing_is_refused() -> None:
    whole = mapped()
    nothing = replace(
        whole,
        keyframes=None,
        walls=replace(whole.walls, **{name: getattr(whole.walls, name)[:0] for name in whole.walls.__slots__}),
    )
    with pytest.raises(MapError, match="neither contours nor walls"):
        localizer(np.zeros(3), nothing)


def test_corners_and_walls_of_the_map_are_named_when_seen() -> None:
    messages, robot = drive(200), localizer(first_pose(drive(200)))
    seen: list[tuple[int, ...]] = []
    detected = 0
    for message in messages:
        if isinstance(message, Odometry):
            robot.push_odometry(message)
        elif isinstance(message, LaserScan):
            update = robot.push_scan(message)
            detected += update.corners + update.walls
            seen.append(update.matched)
    known = {*mapped().corners.ids.tolist(), *mapped().walls.ids.tolist()}
    named = [number for ids in seen for number in ids]
    assert set(named) <= known
    assert len(named) > 0.7 * detected > 20


def test_started_over_the_robot_is_looked_for_again() -> None:
    messages = drive(200)
    robot = localizer(first_pose(messages))
    follow(robot, messages[: len(messages) // 2])
    assert robot.localized
    robot.start_over()
    assert not robot.localized
    way = follow(robot, messages[len(messages) // 2 :])
    assert way.localized[PER_SECOND:].all()
    assert way.off[PER_SECOND:].max() < 0.03


def test_the_map_stays_as_it_is() -> None:
    before = mapped().keyframes
    assert before is not None
    points, poses = before.points.copy(), before.poses.copy()
    robot = localizer(first_pose(drive(200)))
    follow(robot, drive(200)[:200])
    assert robot.corner_map() is mapped().corners
    assert robot.wall_map() is mapped().walls
    assert robot.finish() is None
    np.testing.assert_array_equal(before.points, points)
    np.testing.assert_array_equal(before.poses, poses)


@pytest.mark.parametrize("told", [False, True])
def test_where_the_drive_began_is_known_once_the_robot_is_found(told: bool) -> None:
    messages = drive(201)
    robot = localizer(first_pose(messages) + np.array([0.3, -0.2, 0.15]) if told else None)
    way = follow(robot, messages)
    np.testing.assert_allclose(robot.start_pose, way.truth[0], atol=0.03)
