"""Odometry is passed on as it is until it leaps, and then without the leap."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import LiveConfig
from contourslam.geometry.poses import between, compose
from contourslam.live.continuous import ContinuousOdometry
from contourslam.scan import Odometry

Floats = NDArray[np.float64]
ReadingAt = Callable[..., Odometry]
POSES = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-math.pi, math.pi)).map(np.array)


def test_readings_without_a_leap_are_the_same_objects(reading_at: ReadingAt) -> None:
    odometry = ContinuousOdometry(LiveConfig())
    for k in range(50):
        reading = reading_at(0.02 * k, 0.04 * k, 0.0, 0.1 * k - 3.0)
        assert odometry.take(reading) == (reading, 0.0)
    np.testing.assert_array_equal(odometry.raw(np.array([1.0, 2.0, 3.0])), [1.0, 2.0, 3.0])


def test_the_heading_that_wraps_is_no_leap(reading_at: ReadingAt) -> None:
    odometry = ContinuousOdometry(LiveConfig())
    odometry.take(reading_at(0.0, 0.0, 0.0, math.pi - 0.01))
    assert odometry.take(reading_at(0.02, 0.0, 0.0, -math.pi + 0.01))[1] == 0.0


@given(start=POSES, fresh=POSES, steps=st.lists(st.floats(-0.05, 0.05), min_size=1, max_size=10))
def test_after_a_leap_the_motion_goes_on_from_where_it_was(start: Floats, fresh: Floats, steps: list[float]) -> None:
    odometry = ContinuousOdometry(LiveConfig())
    own, _ = odometry.take(Odometry(0.0, start))
    leapt = compose(fresh, np.array([100.0, 0.0, 0.0]))
    passed, leap = odometry.take(Odometry(0.02, leapt))
    step = between(start, leapt)
    if math.hypot(step[0], step[1]) < 1.0:
        return
    assert leap == pytest.approx(math.hypot(step[0], step[1]) + abs(step[2]))
    np.testing.assert_allclose(between(own.pose, passed.pose), 0.0, atol=1e-9)
    raw = leapt
    for k, way in enumerate(steps):
        before = raw, passed.pose
        raw = compose(raw, np.array([way, 0.0, way]))
        passed, leap = odometry.take(Odometry(0.04 + 0.02 * k, raw))
        assert leap == 0.0
        np.testing.assert_allclose(between(before[1], passed.pose), between(before[0], raw), atol=1e-9)
        np.testing.assert_allclose(between(odometry.raw(passed.pose), raw), 0.0, atol=1e-9)


@pytest.mark.parametrize(("speed", "leaps"), [(2.5, False), (40.0, True)])
def test_a_leap_is_what_no_robot_can_drive(reading_at: ReadingAt, speed: float, leaps: bool) -> None:
    odometry = ContinuousOdometry(LiveConfig(max_speed=3.0))
    odometry.take(reading_at(0.0))
    assert (odometry.take(reading_at(0.02, 0.02 * speed))[1] > 0.0) is leaps


def test_a_long_silence_allows_no_way_of_any_length(reading_at: ReadingAt) -> None:
    odometry = ContinuousOdometry(LiveConfig(max_speed=3.0))
    odometry.take(reading_at(0.0))
    assert odometry.take(reading_at(100.0, 3.0))[1] == 0.0
    assert odometry.take(reading_at(200.0, 13.0))[1] == pytest.approx(10.0)


def test_stamps_that_run_back_hide_no_leap(reading_at: ReadingAt) -> None:
    odometry = ContinuousOdometry(LiveConfig())
    odometry.take(reading_at(100.0, 5.0))
    assert odometry.take(reading_at(50.0, 5.1))[1] == 0.0
    assert odometry.take(reading_at(20.0))[1] == pytest.approx(5.1)


def test_a_bridge_is_no_motion_and_no_leap(reading_at: ReadingAt) -> None:
    odometry = ContinuousOdometry(LiveConfig())
    odometry.take(reading_at(0.0, 1.0))
    odometry.bridge()
    passed, leap = odometry.take(reading_at(5.0, 2.0))
    assert leap == 0.0
    np.testing.assert_allclose(passed.pose, [1.0, 0.0, 0.0])
    np.testing.assert_allclose(odometry.take(reading_at(5.1, 2.2))[0].pose, [1.2, 0.0, 0.0])
    np.testing.assert_allclose(odometry.raw(np.array([1.2, 0.0, 0.0])), [2.2, 0.0, 0.0])


def test_after_a_reset_readings_are_passed_on_as_they_are(reading_at: ReadingAt) -> None:
    odometry = ContinuousOdometry(LiveConfig())
    odometry.take(reading_at(0.0, 1.0))
    odometry.take(reading_at(0.1, 50.0))
    odometry.reset()
    assert odometry.last is None
    reading = reading_at(0.2, 51.0)
    assert odometry.take(reading) == (reading, 0.0)
