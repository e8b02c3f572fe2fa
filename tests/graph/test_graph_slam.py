"""The streaming object over the graph: a true drive, and everything that a recording can throw at it."""

import sys
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2

from contourslam.config import Config, GraphConfig
from contourslam.errors import MissingExtraError
from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose
from contourslam.replay import BLIND, make_mapper, replay
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.slam.result import RunResult

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.graph import GraphSlam
from contourslam.simulation.long_drive import building_drive

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose

CONFIG = Config(back_end="graph")
LENGTH, SEED = 60.0, 0
MOUNT = building_drive(LENGTH, SEED).lidar_mount


@cache
def drive() -> tuple[Message, ...]:
    return tuple(building_drive(LENGTH, SEED).messages())


def beginning(scans: int) -> list[Message]:
    """The drive up to and with so many scans."""
    ends = [i for i, message in enumerate(drive()) if isinstance(message, LaserScan)]
    return list(drive()[: ends[scans - 1] + 1])


def run(messages: Iterable[Message], config: Config = CONFIG, initial_pose: Floats | None = None) -> RunResult:
    return replay(messages, config, initial_pose=initial_pose, lidar_mount=MOUNT)


@cache
def whole() -> RunResult:
    return run(drive())


def rmse(poses: Floats, truth: Floats | None) -> float:
    assert truth is not None
    return float(np.sqrt(np.mean(np.sum((poses - truth)[:, :2] ** 2, axis=1))))


def assert_whole(result: RunResult, scans: int) -> None:
    """One row a scan, all of it finite, and covariances that are."""
    assert result.online_poses is not None
    assert result.poses.shape == result.online_poses.shape == (scans, 3)
    assert np.isfinite(result.poses).all()
    assert np.isfinite(result.online_poses).all()
    assert result.covariances.shape == (scans, 3, 3)
    np.testing.assert_allclose(result.covariances, result.covariances.transpose(0, 2, 1), rtol=1e-9, atol=1e-15)
    assert np.linalg.eigvalsh(result.covariances).min() > 0.0
    assert result.back_end == "graph"


def test_the_drive_is_found_to_a_fraction_of_what_the_wheels_drift() -> None:
    result = whole()
    assert result.online_poses is not None
    drift = rmse(result.odometry, result.truth)
    assert drift > 0.3
    assert rmse(result.online_poses, result.truth) < 0.15 * drift
    assert rmse(result.poses, result.truth) < 0.1 * drift
    assert len(result.corner_map.ids) > 10
    assert len(result.wall_map.ids) > 10


def test_finish_gives_each_scan_a_pose_that_knows_what_came_after() -> None:
    result = whole()
    scans = sum(isinstance(message, LaserScan) for message in drive())
    assert result.complete
    assert_whole(result, scans)
    assert result.online_poses is not None
    change = between(result.online_poses, result.poses)
    assert np.abs(change).max() > 1e-3
    assert len(result.quality if result.quality is not None else ()) == scans


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_first_seconds_are_as_honest_as_the_rest(seed: int) -> None:
    """The map begins at the first keyframe, which is known exactly; the scans that follow it are not."""
    begun = building_drive(3.0, seed)
    result = replay(begun.messages(), CONFIG, lidar_mount=begun.lidar_mount)
    assert result.truth is not None
    error = result.poses - result.truth
    error[:, 2] = wrap(error[:, 2])
    nees = np.einsum("ti,tij,tj->t", error, np.linalg.inv(result.covariances), error)[1:]
    assert nees.mean() < 3.0  # of three dimensions; it was hundreds
    assert (nees < chi2.ppf(0.99999, 3)).all()


@pytest.mark.parametrize("refine", [False, True], ids=["as_it_is", "refined"])
def test_streaming_equals_replay(refine: bool) -> None:
    config = replace(CONFIG, graph=GraphConfig(refine=refine))
    messages = beginning(120)
    start = next(m.pose for m in messages if isinstance(m, TruePose))
    slam = GraphSlam(config, initial_pose=start, lidar_mount=MOUNT)
    online = []
    for message in messages:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            update = slam.push_scan(message)
            online.append(update.pose)
            np.testing.assert_allclose(update.covariance, update.covariance.T, rtol=1e-9, atol=1e-15)
            assert np.linalg.eigvalsh(update.covariance)[0] > 0.0
    finished = slam.finish()
    result = run(messages, config)
    assert result.online_poses is not None
    np.testing.assert_array_equal(result.online_poses, online)
    np.testing.assert_array_equal(result.poses, finished.poses)
    np.testing.assert_array_equal(result.corner_map.positions, slam.corner_map().positions)


def test_scans_alone_are_enough() -> None:
    result = run(m for m in drive() if not isinstance(m, Odometry))
    scans = len(result.stamps)
    assert_whole(result, scans)
    assert result.skipped == {BLIND: scans}
    assert rmse(result.poses, result.truth) < 0.3


def blank(stamp: float, ranges: ArrayLike = ()) -> LaserScan:
    values = np.asarray(ranges, dtype=float)
    return LaserScan(stamp, np.linspace(-1.0, 1.0, values.size), values, np.zeros(values.size), 0.05, 30.0)


