"""A pose at every odometry reading: along the wheels in the order of the recording, true to the scans' poses."""

from dataclasses import replace
from time import thread_time

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.geometry.poses import between, compose
from contourslam.report.scan_table import EMPTY_CORNERS, EMPTY_WALLS
from contourslam.slam.dense import dense_trajectory
from contourslam.slam.result import OdometryReadings, RunResult

Floats = NDArray[np.float64]
PER_SCAN = 4  # readings before each scan; the last has the scan's own stamp


def path(times: Floats) -> Floats:
    heading = 0.9 * np.sin(0.7 * times)
    return np.stack([2.0 * np.sin(0.3 * times), times * 0.4, heading], axis=-1)


def drive(scans: int = 30, drift: float = 0.0, tail: int = 2) -> RunResult:
    """Readings every 50 ms, and scans at every fourth; the wheels' way is the true one but for its drift."""
    times = 0.05 * np.arange(1 + PER_SCAN * (scans - 1) + tail)
    wheels = compose(np.array([5.0, -3.0, 2.0]), path(times) + drift * times[:, None] * np.array([1.0, -0.5, 0.3]))
    at = PER_SCAN * np.arange(scans)
    numbers = np.zeros(scans, dtype=np.int64)
    return RunResult(
        detector="",
        stamps=times[at],
        poses=path(times[at]),
        covariances=np.zeros((scans, 3, 3)),
        odometry=wheels[at],
        truth=None,
        nis=np.zeros(scans),
        nis_dof=numbers,
        matched_count=numbers,
        corner_count=numbers,
        wall_count=numbers,
        corner_map=EMPTY_CORNERS,
        wall_map=EMPTY_WALLS,
        readings=OdometryReadings(times, wheels, np.searchsorted(at, np.arange(len(times)))),
    )


def test_perfect_wheels_give_the_true_way_between_the_scans() -> None:
    stamps, poses = dense_trajectory(drive())
    np.testing.assert_array_equal(stamps, 0.05 * np.arange(len(stamps)))
    np.testing.assert_allclose(poses, path(stamps), atol=1e-12)


def test_each_scan_keeps_its_pose_to_the_last_bit_and_stands_once() -> None:
    run = drive(drift=0.02)
    stamps, poses = dense_trajectory(run)
    rows = [int(np.flatnonzero(stamps == stamp)[0]) for stamp in run.stamps]
    np.testing.assert_array_equal(poses[rows], run.poses)
    assert len(np.unique(stamps)) == len(stamps) == len(run.readings.stamps)


def test_what_the_wheels_lack_is_spread_evenly_over_the_readings() -> None:
    run = drive(drift=0.02)
    stamps, poses = dense_trajectory(run)
    inside = stamps <= run.stamps[-1]
    carried = [compose(run.poses[k // 4], between(run.odometry[k // 4], run.readings.poses[k])) for k in range(117)]
    gained = poses[inside] - np.array(carried)
    lacking = run.poses[1:] - np.array(
        [compose(a, between(b, c)) for a, b, c in zip(run.poses, run.odometry, run.odometry[1:], strict=False)]
    )
    for part in range(PER_SCAN):
        np.testing.assert_allclose(gained[part:-1:PER_SCAN], lacking * part / PER_SCAN, atol=1e-12)
    # A way that turns is followed far better so than by going straight from scan to scan.
    assert np.abs(poses[inside] - path(stamps[inside])).max() < 2e-4


def test_the_order_of_the_recording_counts_and_not_the_stamps() -> None:
    run = drive(drift=0.02)
    wrong = np.random.default_rng(0).permutation(len(run.readings.stamps)) + 1000.0
    _, poses = dense_trajectory(replace(run, readings=replace(run.readings, stamps=wrong)))
    known = np.delete(poses, np.flatnonzero(np.isin(poses[:, 0], run.poses[:, 0])), axis=0)
    times = np.delete(run.readings.stamps, PER_SCAN * np.arange(30))
    for time, pose in zip(times, path(times), strict=True):
        assert np.abs(known - pose).sum(axis=1).min() < 5e-3, time


def test_online_poses_never_look_ahead() -> None:
    run = drive(drift=0.02)
    late = run.poses.copy()
    late[20:] += 1.0
    stamps, before = dense_trajectory(replace(run, online_poses=run.poses), online=True)
    _, after = dense_trajectory(replace(run, online_poses=late), online=True)
    np.testing.assert_array_equal(before[stamps < run.stamps[20]], after[stamps < run.stamps[20]])
    assert (np.abs(before - after)[stamps >= run.stamps[20], 0] > 0.1).all()
    assert (stamps >= run.stamps[0]).all()


@pytest.mark.parametrize(("online", "rows"), [(False, 7), (True, 4)])
def test_readings_before_the_first_scan_have_a_pose_only_in_hindsight(online: bool, rows: int) -> None:
    times = np.linspace(-0.3, 0.0, 4)
    early = OdometryReadings(times, path(times), np.zeros(4, dtype=np.int64))
    run = replace(drive(4), odometry=drive(4).poses, readings=early)
    stamps, poses = dense_trajectory(run, online=online)
    assert len(stamps) == rows  # the last of them has the first scan's stamp
    np.testing.assert_allclose(poses, path(stamps), atol=1e-12)


def test_without_readings_the_scans_are_all_there_is() -> None:
    run = replace(drive(), readings=None)
    stamps, poses = dense_trajectory(run)
    np.testing.assert_array_equal(stamps, run.stamps)
    np.testing.assert_array_equal(poses, run.poses)


def test_a_long_log_costs_next_to_nothing() -> None:
    run = drive(60_000, drift=0.001)
    assert len(run.readings.stamps) > 200_000
    begin = thread_time()
    dense_trajectory(run)
    assert thread_time() - begin < 0.7  # 40 ms where it was written
