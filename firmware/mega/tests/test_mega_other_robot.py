"""A robot that is wired otherwise, in everything that config.h can say."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mega_bench import Bench, Motor, build_for

from contourslam.robot.base.messages import COMPASS, IMU, Drive, Hello, HelloReply, Stop

READING = (100, -2000, 3000, 1500, -2500, 9807, 210, -55, -430)
NO_PIN = 255


@pytest.fixture(scope="module")
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    motors = {"MOTOR_LEFT_PWM": 45, "MOTOR_LEFT_IN1": 30, "MOTOR_LEFT_IN2": NO_PIN, "MOTOR_LEFT_SIGN": -1}
    motors |= {"MOTOR_RIGHT_PWM": 44, "MOTOR_RIGHT_IN1": 61, "MOTOR_RIGHT_IN2": NO_PIN, "MOTOR_DEAD_BAND": "60.0f"}
    encoders = {"ENCODER_LEFT_A": 3, "ENCODER_LEFT_B": 2, "ENCODER_RIGHT_A": 18, "ENCODER_RIGHT_B": 19}
    rest = {"ENCODER_RIGHT_SIGN": -1, "IMU_AHEAD": -3, "IMU_LEFT": -1, "IMU_UP": 2, "GAIN_KP": "0.1f"}
    battery = {"BATTERY_PIN": 5, "BATTERY_DIVIDER": "4.0f"}
    return build_for(tmp_path_factory.mktemp("other"), **motors, **encoders, **rest, **battery)


def test_its_wheels_hold_their_speeds_and_stop(bench: Callable[..., Bench], other: Path) -> None:
    mega, motors = bench(build=other), (Motor(friction=60.0), Motor(friction=60.0))
    mega.run(0.1)
    for count in range(1000):
        send = mega.frame(Drive(100, -3000)) if count % 50 == 0 else b""
        mega.step(0.001, send, (motors[0].ticks, motors[1].ticks))
        for motor, duty in zip(motors, mega.duty, strict=True):
            motor.step(0.001, duty)
        if count > 500:  # the dead band spares the integral its way through the friction
            assert motors[0].speed == pytest.approx(100, rel=0.1)
            assert motors[1].speed == pytest.approx(-3000, rel=0.05)
    mega.run(0.05, Stop())
    assert mega.duty == (0, 0)
    assert mega.state().ticks == mega.ticks


def test_its_imu_comes_through_in_the_base_frame(bench: Callable[..., Bench], other: Path) -> None:
    mega = bench("--imu-axes", "-3,-1,2", build=other)
    mega.imu = READING
    mega.run(0.6)
    state = mega.state()
    assert state.flags & (IMU | COMPASS) == IMU | COMPASS
    assert np.abs(np.array([*state.gyro, *state.accel, *state.compass]) - READING).max() <= 1.5


def test_its_battery_and_gains_are_told(bench: Callable[..., Bench], other: Path) -> None:
    mega = bench(build=other)
    mega.battery_mv = 14800
    mega.run(0.6)
    assert mega.state().battery_mv == pytest.approx(14800, rel=0.005)
    (reply,) = [message for message in mega.run(0.05, Hello()) if isinstance(message, HelloReply)]
    assert reply.kp == pytest.approx(0.1)


def test_without_a_divider_the_battery_is_0_and_not_low(
    bench: Callable[..., Bench], tmp_path_factory: pytest.TempPathFactory
) -> None:
    mega = bench(build=build_for(tmp_path_factory.mktemp("unwired"), BATTERY_WIRED=0))
    mega.battery_mv = 5000
    mega.run(2.0)
    assert mega.state().battery_mv == 0
    assert mega.state().flags == IMU | COMPASS