def with_blanks(messages: Iterable[Message], every: int) -> Iterator[Message]:
    """Scans that show nothing, or next to nothing, at the beginning and after every few of the others."""
    kinds: list[list[float]] = [[], [2.0], [np.inf] * 90, [np.nan] * 5, [0.0, 1.0, 1e9]]
    scans, last = 0, -np.inf
    for message in messages:
        if isinstance(message, LaserScan):
            if scans == 0:
                yield from (blank(message.stamp - 1.0 + 0.1 * i, kind) for i, kind in enumerate(kinds))
            scans += 1
            if scans % every == 0:
                yield blank(0.5 * (message.stamp + last), kinds[scans // every % len(kinds)])
            last = message.stamp
        yield message


def test_scans_that_show_nothing_cost_nothing() -> None:
    result = run(with_blanks(beginning(200), every=7))
    assert len(result.stamps) == 200 + 5 + 200 // 7
    assert_whole(result, len(result.stamps))
    # The blind scans at the beginning are stamped before any true pose.
    assert result.truth is not None
    assert rmse(result.poses[5:], result.truth[5:]) < 0.2


def test_a_recording_of_blind_scans_gives_the_way_of_the_wheels() -> None:
    messages = [
        replace(m, ranges=np.full(m.ranges.shape, np.inf)) if isinstance(m, LaserScan) else m for m in beginning(60)
    ]
    result = run(messages)
    assert_whole(result, 60)
    way = np.hypot(*np.diff(result.odometry[:, :2], axis=0).T).sum()
    assert np.hypot(*(result.poses - result.odometry)[:, :2].T).max() < 0.05 * way
    assert len(result.corner_map.ids) == len(result.wall_map.ids) == 0
    assert result.loops == ()


def test_a_single_scan_is_a_run() -> None:
    result = run(beginning(1))
    assert_whole(result, 1)


def test_nothing_pushed_gives_an_empty_drive_and_an_empty_map() -> None:
    slam = GraphSlam(CONFIG)
    finished = slam.finish()
    assert finished.poses.shape == (0, 3)
    assert finished.loops == ()
    assert len(slam.corner_map().ids) == len(slam.wall_map().ids) == 0


@pytest.mark.parametrize("shift", [0.0, -0.4, -30.0], ids=["repeated", "a_little_back", "far_back"])
def test_stamps_that_repeat_or_run_backwards_lose_no_scan(shift: float) -> None:
    messages, scans, last = beginning(200), 0, 0.0
    for i, message in enumerate(messages):
        if isinstance(message, LaserScan):
            scans += 1
            if scans % 25 == 0:
                messages[i] = replace(message, stamp=last + shift)
            last = message.stamp
    result = run(messages)
    assert_whole(result, 200)
    truth = np.array([m.pose for m in messages if isinstance(m, TruePose)])[:200]
    proper = np.arange(200) % 25 != 24
    assert rmse(result.poses[proper], truth[proper]) < 0.3


def test_the_drive_begins_where_it_is_told_to() -> None:
    messages = [m for m in beginning(150) if not isinstance(m, TruePose)]
    start = np.array([40.0, -7.0, 2.5])
    here, there = run(messages), run(messages, initial_pose=start)
    np.testing.assert_allclose(here.poses[0], 0.0, atol=1e-3)
    np.testing.assert_allclose(there.poses[0], start, atol=1e-3)
    assert np.abs(between(compose(start, here.poses), there.poses)).max() < 0.02
    known = run(beginning(150))
    assert known.truth is not None
    np.testing.assert_allclose(known.poses[0], known.truth[0], atol=1e-3)


def test_ctrl_c_keeps_what_came_before() -> None:
    def interrupted() -> Iterator[Message]:
        yield from beginning(150)
        raise KeyboardInterrupt

    result = run(interrupted())
    assert not result.complete
    assert result.skipped == {"interrupted": 1}
    assert_whole(result, 150)
    assert len(result.corner_map.ids) > 0
    np.testing.assert_array_equal(result.poses, run(beginning(150)).poses)


def test_the_map_may_be_asked_for_midway_and_the_drive_goes_on() -> None:
    slam = GraphSlam(CONFIG, lidar_mount=MOUNT)
    counts, poses = [], []
    for message in beginning(160):
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            poses.append(slam.push_scan(message).pose)
            if len(poses) % 80 == 0:
                assert len(slam.finish().poses) == len(poses)
                counts.append(len(slam.corner_map().ids))
    assert counts[0] > 0
    assert counts[1] > 0
    undisturbed = run([m for m in beginning(160) if not isinstance(m, TruePose)])
    assert np.abs(between(undisturbed.poses, slam.finish().poses)).max() < 0.05


def test_without_gtsam_the_graph_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name == "contourslam.graph" or name.startswith("contourslam.graph.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "gtsam", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'contourslam\[graph\]'"):
        make_mapper(CONFIG)
    assert make_mapper(Config()).finish() is None
