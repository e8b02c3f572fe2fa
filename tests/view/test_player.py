import math
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

from contourslam.config import Config, SlamConfig
from contourslam.errors import ConfigError, RecordingError
from contourslam.replay import replay
from contourslam.scan import LaserScan
from contourslam.slam.result import ScanUpdate
from contourslam.view.knots import UNIT
from contourslam.view.moment import trace_of
from contourslam.view.stories import KEPT, LANDMARKS, Stories

BACK_ENDS = ["ekf", pytest.param("graph", marks=pytest.mark.skipif(find_spec("gtsam") is None, reason="no GTSAM"))]


@pytest.mark.parametrize("back_end", BACK_ENDS)
def test_a_watched_replay_gives_the_poses_of_one_that_nobody_watches(back_end, drive, replayed) -> None:
    config = Config(back_end=back_end)
    one = replayed(30, config=config)
    one.player.run()
    assert (one.player.state, one.player.error, one.player.trouble) == ("finished", None, "")
    known = replay(drive(30), config)
    poses = known.poses if known.online_poses is None else known.online_poses
    for i, pose in enumerate(poses):
        moment = one.show.memory.at(0.2 * i + 1e-6)
        np.testing.assert_array_equal(moment.lanes[0].update.pose, pose)
        np.testing.assert_allclose(moment.odometry, known.odometry[i], atol=1e-9)
        np.testing.assert_allclose(moment.truth, known.truth[i], atol=1e-9)


@pytest.mark.parametrize("back_end", BACK_ENDS)
def test_the_last_map_is_that_of_the_run(back_end, drive, replayed) -> None:
    config = Config(back_end=back_end)
    one = replayed(30, config=config)
    one.player.run()
    known = replay(drive(30), config)
    arrays = one.player.lanes[0].draw(one.show.memory.knot_scans())
    assert arrays["corner_ids"].tolist() == known.corner_map.ids.tolist()
    np.testing.assert_allclose(arrays["corners"], known.corner_map.positions, atol=2e-3)
    # A filter's poses stay what they were at the time, which the knots have.
    now = arrays["path"] if back_end == "graph" else [knot.lanes[0, :3] for knot in one.show.memory.knots(0)]
    np.testing.assert_allclose(now, known.poses[one.show.memory.knot_scans()], atol=2e-3)
    assert len(arrays["corner_ids"]) >= 4


def test_lanes_differ_in_their_detectors_and_share_their_scans(replayed) -> None:
    one = replayed(20, ("matched_filter", "wu"))
    one.player.run()
    newest = one.show.memory.newest
    assert [lane.detector for lane in one.player.lanes] == list(one.show.painter._detectors)
    assert len(newest.lanes) == 2
    assert newest.lanes[0].update.pose is not newest.lanes[1].update.pose


def test_ink_is_what_the_lidar_saw_in_the_frame_of_the_base(replayed) -> None:
    mount = (0.1, -0.2, math.radians(90.0))
    one = replayed(3, lidar_mount=mount)
    one.player.run()
    knot, moment = one.show.memory.knots(0)[0], one.show.memory.at(0.0)
    x, y = moment.trace.points[0]
    # Turned by a right angle to the left, then moved.
    np.testing.assert_allclose(knot.ink[0] * UNIT, [mount[0] - y, mount[1] + x], atol=UNIT)


def test_contours_are_kept_as_the_detectors_take_them(replayed) -> None:
    one = replayed(3)
    one.player.run()
    contours = one.player.lanes[0].contours()
    again = trace_of(contours).contours()
    np.testing.assert_allclose(again.points, contours.points, atol=1e-5)
    for name in ("starts", "closed", "source"):
        np.testing.assert_array_equal(getattr(again, name), getattr(contours, name))


def test_a_recording_that_breaks_off_keeps_what_came_before_and_says_why(drive, replayed) -> None:
    one = replayed(5)

    def broken():
        yield from drive(5)
        raise RecordingError("the file is cut off after message 15")

    one.player._messages = broken()
    one.player.run()
    assert one.player.state == "finished"
    assert "cut off" in one.player.trouble
    assert one.show.memory.newest.index == 4
    assert any(event["what"] == "trouble" for event in one.show.memory.events(0)[1])


def test_a_recording_without_a_scan_has_failed(drive, replayed) -> None:
    one = replayed(5)
    one.player._messages = (m for m in drive(5) if not isinstance(m, LaserScan))
    one.player.run()
    assert one.player.state == "failed"
    assert "no scan" in one.player.trouble


def test_stamps_that_run_back_do_not_turn_the_time_line_back(drive, replayed) -> None:
    one = replayed(8)
    messages = list(drive(8))
    scans = [m for m in messages if isinstance(m, LaserScan)]
    messages[messages.index(scans[4])] = replace(scans[4], stamp=scans[1].stamp)
    one.player._messages = messages
    one.player.run()
    memory = one.show.memory
    assert memory.newest.index == 7
    times = [memory.beside(memory.newest, -by).elapsed for by in range(8)][::-1]
    assert times == sorted(times)


@pytest.mark.parametrize(
    "names", [("wu", "wu"), ("matched_filter", "wu", "teh_chin", "curvature_scale_space", "wu"), ("no",)]
)
def test_one_to_four_detectors_that_exist_are_wanted(replayed, names) -> None:
    with pytest.raises(ConfigError):
        replayed(3, names)


def test_a_corner_has_a_story(replayed) -> None:
    one = replayed(40)
    one.player.run()
    lane = one.player.lanes[0]
    corners = lane.mapper.corner_map()
    number = int(corners.ids[np.argmax(corners.observed)])
    story = one.show.story(0, number)
    assert story["what"].count(1) <= corners.observed.max()
    assert story["what"].count(1) > 5
    assert list(story["times"]) == sorted(story["times"])
    off = np.hypot(story["dx"], story["dy"])
    assert np.nanmax(off) < 0.3
    assert np.isfinite(off).any()
    assert one.show.story(0, 10**6)["times"] == ()
    assert one.show.story(7, 0) == {}


def test_nothing_is_mapped_ahead_once_the_recording_has_ended(replayed) -> None:
    one = replayed(5)
    one.pace.hurry(1e9)
    assert one.show.status()["hurries_to"] == 1e9
    one.player.run()
    assert one.player.state == "finished"
    assert one.show.status()["hurries_to"] is None


def test_the_page_knows_the_bound_that_landmarks_are_dropped_at(replayed) -> None:
    config = Config(back_end="ekf", slam=SlamConfig(max_false_negative_rate=0.4))
    assert replayed(3, config=config).show.about["max_false_negative_rate"] == 0.4


def test_of_stories_and_of_each_the_newest_part_is_kept() -> None:
    stories = Stories()
    nothing = ScanUpdate(0.0, np.zeros(3), np.eye(3), 1, 0, (), (), (), (), 0.0, 0)
    for i in range(LANDMARKS + 10):
        stories.take(float(i), replace(nothing, born=(i,)), None)
    newest = LANDMARKS + 9
    for i in range(KEPT + 5):
        stories.take(newest + 1.0 + i, replace(nothing, matched=(newest,)), None)
    assert stories.story(9)["times"] == ()
    assert stories.story(10)["times"] == (10.0,)
    assert stories.story(newest)["times"] == tuple(newest + 6.0 + i for i in range(KEPT))
