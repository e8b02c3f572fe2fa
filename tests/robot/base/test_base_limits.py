"""What is asked of the base is kept to what it can do, and the curve stays the curve."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.errors import ConfigError
from contourslam.robot.base.limits import check, limited, towards, wheel_command
from contourslam.robot.base.messages import MOST_TICKS
from contourslam.robot.config import BaseConfig

BASE = BaseConfig()
SPEED, TURN = st.floats(-5.0, 5.0), st.floats(-20.0, 20.0)


@given(SPEED, TURN)
def test_no_limit_is_passed_and_the_curve_keeps_its_radius(v: float, omega: float) -> None:
    slow_v, slow_omega = limited((v, omega), BASE)
    assert abs(slow_v) <= BASE.max_speed + 1e-9 and abs(slow_omega) <= BASE.max_turn_rate + 1e-9
    for side in (-1, 1):
        assert abs(slow_v + side * 0.5 * slow_omega * BASE.wheel_base) <= BASE.max_wheel_speed + 1e-9
    assert slow_v * omega == pytest.approx(v * slow_omega, abs=1e-9)


@given(st.floats(-0.3, 0.3), st.floats(-1.0, 1.0))
def test_what_is_within_the_limits_is_left_alone(v: float, omega: float) -> None:
    assert limited((v, omega), BASE) == (v, omega)


@given(st.floats(-0.5, 0.5), st.floats(-2, 2), st.floats(-0.5, 0.5), st.floats(-2, 2), st.floats(0.001, 0.1))
def test_acceleration_is_limited_and_the_wanted_twist_is_reached(
    v0: float, omega0: float, v1: float, omega1: float, dt: float
) -> None:
    now = (v0, omega0)
    for _ in range(2000):
        after = towards(now, (v1, omega1), dt, BASE)
        assert abs(after[0] - now[0]) <= BASE.max_acceleration * dt + 1e-9
        assert abs(after[1] - now[1]) <= BASE.max_turn_acceleration * dt + 1e-9
        now = after
        if now == (v1, omega1):
            break
    assert now == pytest.approx((v1, omega1))


def test_from_rest_the_curve_is_the_wanted_one_from_the_start() -> None:
    v, omega = towards((0.0, 0.0), (0.4, 1.0), 0.02, BASE)
    assert v / omega == pytest.approx(0.4)


@given(SPEED, TURN)
def test_no_command_is_beyond_what_the_base_obeys(v: float, omega: float) -> None:
    fine = replace(BASE, ticks_per_turn=200_000)
    command = wheel_command(limited((v, omega), fine), fine)
    assert max(abs(command.left), abs(command.right)) <= MOST_TICKS


def test_straight_ahead_both_wheels_turn_alike_and_a_wheel_wired_backwards_turns_back() -> None:
    command = wheel_command((0.2, 0.0), replace(BASE, right_sign=-1))
    assert command.left == -command.right == round(0.2 / (2 * math.pi * 0.05 / 2048))


def test_to_the_left_the_right_wheel_is_faster() -> None:
    command = wheel_command((0.0, 1.0), BASE)
    assert command.right == -command.left > 0


@pytest.mark.parametrize("twist", [(math.nan, 0.0), (0.0, math.inf)])
def test_what_is_no_number_is_refused(twist: tuple[float, float]) -> None:
    with pytest.raises(ConfigError, match="finite"):
        check(*twist)
