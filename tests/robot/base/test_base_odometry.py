"""The odometry knows where it is, and how well it knows."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.geometry.angles import wrap
from contourslam.robot.base.odometry import Odometer, arc, arc_jacobian
from contourslam.robot.config import BaseConfig

BASE = BaseConfig()
STEP = 0.04
SMALL = st.floats(-0.5, 0.5)


def drive_of(steps: int, rng: np.random.Generator) -> np.ndarray:
    """Ways of both wheels, m, that swing between curves of both sides and stops, shape (steps, 2)."""
    time = STEP * np.arange(steps)
    speed = 0.25 * (1.0 + np.sin(2 * math.pi * time / 7.0 + rng.uniform(0, 6)))
    turning = 0.8 * np.sin(2 * math.pi * time / 11.0 + rng.uniform(0, 6))
    turning[speed < 0.05] = speed[speed < 0.05] = 0.0
    half = 0.5 * turning * BASE.wheel_base
    return STEP * np.stack([speed - half, speed + half], axis=1)


def driven(ways: np.ndarray, config: BaseConfig, rng: np.random.Generator) -> tuple[Odometer, np.ndarray]:
    """Odometry of a robot whose wheels and gyroscope err as the configuration says; and the true pose at the end."""
    odometer, true = Odometer(config), np.zeros(3)
    bias, scale = rng.normal(0.0, 0.05), 1.0 + rng.normal(0.0, config.gyro_scale_sigma)
    for measured in ways:
        rolled = measured + config.wheel_sigma * np.sqrt(np.abs(measured)) * rng.normal(size=2)
        way, turn = rolled.mean(), (rolled[1] - rolled[0]) / config.wheel_base
        true = arc(true, way, config.lateral_sigma * math.sqrt(abs(way)) * rng.normal(), turn)
        bias += config.gyro_bias_walk * math.sqrt(STEP) * rng.normal()
        rate = scale * turn / STEP + bias + config.gyro_sigma / math.sqrt(STEP) * rng.normal()
        odometer.step(measured, STEP, rate if config.use_gyro else None)
    return odometer, true


@given(SMALL, SMALL, st.floats(-3.0, 3.0), SMALL, st.floats(-0.05, 0.05), st.floats(-1.0, 1.0))
def test_the_jacobian_is_that_of_finite_differences(
    x: float, y: float, heading: float, way: float, aside: float, turn: float
) -> None:
    at, small = np.array([x, y, heading, way, aside, turn]), 1e-6

    def moved(values: np.ndarray) -> np.ndarray:
        return arc(values[:3], *values[3:])

    numeric = [(moved(at + small * unit) - moved(at - small * unit)) / (2 * small) for unit in np.eye(6)]
    turned = np.array(numeric).T
    turned[2] = wrap(turned[2] * 2 * small) / (2 * small)
    np.testing.assert_allclose(arc_jacobian(at[:3], way, aside, turn), turned, atol=1e-6)


@given(st.floats(0.1, 2.0), st.floats(-3.0, 3.0), st.integers(1, 7))
def test_an_arc_in_pieces_is_the_arc(way: float, turn: float, pieces: int) -> None:
    pose = np.array([0.3, -0.2, 2.5])
    whole, cut = arc(pose, way, 0.0, turn), pose
    for _ in range(pieces):
        cut = arc(cut, way / pieces, 0.0, turn / pieces)
    np.testing.assert_allclose(cut[:2], whole[:2], atol=1e-9)
    assert wrap(cut[2] - whole[2]) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("use_gyro", [True, False])
def test_the_covariance_is_honest(use_gyro: bool) -> None:
    config, rng = replace(BASE, use_gyro=use_gyro), np.random.default_rng(7)
    runs, nees = 50, []
    for _ in range(runs):
        odometer, true = driven(drive_of(200, rng), config, rng)
        error = true - odometer.pose
        error[2] = wrap(error[2])
        nees.append(error @ np.linalg.solve(odometer.covariance, error))
    # The mean of 50 chi squares of 3 degrees of freedom lies in [2.0, 4.1] in 996 of 1000 experiments.
    assert 2.0 < np.mean(nees) < 4.1


def test_with_the_gyroscope_the_heading_is_known_many_times_better() -> None:
    rng = np.random.default_rng(8)
    errors = {
        use: [
            abs(wrap(true[2] - odometer.pose[2]))
            for odometer, true in (driven(drive_of(200, rng), replace(BASE, use_gyro=use), rng) for _ in range(12))
        ]
        for use in (True, False)
    }
    assert np.mean(errors[True]) < 0.2 * np.mean(errors[False])


def test_the_bias_is_found_at_rest_within_two_seconds_and_heading_stands_still() -> None:
    odometer, rng = Odometer(BASE), np.random.default_rng(9)
    for _ in range(50):
        odometer.step(np.zeros(2), STEP, 0.05 + BASE.gyro_sigma / math.sqrt(STEP) * rng.normal())
    assert odometer.bias == pytest.approx(0.05, abs=0.002) and odometer.bias_sigma < 0.001
    assert abs(odometer.pose[2]) < 2e-4 and not odometer.slipping


def test_a_slow_turn_from_tick_to_tick_is_no_rest() -> None:
    rng = np.random.default_rng(14)
    odometer, rate, turned = settled(rng), 0.02, 0.0
    for _ in range(1500):
        before, turned = turned, turned + rate * STEP
        ticks = [np.floor(side * angle * 0.5 * BASE.wheel_base / BASE.metres_per_tick[0])
                 for side in (-1, 1) for angle in (before, turned)]  # fmt: skip
        ways = np.array([ticks[1] - ticks[0], ticks[3] - ticks[2]]) * BASE.metres_per_tick
        odometer.step(ways, STEP, rate + BASE.gyro_sigma / math.sqrt(STEP) * rng.normal())
    assert odometer.pose[2] == pytest.approx(turned, abs=0.02)
    assert odometer.bias == pytest.approx(0.0, abs=0.002)


def test_without_a_gyroscope_the_wheels_alone_give_the_way() -> None:
    odometer = Odometer(BASE)
    for _ in range(100):
        odometer.step(np.array([0.004, 0.006]), 0.02, None)
    turn = 100 * 0.002 / BASE.wheel_base
    np.testing.assert_allclose(odometer.pose, arc(np.zeros(3), 0.5, 0.0, turn), atol=1e-9)
    now = odometer.now(12.0)
    assert (now.speed, now.turn_rate) == (pytest.approx(0.25), pytest.approx(0.1 / BASE.wheel_base))
    assert now.reading().stamp == 12.0 and (now.reading().pose == odometer.pose).all()


def settled(rng: np.random.Generator) -> Odometer:
    odometer = Odometer(BASE)
    for _ in range(100):
        odometer.step(np.zeros(2), STEP, BASE.gyro_sigma / math.sqrt(STEP) * rng.normal())
    return odometer


def test_a_wheel_that_spins_in_place_is_found_out_and_the_heading_stays_true() -> None:
    rng = np.random.default_rng(10)
    odometer = settled(rng)
    before = odometer.covariance
    for _ in range(50):  # the left wheel spins at 0.3 m/s, the robot stands
        odometer.step(np.array([0.006, 0.0]), STEP, BASE.gyro_sigma / math.sqrt(STEP) * rng.normal())
    assert odometer.slipping
    assert abs(odometer.pose[2]) < 0.03  # the wheels alone would say 1.15 rad
    assert odometer.bias == pytest.approx(0.0, abs=0.003)
    way = float(np.linalg.norm(odometer.pose[:2]))
    assert way < 3.0 * math.sqrt(np.trace(odometer.covariance[:2, :2] - before[:2, :2]))
    for _ in range(30):
        odometer.step(np.zeros(2), STEP, BASE.gyro_sigma / math.sqrt(STEP) * rng.normal())
    assert not odometer.slipping


def test_a_robot_that_is_turned_by_hand_knows_it() -> None:
    rng = np.random.default_rng(11)
    odometer = settled(rng)
    for _ in range(25):
        odometer.step(np.zeros(2), STEP, 1.0 + BASE.gyro_sigma / math.sqrt(STEP) * rng.normal())
    assert odometer.pose[2] == pytest.approx(1.0, abs=0.05)


def test_a_good_drive_is_no_slip() -> None:
    rng = np.random.default_rng(12)
    ways, odometer, slips = drive_of(700, rng), settled(rng), 0
    for way in ways:
        turn = (way[1] - way[0]) / BASE.wheel_base
        ticks = np.rint(way * (1 + 0.01 * rng.normal(size=2)) / BASE.metres_per_tick) * BASE.metres_per_tick
        odometer.step(ticks, STEP, turn / STEP + BASE.gyro_sigma / math.sqrt(STEP) * rng.normal())
        slips += odometer.slipping
    assert slips == 0


def test_over_a_gap_no_way_is_lost_and_the_doubt_grows() -> None:
    short, long = Odometer(BASE), Odometer(BASE)
    for _ in range(25):
        short.step(np.array([0.01, 0.01]), 0.02, 0.0)
    long.step(np.array([0.25, 0.25]), 25 * 0.02, 0.0, 0.02)
    np.testing.assert_allclose(long.pose, short.pose, atol=1e-9)
    assert (np.diag(long.covariance) > np.diag(short.covariance))[1:].all()


def test_the_covariance_stays_symmetric_and_positive() -> None:
    rng = np.random.default_rng(13)
    odometer, _ = driven(drive_of(700, rng), BASE, rng)
    odometer.interrupted()
    assert (odometer.covariance == odometer.covariance.T).all()
    assert (np.linalg.eigvalsh(odometer.covariance) > 0).all()
