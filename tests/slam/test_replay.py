"""A recording replayed: the same as streaming, and nothing lost where it breaks off or is interrupted."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, SlamConfig
from contourslam.errors import RecordingError
from contourslam.geometry.poses import between, compose
from contourslam.replay import BLIND, replay
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.slam import ContourSlam, RunResult, ScanUpdate

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose
Drive = Callable[..., list[Message]]

CONFIG = Config(slam=SlamConfig(walls=True))
ROWS = ("stamps", "poses", "covariances", "odometry", "nis", "nis_dof", "matched_count", "corner_count", "wall_count")


def scans_in(messages: list[Message]) -> list[LaserScan]:
    return [m for m in messages if isinstance(m, LaserScan)]


def assert_whole(result: RunResult, scans: int) -> None:
    for name in ROWS:
        assert len(getattr(result, name)) == scans, name
    assert result.truth is None or len(result.truth) == scans
    assert result.poses.shape == result.odometry.shape == (scans, 3)
    assert result.covariances.shape == (scans, 3, 3)


def breaking_off(messages: list[Message], scans: int, error: BaseException) -> Iterator[Message]:
    """The messages up to so many scans, then the error."""
    for message in messages:
        if isinstance(message, LaserScan):
            if scans == 0:
                raise error
            scans -= 1
        yield message
    raise error


def test_streaming_equals_replay_to_the_last_bit(drive: Drive, mount: Floats) -> None:
    messages = drive(60)
    start = next(m.pose for m in messages if isinstance(m, TruePose))
    slam = ContourSlam(CONFIG, initial_pose=start, lidar_mount=mount)
    updates, told = [], []
    for message in messages:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            updates.append(slam.push_scan(message))
    result = replay(messages, CONFIG, lidar_mount=mount, on_scan=lambda scan, update: told.append((scan, update)))
    assert_whole(result, 60)
    np.testing.assert_array_equal(result.poses, [u.pose for u in updates])
    np.testing.assert_array_equal(result.covariances, [u.covariance for u in updates])
    np.testing.assert_array_equal(result.nis, [u.nis for u in updates])
    np.testing.assert_array_equal(result.matched_count, [len(u.matched) for u in updates])
    np.testing.assert_array_equal(result.corner_map.positions, slam.corner_map().positions)
    np.testing.assert_array_equal(result.wall_map.end_points, slam.wall_map().end_points)
    assert [scan for scan, _ in told] == scans_in(messages)
    assert [update.stamp for _, update in told] == result.stamps.tolist()
    assert result.complete
    assert result.skipped == {}
    assert result.detector == "matched_filter"
    assert min(result.seconds.values()) > 0.0


def test_a_generator_is_read_once_and_a_list_may_be_read_again(drive: Drive, mount: Floats) -> None:
    messages = drive(20)
    once = replay((m for m in messages), CONFIG, lidar_mount=mount)
    again = replay(messages, CONFIG, lidar_mount=tuple(mount))
    np.testing.assert_array_equal(once.poses, again.poses)


def test_the_true_pose_is_where_the_run_starts(drive: Drive, mount: Floats) -> None:
    messages = drive(20)
    result = replay(messages, CONFIG, lidar_mount=mount)
    truth = np.array([m.pose for m in messages if isinstance(m, TruePose)])
    np.testing.assert_array_equal(result.poses[0], truth[0])
    np.testing.assert_allclose(result.truth, truth, atol=1e-12)
    given = replay(messages, CONFIG, lidar_mount=mount, initial_pose=np.array([4.0, 5.0, 0.5]))
    np.testing.assert_array_equal(given.poses[0], [4.0, 5.0, 0.5])
    blind = replay([m for m in messages if not isinstance(m, TruePose)], CONFIG, lidar_mount=mount)
    np.testing.assert_array_equal(blind.poses[0], 0.0)
    assert blind.truth is None


def test_the_true_pose_at_the_first_scan_is_taken_between_two_readings(drive: Drive, mount: Floats) -> None:
    messages = drive(10)
    first = scans_in(messages)[0]
    poses = [
        TruePose(first.stamp - 0.1, np.array([1.0, 0.0, 3.1])),
        TruePose(first.stamp + 0.1, np.array([2, 0, -3.1])),
    ]
    result = replay([*poses, *(m for m in messages if not isinstance(m, TruePose))], CONFIG, lidar_mount=mount)
    np.testing.assert_allclose(result.poses[0, :2], [1.5, 0.0], atol=0.02)
    assert abs(result.poses[0, 2]) == pytest.approx(np.pi)


def test_raw_odometry_starts_where_the_estimate_starts(drive: Drive, mount: Floats) -> None:
    messages = drive(30)
    result = replay(messages, CONFIG, lidar_mount=mount)
    wheels = np.array([m.pose for m in messages if isinstance(m, Odometry)])
    np.testing.assert_allclose(result.odometry, compose(result.poses[0], between(wheels[0], wheels)), atol=1e-9)


def test_every_reading_is_kept_with_the_number_of_scans_before_it(drive: Drive, mount: Floats) -> None:
    messages = drive(20)
    twice = [m for message in messages for m in ([message, message] if isinstance(message, Odometry) else [message])]
    extra = Odometry(1e3, np.array([1.0, 2.0, 0.5]))  # after the last scan
    readings = replay([*twice, extra], CONFIG, lidar_mount=mount).readings
    assert readings is not None
    wheels = [m for m in [*twice, extra] if isinstance(m, Odometry)]
    before = [sum(isinstance(m, LaserScan) for m in twice[:i]) for i, m in enumerate(twice) if isinstance(m, Odometry)]
    np.testing.assert_array_equal(readings.stamps, [m.stamp for m in wheels])
    np.testing.assert_array_equal(readings.scans_before, [*before, 20])
    poses = np.array([m.pose for m in wheels])
    np.testing.assert_allclose(between(readings.poses[0], readings.poses), between(poses[0], poses), atol=1e-9)
    result = replay(messages, CONFIG, lidar_mount=mount)
    assert result.readings is not None
    np.testing.assert_allclose(result.readings.poses, result.odometry, atol=1e-9)  # one frame: a reading a scan here


def test_a_recording_without_odometry_has_no_readings(drive: Drive, mount: Floats) -> None:
    assert replay(scans_in(drive(5, standing_from=0)), CONFIG, lidar_mount=mount).readings is None
    late = [*scans_in(drive(5, standing_from=0)), Odometry(1e3, np.array([9.0, 9.0, 0.0]))]
    assert replay(late, CONFIG, lidar_mount=mount).readings is None  # nothing ties it to a scan


@pytest.mark.parametrize("before", [1, 5])
def test_scans_before_the_first_odometry_leave_the_raw_odometry_where_it_starts(
    drive: Drive, mount: Floats, before: int
) -> None:
    # The wheels' own origin is metres away: it must not show as a jump.
    messages = drive(30, standing_from=10)
    late = [m for i, m in enumerate(messages) if not isinstance(m, Odometry) or i >= 3 * before]
    result = replay(late, CONFIG, lidar_mount=mount)
    wheels = np.array([m.pose for m in late if isinstance(m, Odometry)])
    expected = compose(result.poses[0], between(wheels[0], wheels))
    np.testing.assert_allclose(result.odometry[:before], np.broadcast_to(result.poses[0], (before, 3)), atol=1e-9)
    np.testing.assert_allclose(result.odometry[before:], expected, atol=1e-9)
    assert result.skipped == {BLIND: before}


def test_without_any_odometry_the_raw_odometry_stands_still(drive: Drive, mount: Floats) -> None:
    result = replay(scans_in(drive(10, standing_from=0)), CONFIG, lidar_mount=mount)
    np.testing.assert_array_equal(result.odometry, 0.0)
    assert result.skipped == {BLIND: 10}


@pytest.mark.parametrize("scans", [1, 25])
def test_ctrl_c_keeps_what_was_done(drive: Drive, mount: Floats, scans: int) -> None:
    messages = drive(40)
    result = replay(breaking_off(messages, scans, KeyboardInterrupt()), CONFIG, lidar_mount=mount)
    whole = replay(messages, CONFIG, lidar_mount=mount)
    assert_whole(result, scans)
    assert not result.complete
    assert result.skipped == {"interrupted": 1}
    np.testing.assert_array_equal(result.poses, whole.poses[:scans])
    assert scans < 3 or len(result.wall_map.ids)


def test_ctrl_c_while_progress_is_shown_keeps_the_scan(drive: Drive, mount: Floats) -> None:
    def stop(scan: LaserScan, update: ScanUpdate) -> None:
        if update.stamp > 51.0:
            raise KeyboardInterrupt

    result = replay(drive(40), CONFIG, lidar_mount=mount, on_scan=stop)
    assert_whole(result, 12)
    assert not result.complete


def test_ctrl_c_between_two_lists_leaves_no_half_row(
    drive: Drive, mount: Floats, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = 0

    def interrupted(slam: ContourSlam) -> Floats:
        nonlocal asked
        asked += 1
        if asked == 5:
            raise KeyboardInterrupt
        return np.zeros(3)

    monkeypatch.setattr(ContourSlam, "odometry_pose", property(interrupted))
    result = replay(drive(20), CONFIG, lidar_mount=mount)
    assert_whole(result, len(result.stamps))
    assert len(result.stamps) in (4, 5)


def test_ctrl_c_before_the_first_scan_gives_an_empty_result(drive: Drive, mount: Floats) -> None:
    result = replay(breaking_off(drive(5), 0, KeyboardInterrupt()), CONFIG, lidar_mount=mount)
    assert_whole(result, 0)
    assert not result.complete
    assert result.truth is None
    assert len(result.corner_map.ids) == len(result.wall_map.ids) == 0


def test_damage_in_mid_recording_keeps_what_came_before(drive: Drive, mount: Floats) -> None:
    messages = drive(40)
    damage = RecordingError("log.gz, line 812: the file is cut short")
    result = replay(breaking_off(messages, 25, damage), CONFIG, lidar_mount=mount)
    assert_whole(result, 25)
    assert not result.complete
    assert result.skipped == {"log.gz, line 812: the file is cut short": 1}
    np.testing.assert_array_equal(result.poses, replay(messages, CONFIG, lidar_mount=mount).poses[:25])


def test_damage_before_the_first_scan_is_an_error(drive: Drive) -> None:
    with pytest.raises(RecordingError, match="cut short"):
        replay(breaking_off(drive(5), 0, RecordingError("the file is cut short")), CONFIG)


def test_a_bug_is_not_taken_for_damage(drive: Drive) -> None:
    with pytest.raises(ZeroDivisionError):
        replay(breaking_off(drive(5), 3, ZeroDivisionError()), CONFIG)


@pytest.mark.parametrize("kinds", [(), (Odometry,), (Odometry, TruePose)])
def test_a_recording_without_scans_is_an_error(drive: Drive, kinds: tuple[type, ...]) -> None:
    messages = [m for m in drive(5) if isinstance(m, kinds)] if kinds else []
    with pytest.raises(RecordingError, match="no scan"):
        replay(messages, CONFIG)


def test_the_odometry_that_comes_with_a_scan_may_be_published_after_it_began(drive: Drive, mount: Floats) -> None:
    # A scan is published once it is complete: readings stamped after its first beam come before it.
    messages = drive(40)
    order = sorted(messages, key=lambda m: m.stamp + (0.15 if isinstance(m, LaserScan) else 0.0))
    late = replay(order, CONFIG, lidar_mount=mount)
    np.testing.assert_allclose(late.poses, replay(messages, CONFIG, lidar_mount=mount).poses, atol=1e-6)


def test_true_poses_out_of_order_are_put_in_order(drive: Drive, mount: Floats) -> None:
    messages = drive(20)
    truth = [m for m in messages if isinstance(m, TruePose)]
    rest = [m for m in messages if not isinstance(m, TruePose)]
    result = replay([*truth[::-1], *rest], CONFIG, lidar_mount=mount)
    np.testing.assert_allclose(result.truth, [t.pose for t in truth], atol=1e-12)


def test_a_detector_object_may_be_handed_over(drive: Drive, mount: Floats) -> None:
    class Blind:
        equalized = False
        threshold = 1.0

        def respond(self, contours: object) -> Floats:
            return np.zeros(len(contours.points))

        def reach(self, contours: object) -> int:
            return 1

    result = replay(drive(10), replace(CONFIG, detector="mine"), Blind(), lidar_mount=mount)
    assert result.corner_count.sum() == 0
    assert result.wall_count.sum() > 0
    assert result.detector == "mine"
