from collections.abc import Callable

import numpy as np
import pytest
from mega_bench import Bench

from contourslam.robot.base.messages import COMPASS, IMU, Hello, HelloReply, State

FOUND = 0.6
# Half of the last bit of the part, and of the protocol's own unit: 1/4096 rad/s, mm/s^2, 0.1 uT.
TOLERANCES = np.repeat([0.55 + 0.5, 0.6 + 0.5, 0.9 + 0.5], 3)
READINGS = [
    (100, -2000, 3000, 1500, -2500, 9807, 210, -55, -430),
    (-4000, 17, 0, -9807, 0, 12, -2100, 1550, 999),
    (0, 0, -25000, 0, 30000, -9807, 0, 0, 480),
]


def nine(state: State) -> np.ndarray:
    return np.array([*state.gyro, *state.accel, *state.compass])


def kind(mega: Bench) -> int:
    (reply,) = [message for message in mega.run(0.05, Hello()) if isinstance(message, HelloReply)]
    return reply.imu_kind


def settle(mega: Bench) -> State:
    mega.run(0.08)
    return mega.state()


@pytest.mark.parametrize("reading", READINGS)
def test_the_imu_comes_through_with_its_axes_and_scales(shared: Bench, reading: tuple[int, ...]) -> None:
    shared.imu = reading
    state = settle(shared)
    assert state.flags & (IMU | COMPASS) == IMU | COMPASS
    assert np.all(np.abs(nine(state) - reading) <= TOLERANCES)
    assert kind(shared) == 1


def test_the_gyro_is_the_mean_of_the_time_since_the_last_state(shared: Bench) -> None:
    """So that turns add up, whatever happens between two STATEs."""
    shared.run(0.1)
    shared.imu = (0,) * 9
    shared.run(0.1)
    before = len(shared.states())
    chance = np.random.default_rng(4)
    total = 0.0
    for _ in range(200):
        rate = int(chance.integers(-8000, 8000))
        shared.imu = (0, 0, rate, 0, 0, 9807, 0, 0, 0)
        shared.step(0.005)
        total += rate * 0.005
    shared.imu = (0,) * 9
    shared.run(0.06)
    told = sum(state.gyro[2] * 0.02 for state in shared.states()[before:])
    assert told == pytest.approx(total, abs=0.02 * 50 + 8000 * 0.005)


def test_a_reading_that_does_not_fit_is_the_largest_that_does(shared: Bench) -> None:
    shared.imu = (32767, -32768, 0, 32767, -32768, 0, 32767, -32768, 0)
    state = settle(shared)
    assert state.gyro[0] >= 32700
    assert state.gyro[1] <= -32700
    assert state.accel[:2] == pytest.approx((32767, -32768), abs=2)
    assert state.compass[0] > 32000


def test_an_imu_mounted_otherwise_than_configured_is_seen_so(bench: Callable[..., Bench]) -> None:
    """The part stands with its z ahead and its x up: what it feels along its z is told as up."""
    mega = bench("--imu-axes", "3,2,1")
    mega.run(FOUND)
    mega.imu = (0, 0, 0, 0, 0, 9807, 0, 0, 0)
    assert settle(mega).accel == pytest.approx((9807, 0, 0), abs=2)


def test_without_an_imu_everything_else_goes_on(bench: Callable[..., Bench]) -> None:
    mega = bench("--imu", "none")
    mega.run(3.0)
    state = mega.state()
    assert not state.flags & (IMU | COMPASS)
    assert not np.any(nine(state))
    assert len(mega.states()) == 150
    assert kind(mega) == 0


def test_a_part_without_compass_gives_what_it_has(bench: Callable[..., Bench]) -> None:
    mega = bench("--imu", "mpu6500")
    mega.imu = READINGS[0]
    mega.run(FOUND)
    state = mega.state()
    assert state.flags & (IMU | COMPASS) == IMU
    assert np.all(np.abs(nine(state) - np.array([*READINGS[0][:6], 0, 0, 0])) <= TOLERANCES)
    assert kind(mega) == 2


def test_an_imu_that_is_unplugged_is_missed_and_found_again(bench: Callable[..., Bench]) -> None:
    mega = bench("--unplug-at", "1.0", "--plug-at", "2.0")
    mega.imu = READINGS[0]
    mega.run(1.0)
    assert mega.state().flags & IMU
    mega.run(0.06)
    assert not mega.state().flags & (IMU | COMPASS)
    assert not np.any(nine(mega.state()))
    mega.run(0.94)
    assert not mega.state().flags & IMU
    mega.run(1.6)
    assert mega.state().flags & (IMU | COMPASS) == IMU | COMPASS
    assert np.all(np.abs(nine(mega.state()) - READINGS[0]) <= TOLERANCES)
    assert mega.decoder.lost == 0


def test_a_part_that_forgot_its_settings_for_a_loose_plug_is_set_up_anew(bench: Callable[..., Bench]) -> None:
    mega = bench("--unplug-at", "1.0", "--plug-at", "1.005")  # gone for one reading
    mega.imu = READINGS[0]
    mega.run(1.9)
    assert np.all(np.abs(nine(mega.state()) - READINGS[0]) <= TOLERANCES)
    assert not all(state.flags & IMU for state in mega.states()[40:])


def test_a_part_that_holds_the_bus_is_clocked_out(bench: Callable[..., Bench]) -> None:
    mega = bench("--stick-at", "1.0")
    mega.imu = READINGS[0]
    mega.run(1.0)
    states = len(mega.states())
    mega.imu = READINGS[1]
    mega.run(0.2)
    assert np.all(np.abs(nine(mega.state()) - READINGS[1]) <= TOLERANCES)
    assert all(state.flags & IMU for state in mega.states()[states:])
    assert mega.decoder.lost == 0


def test_a_bus_that_is_held_is_given_up_and_freed(bench: Callable[..., Bench]) -> None:
    mega = bench("--stick-at", "1.0", "--free-at", "1.5")
    mega.run(1.0)
    assert mega.state().flags & IMU
    mega.run(0.1)
    assert not mega.state().flags & IMU
    mega.run(1.9)
    assert mega.state().flags & (IMU | COMPASS) == IMU | COMPASS
    assert mega.decoder.lost == 0
