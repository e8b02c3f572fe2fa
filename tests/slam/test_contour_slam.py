"""The streaming object: any scan a lidar can send, stamps that misbehave, and the same answer every time."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, LidarConfig, SlamConfig
from contourslam.contour import Contours
from contourslam.detectors import DETECTORS, make_detector
from contourslam.errors import ConfigError
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose, transform
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.slam import ContourSlam, ScanUpdate

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose
Drive = Callable[..., list[Message]]

CORNERS = Config()
WALLS = Config(slam=SlamConfig(walls=True))


def push_all(slam: ContourSlam, messages: list[Message]) -> list[ScanUpdate]:
    updates = []
    for message in messages:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            updates.append(slam.push_scan(message))
    return updates


def start_of(messages: list[Message]) -> Floats:
    return next(m.pose for m in messages if isinstance(m, TruePose))


def run(config: Config, messages: list[Message], mount: Floats, **options: object) -> tuple[ContourSlam, list]:
    slam = ContourSlam(config, initial_pose=start_of(messages), lidar_mount=mount, **options)
    return slam, push_all(slam, messages)


def rmse(updates: list[ScanUpdate], messages: list[Message]) -> Floats:
    truth = np.array([m.pose for m in messages if isinstance(m, TruePose)])
    errors = np.array([u.pose for u in updates]) - truth
    errors[:, 2] = wrap(errors[:, 2])
    return np.sqrt(np.mean(errors**2, axis=0))


def same(first: ScanUpdate, second: ScanUpdate) -> bool:
    """Equal to the last bit."""
    arrays = ("pose", "covariance")
    return all(np.array_equal(getattr(first, n), getattr(second, n)) for n in arrays) and (
        replace(first, pose=None, covariance=None) == replace(second, pose=None, covariance=None)
    )


def with_scans(messages: list[Message], change: Callable[[int, LaserScan], LaserScan]) -> list[Message]:
    out: list[Message] = []
    count = 0
    for message in messages:
        if isinstance(message, LaserScan):
            out.append(change(count, message))
            count += 1
        else:
            out.append(message)
    return out


@pytest.mark.parametrize("config", [CORNERS, WALLS], ids=["corners", "walls"])
@pytest.mark.parametrize("association", ["nearest", "mahalanobis", "mutual", "joint"])
def test_the_pose_follows_the_truth_and_the_map_the_room(
    drive: Drive, mount: Floats, config: Config, association: str
) -> None:
    messages = drive()
    config = replace(config, slam=replace(config.slam, association=association))
    slam, updates = run(config, messages, mount)
    error = rmse(updates, messages)
    assert (error < [0.02, 0.02, 0.01]).all(), error
    corners = slam.corner_map()
    edge = np.array([1.2, -0.4])
    k = np.argmin(np.linalg.norm(corners.positions - edge, axis=1))
    np.testing.assert_allclose(corners.positions[k], edge, atol=0.03)
    assert corners.convex[k]
    assert math.cos(corners.directions[k] - math.pi / 4) > 0.99  # into the box
    assert corners.openings[k] == pytest.approx(math.pi / 2, abs=0.05)


@pytest.mark.parametrize("nothing", [math.inf, math.nan, 0.0, 60.0])
def test_scans_without_a_return_leave_the_pose_to_the_odometry(drive: Drive, mount: Floats, nothing: float) -> None:
    messages = with_scans(drive(30), lambda i, s: replace(s, ranges=np.full(s.ranges.size, nothing)) if i >= 15 else s)
    slam, updates = run(WALLS, messages, mount)
    before, after = updates[14], updates[-1]
    odometry = [m.pose for m in messages if isinstance(m, Odometry)]
    moved = between(odometry[14], odometry[-1])
    np.testing.assert_allclose(between(before.pose, after.pose), moved, atol=1e-9)
    assert np.linalg.det(after.covariance) > np.linalg.det(before.covariance)
    assert (after.corners, after.walls, after.matched, after.born, after.nis, after.nis_dof) == (0, 0, (), (), 0.0, 0)
    assert slam.corner_map().ids.size > 0


@pytest.mark.parametrize("beams", [0, 1, 2, 3])
def test_a_scan_of_hardly_a_beam_is_no_error(drive: Drive, mount: Floats, beams: int) -> None:
    def cut(i: int, scan: LaserScan) -> LaserScan:
        return LaserScan(
            scan.stamp, scan.angles[:beams], scan.ranges[:beams], scan.offsets[:beams], 0.05, 30.0
        ) if i % 2 else scan  # fmt: skip

    messages = with_scans(drive(40), cut)
    _, updates = run(WALLS, messages, mount)
    assert len(updates) == 40
    assert all(u.corners == 0 for u in updates[1::2])
    assert (rmse(updates, messages) < [0.03, 0.03, 0.02]).all()


def test_the_number_of_beams_may_change_from_scan_to_scan(drive: Drive, mount: Floats) -> None:
    messages = drive(beams=[360, 420, 377, 831, 500])
    _, updates = run(WALLS, messages, mount)
    assert (rmse(updates, messages) < [0.01, 0.01, 0.005]).all()


def shuffled(scan: LaserScan, order: NDArray[np.int64], shift: float = 0.0) -> LaserScan:
    return LaserScan(scan.stamp, scan.angles[order] + shift, scan.ranges[order], scan.offsets[order], 0.05, 30.0)


@pytest.mark.parametrize("how", ["clockwise", "wrapped in the middle", "counted from 0 to 360 degrees"])
def test_the_order_in_which_beams_come_does_not_matter(drive: Drive, mount: Floats, how: str) -> None:
    # The box goes at half time, so that what should have been seen is part of the comparison.
    messages = drive(60, box=lambda i: i < 30)

    def reorder(_: int, scan: LaserScan) -> LaserScan:
        n = scan.angles.size
        if how == "clockwise":
            return shuffled(scan, np.arange(n)[::-1])
        if how == "wrapped in the middle":
            return shuffled(scan, np.roll(np.arange(n), n // 3))
        return LaserScan(
            scan.stamp, np.roll(scan.angles, n // 2) % (2.0 * math.pi), np.roll(scan.ranges, n // 2), scan.offsets,
            0.05, 30.0,
        )  # fmt: skip

    slam, updates = run(WALLS, messages, mount)
    other, others = run(WALLS, with_scans(messages, reorder), mount)
    np.testing.assert_allclose([u.pose for u in others], [u.pose for u in updates], atol=2e-3)
    for first, second in ((slam.corner_map(), other.corner_map()), (slam.wall_map(), other.wall_map())):
        assert abs(len(first.ids) - len(second.ids)) <= 1
        assert abs(int(first.failed.sum()) - int(second.failed.sum())) <= 0.1 * first.failed.sum() + 5


def test_stamps_that_repeat_or_run_backwards_are_no_error(drive: Drive, mount: Floats) -> None:
    messages = drive(60)
    back = [
        replace(m, stamp=m.stamp - 3.0) if i > 90 and not isinstance(m, TruePose) else m for i, m in enumerate(messages)
    ]
    repeated = [replace(m, stamp=50.0 + 0.3 * ((m.stamp - 50.0) // 0.3)) for m in messages]
    for stamped in (back, repeated):
        _, updates = run(WALLS, stamped, mount)
        assert len(updates) == 60
        assert (rmse(updates, messages) < [0.05, 0.05, 0.05]).all()
        assert all(np.linalg.eigvalsh(u.covariance).min() > 0.0 for u in updates)


def test_without_odometry_the_robot_is_taken_to_stand(drive: Drive, mount: Floats) -> None:
    messages = drive(20, standing_from=0)
    scans = [m for m in messages if isinstance(m, LaserScan)]
    slam = ContourSlam(WALLS, lidar_mount=mount)
    updates = push_all(slam, scans)
    np.testing.assert_allclose(updates[-1].pose, 0.0, atol=0.005)
    assert slam.corner_map().ids.size >= 4
    np.testing.assert_array_equal(slam.odometry_pose, 0.0)


def test_odometry_that_begins_late_does_not_make_the_pose_jump(drive: Drive, mount: Floats) -> None:
    messages = drive(30, standing_from=0)
    late = [m for i, m in enumerate(messages) if not isinstance(m, Odometry) or i > 45]
    _, updates = run(WALLS, late, mount)
    poses = np.array([u.pose for u in updates])
    np.testing.assert_allclose(poses, np.broadcast_to(poses[0], poses.shape), atol=0.005)


def test_the_origin_of_the_odometry_does_not_count(drive: Drive, mount: Floats) -> None:
    messages = drive(40)
    origin = np.array([120.0, -45.0, 2.0])
    moved = [replace(m, pose=compose(origin, m.pose)) if isinstance(m, Odometry) else m for m in messages]
    _, updates = run(WALLS, messages, mount)
    _, others = run(WALLS, moved, mount)
    np.testing.assert_allclose([u.pose for u in others], [u.pose for u in updates], atol=1e-6)


@pytest.mark.parametrize("origin", [(10.0, -4.0, 1.0), (0.0, 0.0, math.pi), (-300.0, 200.0, -2.5)])
def test_the_map_moves_with_the_initial_pose(drive: Drive, mount: Floats, origin: tuple[float, ...]) -> None:
    messages = drive(40)
    first, updates = run(WALLS, messages, mount)
    T = np.array(origin)
    second = ContourSlam(WALLS, initial_pose=compose(T, start_of(messages)), lidar_mount=mount)
    others = push_all(second, messages)
    expected = compose(T, np.array([u.pose for u in updates]))
    poses = np.array([u.pose for u in others])
    np.testing.assert_allclose(poses[:, :2], expected[:, :2], atol=1e-5)
    np.testing.assert_allclose(wrap(poses[:, 2] - expected[:, 2]), 0.0, atol=1e-6)
    np.testing.assert_allclose(second.corner_map().positions, transform(T, first.corner_map().positions), atol=1e-5)
    np.testing.assert_allclose(second.wall_map().end_points, transform(T, first.wall_map().end_points), atol=1e-5)


def test_the_mount_of_the_configuration_serves_where_none_is_given(drive: Drive) -> None:
    messages = drive(20)
    config = replace(WALLS, lidar=LidarConfig(mount_x=0.1, mount_y=0.02, mount_yaw=0.01))
    by_config = push_all(ContourSlam(config), messages)
    by_argument = push_all(ContourSlam(WALLS, lidar_mount=np.array([0.1, 0.02, 0.01])), messages)
    assert all(same(a, b) for a, b in zip(by_config, by_argument, strict=True))


@pytest.mark.parametrize("config", [CORNERS, WALLS], ids=["corners", "walls"])
def test_two_runs_are_equal_to_the_last_bit(drive: Drive, mount: Floats, config: Config) -> None:
    messages = drive(60)
    first, updates = run(config, messages, mount)
    second, others = run(config, messages, mount)
    assert all(same(a, b) for a, b in zip(updates, others, strict=True))
    for name in ("positions", "covariances", "ids", "observed", "failed"):
        np.testing.assert_array_equal(getattr(first.corner_map(), name), getattr(second.corner_map(), name))
    np.testing.assert_array_equal(first.wall_map().end_points, second.wall_map().end_points)


def test_first_estimates_are_a_choice(drive: Drive, mount: Floats) -> None:
    messages = drive(60)
    poses = {}
    for first_estimates in (True, False):
        config = replace(WALLS, slam=replace(WALLS.slam, first_estimates=first_estimates))
        _, updates = run(config, messages, mount)
        assert (rmse(updates, messages) < [0.01, 0.01, 0.005]).all()
        poses[first_estimates] = np.array([u.pose for u in updates])
    assert np.abs(poses[True] - poses[False]).max() > 1e-9


@pytest.mark.parametrize("slip", [(0.3, 0.0, 0.0), (-0.2, 0.25, 0.0), (0.0, 0.1, 0.12), (0.5, 0.3, 0.1)])
def test_a_slip_of_the_wheels_is_survived(drive: Drive, mount: Floats, slip: tuple[float, ...]) -> None:
    # From the 40th scan on the wheels are off by a step that never happened.
    messages = drive(70)
    wheels = [m.pose for m in messages if isinstance(m, Odometry)]
    false = compose(compose(wheels[40], np.array(slip)), between(wheels[40], np.zeros(3)))
    slipped = [
        replace(m, pose=compose(false, m.pose)) if isinstance(m, Odometry) and i >= 120 else m
        for i, m in enumerate(messages)
    ]
    _, updates = run(WALLS, slipped, mount)
    assert len(updates[40].matched) > 0.5 * (updates[40].corners + updates[40].walls)
    assert (rmse(updates[40:], messages[120:]) < [0.03, 0.03, 0.01]).all()


@pytest.mark.parametrize("name", DETECTORS)
def test_every_detector_localises(drive: Drive, mount: Floats, name: str) -> None:
    messages = drive(60)
    _, updates = run(replace(CORNERS, detector=name), messages, mount)
    assert (rmse(updates, messages) < [0.03, 0.03, 0.02]).all()
    assert sum(u.corners for u in updates) > 100


class Blind:
    """Finds nothing; keeps the contract without inheriting anything."""

    equalized = True
    threshold = 0.5

    def __init__(self) -> None:
        self.asked = 0

    def respond(self, contours: Contours) -> Floats:
        self.asked += 1
        return np.zeros(len(contours.points))

    def reach(self, contours: Contours) -> int:
        return 3


class Borrowing(Blind):
    """Answers as the matched filter does, under another name."""

    def __init__(self) -> None:
        super().__init__()
        self.inner = make_detector("matched_filter")
        self.threshold = self.inner.threshold

    def respond(self, contours: Contours) -> Floats:
        return self.inner.respond(contours)

    def reach(self, contours: Contours) -> int:
        return self.inner.reach(contours)


def test_a_detector_object_of_ones_own_takes_the_place_of_the_configured_one(drive: Drive, mount: Floats) -> None:
    messages, blind = drive(20), Blind()
    _, updates = run(CORNERS, messages, mount, detector=blind)
    assert blind.asked == 20
    assert not any(u.corners for u in updates)
    _, borrowed = run(replace(CORNERS, detector="not asked for"), messages, mount, detector=Borrowing())
    _, own = run(CORNERS, messages, mount)
    assert all(same(a, b) for a, b in zip(borrowed, own, strict=True))


def test_a_detector_that_does_not_exist_is_refused() -> None:
    with pytest.raises(ConfigError, match="matched_filter"):
        ContourSlam(Config(detector="harris"))


def test_odometry_that_comes_late_by_its_stamps_is_read_earlier(drive: Drive, mount: Floats) -> None:
    # The driver stamps each reading 0.25 s too early: the scan at t belongs to the reading stamped t - 0.25.
    messages = drive(60)
    shifted = [replace(m, stamp=m.stamp - 0.25) if isinstance(m, Odometry) else m for m in messages]
    _, updates = run(CORNERS, messages, mount)
    config = replace(CORNERS, slam=replace(CORNERS.slam, odometry_lag=0.25))
    _, others = run(config, shifted, mount)
    np.testing.assert_allclose([u.pose for u in others], [u.pose for u in updates], atol=1e-9)


def test_a_removed_boxs_corners_are_dropped_and_the_rooms_are_kept(drive: Drive, mount: Floats) -> None:
    config = replace(CORNERS, slam=SlamConfig(min_chances=20, max_false_negative_rate=0.5))
    messages = drive(150, box=lambda i: i < 15, standing_from=5)
    slam, updates = run(config, messages, mount)
    born = {i for u in updates[:16] for i in u.born}
    left = slam.corner_map()
    box = np.array([[1.2, -0.4], [1.2, 0.6]])
    dropped = {i for u in updates for i in u.dropped}
    assert dropped <= born
    assert dropped
    assert np.linalg.norm(left.positions[:, None] - box, axis=2).min() > 0.3
    assert len(left.ids) >= 4
    assert not dropped & set(left.ids.tolist())
    for update in updates[60:]:
        assert not set(update.matched) & dropped


def test_a_map_that_matches_the_world_has_few_false_negatives(drive: Drive, mount: Floats) -> None:
    slam, _ = run(WALLS, drive(100), mount)
    for landmarks in (slam.corner_map(), slam.wall_map()):
        assert landmarks.observed.sum() > 300
        assert landmarks.failed.sum() < 0.1 * landmarks.observed.sum()


def test_ids_of_an_update_tell_one_story(drive: Drive, mount: Floats) -> None:
    alive: set[int] = set()
    ever: set[int] = set()
    slam, updates = run(WALLS, drive(100, box=lambda i: i % 40 < 20), mount)
    for update in updates:
        assert set(update.matched) <= alive
        assert set(update.missed) <= alive
        assert not set(update.matched) & set(update.missed)
        assert not set(update.born) & ever
        assert set(update.dropped) <= alive | set(update.born)
        assert update.nis_dof == 2 * len(update.matched)
        alive = (alive | set(update.born)) - set(update.dropped)
        ever |= set(update.born)
    assert alive == set(slam.corner_map().ids.tolist()) | set(slam.wall_map().ids.tolist())


def test_each_stage_is_told_once_a_scan(drive: Drive, mount: Floats) -> None:
    told: list[str] = []
    run(WALLS, drive(5), mount, lap=told.append)
    assert {told.count(stage) for stage in set(told)} == {5}
    assert {"contour", "detection", "refinement", "association", "correction"} <= set(told)


def test_what_an_update_holds_does_not_change_with_the_next_scan(drive: Drive, mount: Floats) -> None:
    messages = drive(20)
    slam = ContourSlam(CORNERS, initial_pose=start_of(messages), lidar_mount=mount)
    update = push_all(slam, messages[:30])[-1]
    pose, covariance = update.pose.copy(), update.covariance.copy()
    push_all(slam, messages[30:])
    np.testing.assert_array_equal(update.pose, pose)
    np.testing.assert_array_equal(update.covariance, covariance)
