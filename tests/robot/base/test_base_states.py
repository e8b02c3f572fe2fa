"""Over wraps, lost frames, resets and late bytes, no way is lost and none invented."""

import math
from dataclasses import replace

import numpy as np
import pytest

from contourslam.robot.base.messages import COMPASS, IMU, State
from contourslam.robot.base.states import BaseState, StateReader
from contourslam.robot.config import BaseConfig

BASE = BaseConfig()
FRAME = 46


def said(time_us: int, left: int, right: int, flags: int = IMU) -> State:
    ticks = (left + 2**31) % 2**32 - 2**31, (right + 2**31) % 2**32 - 2**31
    return State(time_us % 2**32, ticks, (0, 0, 0), (0, 0, 9807), (100, -200, 300), 7400, (100, -50), 0, flags)


def drive(reader: StateReader, states: list[State], begin: float = 100.0, step: float = 0.02) -> list[BaseState]:
    taken = [reader.take(state, begin + step * k, FRAME) for k, state in enumerate(states)]
    return [state for state in taken if state is not None]


def test_the_units_are_si() -> None:
    state = replace(said(20000, 1024, -512, IMU | COMPASS), gyro=(0, 4096, -2048))
    told = StateReader(BASE).take(state, 5.0, FRAME)
    assert told is not None
    assert told.gyro == (0.0, 1.0, -0.5) and told.acceleration == (0.0, 0.0, 9.807)
    assert told.compass == pytest.approx((1e-5, -2e-5, 3e-5)) and told.battery == 7.4
    assert told.duty == pytest.approx((0.1, -0.05))
    assert told.ticks == (0, 0) and told.wheel_angles == (0.0, 0.0)  # counted from here


def test_what_does_not_answer_says_nothing() -> None:
    told = StateReader(BASE).take(replace(said(20000, 0, 0, 0), battery_mv=0), 5.0, FRAME)
    assert told is not None
    assert (told.gyro, told.acceleration, told.compass, told.battery, told.inertial()) == (None,) * 5


@pytest.mark.parametrize("begin", [0, 2**32 - 1_000_000])
@pytest.mark.parametrize("ticks", [0, 2**31 - 500, -(2**31) + 500])
def test_clock_and_ticks_may_wrap(begin: int, ticks: int) -> None:
    states = [said(begin + 20000 * k, ticks + 20 * k, ticks - 20 * k) for k in range(101)]
    told = drive(StateReader(BASE), states)
    assert told[-1].ticks == (2000, -2000)
    assert told[-1].stamp - told[0].stamp == pytest.approx(2.0, abs=1e-3)
    assert told[-1].wheel_angles[0] == pytest.approx(2000 * 2 * math.pi / 2048)
    assert told[50].wheel_speeds == pytest.approx((1000 * 2 * math.pi / 2048, -1000 * 2 * math.pi / 2048), rel=1e-3)


def test_with_lost_frames_no_way_is_lost() -> None:
    rng = np.random.default_rng(3)
    states = [said(20000 * k, 40 * k, 40 * k) for k in range(500)]
    whole, holes = StateReader(BASE), StateReader(BASE)
    drive(whole, states)
    kept = [k for k in range(500) if k in (0, 499) or rng.random() < 0.2]
    for k in kept:
        holes.take(states[k], 100.0 + 0.02 * k, FRAME)
    np.testing.assert_allclose(holes.odometer.pose, whole.odometer.pose, atol=1e-9)
    assert holes.resets == 0


def test_a_reset_makes_no_jump_and_what_was_rolled_since_the_start_counts() -> None:
    reader = StateReader(BASE)
    before = drive(reader, [said(20000 * k, 30 * k, 30 * k) for k in range(1, 200)])
    pose, doubt = before[-1].odometry.pose, before[-1].odometry.covariance
    after = drive(reader, [said(20000 * k, 10 * k, 10 * k) for k in range(1, 50)], begin=106.0)
    assert reader.resets == 1
    way = 10 * BASE.metres_per_tick[0]
    assert after[0].odometry.pose[0] == pytest.approx(pose[0] + way, abs=1e-6)
    assert after[-1].odometry.pose[0] == pytest.approx(pose[0] + 49 * way, abs=1e-6)
    assert after[0].odometry.covariance[0, 0] > doubt[0, 0] + 1e-3
    assert after[-1].ticks == (30 * 198 + 10 * 49,) * 2
    assert after[0].stamp > 105.9


def test_a_board_that_ran_on_while_the_cable_was_out_loses_no_way() -> None:
    reader = StateReader(BASE)
    drive(reader, [said(20000 * k, 30 * k, 30 * k) for k in range(100)])
    reader.reopened()
    told = reader.take(said(20000 * 300, 30 * 300, 30 * 300), 106.0, FRAME)
    assert told is not None and reader.resets == 0 and told.ticks == (9000, 9000)


def test_a_board_that_began_anew_while_the_cable_was_out_is_found_out() -> None:
    reader = StateReader(BASE)
    drive(reader, [said(20000 * k, 30 * k, 30 * k) for k in range(50)])  # it ran for 1 s
    reader.reopened()
    told = reader.take(said(1_500_000, 0, 0), 130.0, FRAME)  # and now for 1.5 s, half a minute later
    assert told is not None and reader.resets == 1 and told.ticks == (30 * 49,) * 2


def test_states_that_are_read_late_after_a_pause_are_no_reset() -> None:
    reader = StateReader(BASE)
    drive(reader, [said(20000 * k, 30 * k, 30 * k) for k in range(100)])
    for k in range(100, 150):
        reader.take(said(20000 * k, 30 * k, 30 * k), 108.0, FRAME * (150 - k))
    assert reader.resets == 0 and reader.odometer.pose[0] == pytest.approx(30 * 149 * BASE.metres_per_tick[0])


@pytest.mark.parametrize("off", [0.995, 1.0, 1.005])
def test_the_stamps_follow_the_boards_clock_and_not_the_delays(off: float) -> None:
    rng = np.random.default_rng(4)
    reader, errors = StateReader(BASE), []
    for k in range(1500):
        true = 1000.0 + 0.02 * k * off
        late = 0.02 * rng.random() ** 3 + (0.1 if rng.random() < 0.01 else 0.0)
        told = reader.take(said(20000 * k, 0, 0), true + FRAME * 10 / 115200 + late, FRAME)
        assert told is not None
        errors.append(told.stamp - true)
    assert np.abs(errors[500:]).max() < 0.004
    assert (np.diff(errors) > -0.02).all()  # so stamps rise


def test_the_same_state_again_is_passed_over() -> None:
    reader = StateReader(BASE)
    assert reader.take(said(20000, 5, 5), 1.0, FRAME) is not None
    assert reader.take(said(20000, 5, 5), 1.02, FRAME) is None


def test_wheels_wired_backwards_count_ahead() -> None:
    config = replace(BASE, left_sign=-1)
    told = drive(StateReader(config), [said(20000 * k, -20 * k, 20 * k) for k in range(50)])[-1]
    assert told.wheel_angles[0] == told.wheel_angles[1] > 0 and told.odometry.pose[0] > 0
    assert told.wheels().angles == told.wheel_angles
