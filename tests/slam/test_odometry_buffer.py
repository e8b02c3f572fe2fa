"""The readings around a scan: gaps, repeated and backward stamps, hardly a reading at all."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.scan import Odometry
from contourslam.slam.odometry_buffer import OdometryBuffer

Floats = NDArray[np.float64]


def filled(*stamps: float, speed: float = 1.0) -> OdometryBuffer:
    """Readings of a robot that drives straight on."""
    buffer = OdometryBuffer()
    for stamp in stamps:
        buffer.push(Odometry(stamp, np.array([speed * stamp, 0.0, 0.0])))
    return buffer


def test_no_reading_is_no_motion() -> None:
    times, poses = OdometryBuffer().during(1.0, 1.1)
    assert times.shape == (0,)
    assert poses.shape == (0, 3)


@pytest.mark.parametrize("stamp", [0.0, 5.0, 9.0])
def test_one_reading_is_the_pose_at_any_time(stamp: float) -> None:
    times, poses = filled(stamp).during(5.0, 5.1)
    np.testing.assert_array_equal(OdometryBuffer.pose_at_start(times, poses), [stamp, 0.0, 0.0])


def test_the_pose_at_the_scan_lies_between_its_neighbours() -> None:
    times, poses = filled(0.0, 0.5, 1.0, 1.5).during(0.8, 0.9)
    np.testing.assert_allclose(times, [-0.3, 0.2])
    np.testing.assert_allclose(OdometryBuffer.pose_at_start(times, poses), [0.8, 0.0, 0.0])


def test_the_readings_cover_the_whole_scan_and_one_more_to_either_side() -> None:
    times, _ = filled(*np.arange(0.0, 3.0, 0.1)).during(1.05, 1.25)
    np.testing.assert_allclose(times + 1.05, [1.0, 1.1, 1.2, 1.3])


@pytest.mark.parametrize(("scan", "expected"), [(-1.0, 0.0), (7.0, 2.0)])
def test_the_pose_is_never_extrapolated(scan: float, expected: float) -> None:
    times, poses = filled(0.0, 1.0, 2.0).during(scan, scan + 0.1)
    np.testing.assert_array_equal(OdometryBuffer.pose_at_start(times, poses), [expected, 0.0, 0.0])


def test_over_a_gap_the_motion_is_even() -> None:
    times, poses = filled(0.0, 0.1, 20.1, 20.2).during(5.1, 5.2)
    np.testing.assert_allclose(OdometryBuffer.pose_at_start(times, poses), [5.1, 0.0, 0.0])


def test_the_heading_is_interpolated_across_the_half_turn() -> None:
    buffer = OdometryBuffer()
    buffer.push(Odometry(0.0, np.array([0.0, 0.0, math.pi - 0.1])))
    buffer.push(Odometry(1.0, np.array([0.0, 0.0, -math.pi + 0.1])))
    heading = OdometryBuffer.pose_at_start(*buffer.during(0.5, 0.6))[2]
    assert abs(heading) == pytest.approx(math.pi)


def test_of_readings_with_one_stamp_the_last_counts() -> None:
    buffer = filled(0.0, 1.0)
    buffer.push(Odometry(1.0, np.array([5.0, 0.0, 0.0])))
    assert len(buffer) == 2
    np.testing.assert_array_equal(OdometryBuffer.pose_at_start(*buffer.during(1.0, 1.1)), [5.0, 0.0, 0.0])


def test_after_the_clock_was_set_back_the_readings_ascend_again() -> None:
    buffer = filled(10.0, 10.1, 10.2)
    for stamp, x in ((3.0, 10.3), (3.1, 10.4), (3.2, 10.5)):
        buffer.push(Odometry(stamp, np.array([x, 0.0, 0.0])))
    times, poses = buffer.during(3.05, 3.15)
    assert (np.diff(times) > 0.0).all()
    np.testing.assert_allclose(OdometryBuffer.pose_at_start(times, poses), [10.35, 0.0, 0.0])


def test_a_scan_older_than_the_last_one_gets_the_oldest_reading_left() -> None:
    buffer = filled(*np.arange(0.0, 3.0, 0.1))
    buffer.during(2.0, 2.1)
    times, poses = buffer.during(0.5, 0.6)
    assert OdometryBuffer.pose_at_start(times, poses)[0] == pytest.approx(2.0, abs=0.11)


def test_old_readings_are_forgotten() -> None:
    buffer = OdometryBuffer()
    for i in range(2000):
        buffer.push(Odometry(0.05 * i, np.zeros(3)))
        if i % 4 == 0:
            buffer.during(0.05 * i - 0.1, 0.05 * i)
            assert len(buffer) < 10


@given(
    stamps=st.lists(st.integers(0, 10**11).map(lambda ns: ns * 1e-9), max_size=30),  # clocks tick in nanoseconds
    scans=st.lists(st.tuples(st.floats(-10.0, 110.0), st.floats(0.0, 1.0)), min_size=1, max_size=5),
)
def test_whatever_the_stamps_the_times_ascend_and_the_pose_is_one_that_was_read_or_between(
    stamps: list[float], scans: list[tuple[float, float]]
) -> None:
    buffer = filled(*stamps)
    for start, duration in scans:
        times, poses = buffer.during(start, start + duration)
        assert len(times) == len(poses)
        assert all(a < b for a, b in pairwise(times))
        if stamps:
            x = OdometryBuffer.pose_at_start(times, poses)[0]
            assert min(stamps) - 1e-9 <= x <= max(stamps) + 1e-9
