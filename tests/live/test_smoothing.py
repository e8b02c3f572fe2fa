"""The published correction never moves the robot faster than its rates, and reaches the raw value."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import LiveConfig
from contourslam.geometry.poses import between, compose
from contourslam.live.smoothing import Smoother

Floats = NDArray[np.float64]
CONFIG = LiveConfig(smooth_speed=0.5, smooth_turn_rate_deg=20.0, large_correction=1.0, large_correction_deg=30.0)
TURN_RATE = math.radians(20.0)

PLACES = st.floats(-50.0, 50.0)
POSES = st.tuples(PLACES, PLACES, st.floats(-math.pi, math.pi)).map(np.array)
SMALL = st.tuples(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7), st.floats(-0.5, 0.5)).map(np.array)
TIMES = st.floats(0.0, 0.3)


def moved(first: Floats, second: Floats, T_odom_base: Floats) -> tuple[float, float]:
    """How far the robot moves in the map when one correction takes the place of another: m, rad."""
    step = between(compose(first, T_odom_base), compose(second, T_odom_base))
    return math.hypot(step[0], step[1]), abs(float(step[2]))


def test_before_the_first_correction_there_is_nothing() -> None:
    assert Smoother(CONFIG).at(1.0) is None


def test_the_first_correction_is_taken_over_at_once() -> None:
    raw = np.array([3.0, -7.0, 3.0])
    np.testing.assert_array_equal(Smoother(CONFIG).correct(raw, np.array([1.0, 2.0, 0.3]), 5.0), raw)


@given(start=POSES, base=POSES, drive=SMALL, change=SMALL, times=st.lists(TIMES, min_size=1, max_size=20))
def test_no_correction_moves_the_robot_faster_than_the_rates(
    start: Floats, base: Floats, drive: Floats, change: Floats, times: list[float]
) -> None:
    smoother = Smoother(CONFIG)
    before, now = smoother.correct(start, base, 0.0), 0.0
    for i, elapsed in enumerate(times):
        now += elapsed
        if i % 3 == 0:
            base = compose(base, drive)
            # A correction about the robot, so that it stays below what counts as large.
            raw = between(between(compose(compose(before, base), change), np.zeros(3)), between(base, np.zeros(3)))
            after = smoother.correct(raw, base, now)
        else:
            after = smoother.at(now)
        assert after is not None
        way, turn = moved(before, after, base)
        assert way <= CONFIG.smooth_speed * elapsed + 1e-9
        assert turn <= TURN_RATE * elapsed + 1e-9
        before = after


@given(start=POSES, base=POSES, raw=POSES)
def test_any_correction_is_over_in_bounded_time_and_then_exact(start: Floats, base: Floats, raw: Floats) -> None:
    smoother = Smoother(CONFIG)
    smoother.correct(start, base, 0.0)
    smoother.correct(raw, base, 0.0)
    longest = max(CONFIG.smooth_within, CONFIG.large_correction / CONFIG.smooth_speed, math.radians(30.0) / TURN_RATE)
    for k in range(1, 11):
        smooth = smoother.at((longest + 1e-6) * k / 10)
    np.testing.assert_array_equal(smooth, raw)


@given(start=POSES, base=POSES, raw=POSES)
def test_it_goes_straight_and_the_short_way_round(start: Floats, base: Floats, raw: Floats) -> None:
    smoother = Smoother(CONFIG)
    smoother.correct(start, base, 0.0)
    smoother.correct(raw, base, 0.0)
    left = moved(start, raw, base)
    for k in range(1, 10):
        smooth = smoother.at(0.1 * k)
        assert smooth is not None
        assert -math.pi < smooth[2] <= math.pi
        now = moved(smooth, raw, base)
        done = moved(start, smooth, base)
        assert now[0] + done[0] == pytest.approx(left[0], abs=1e-9)
        assert now[1] + done[1] == pytest.approx(left[1], abs=1e-9)
        assert now[0] <= left[0] + 1e-9


def test_a_correction_within_reach_is_exact() -> None:
    smoother = Smoother(CONFIG)
    base = np.array([40.0, 3.0, 2.0])
    smoother.correct(np.array([0.1, 0.2, 0.3]), base, 0.0)
    raw = np.array([0.1004, 0.2003, 0.3001])
    np.testing.assert_array_equal(smoother.correct(raw, base, 0.1), raw)


def test_a_heading_far_from_the_origin_of_the_odometry_does_not_swing_the_robot() -> None:
    smoother = Smoother(CONFIG)
    base = np.array([100.0, 0.0, 0.0])
    smoother.correct(np.zeros(3), base, 0.0)
    turned = compose(np.array([100.0, 0.0, math.radians(10.0)]), between(base, np.zeros(3)))
    assert math.hypot(*turned[:2]) > 15.0
    for k in range(1, 6):
        smooth = smoother.correct(turned, base, 0.1 * k)
        np.testing.assert_allclose(compose(smooth, base)[:2], [100.0, 0.0], atol=1e-9)
    np.testing.assert_array_equal(smooth, turned)


def test_a_large_correction_goes_faster_and_an_ordinary_one_after_it_does_not() -> None:
    smoother = Smoother(CONFIG)
    base = np.zeros(3)
    smoother.correct(np.zeros(3), base, 0.0)
    far = np.array([8.0, 0.0, 0.0])
    smoother.correct(far, base, 0.0)
    way = []
    for k in range(1, 12):
        smooth = smoother.correct(far, base, 0.1 * k)  # each scan says so again
        way.append(float(smooth[0]))
    np.testing.assert_allclose(np.diff([0.0, *way[:10]]), 0.8, atol=1e-9)
    np.testing.assert_array_equal(smooth, far)
    near = np.array([8.5, 0.0, 0.0])
    np.testing.assert_allclose(smoother.correct(near, base, 1.2)[0], 8.05)


def test_times_out_of_order_neither_move_nor_count_twice() -> None:
    smoother = Smoother(CONFIG)
    base = np.zeros(3)
    smoother.correct(np.zeros(3), base, 10.0)
    smoother.correct(np.array([0.9, 0.0, 0.0]), base, 10.0)
    for time in (10.5, 10.1, 10.4, 10.5):
        smooth = smoother.at(time)
        assert smooth is not None
        assert smooth[0] == pytest.approx(0.25)
    smooth = smoother.at(3.0)  # the clock was set back
    assert smooth is not None
    assert smooth[0] == pytest.approx(0.25)
    smooth = smoother.at(3.2)
    assert smooth is not None
    assert smooth[0] == pytest.approx(0.35)


def test_a_rate_of_zero_smooths_nothing() -> None:
    smoother = Smoother(LiveConfig(smooth_speed=0.0))
    smoother.correct(np.zeros(3), np.zeros(3), 0.0)
    raw = np.array([0.4, 0.1, 1.0])
    np.testing.assert_array_equal(smoother.correct(raw, np.zeros(3), 0.01), raw)
