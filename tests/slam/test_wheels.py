import math

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import SlamConfig
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.wheels import CRUISE, Wheels

Floats = NDArray[np.float64]
PERIOD = 0.1


def scan(stamp: float) -> LaserScan:
    return LaserScan(stamp, np.zeros(1), np.ones(1), np.zeros(1), 0.05, 30.0)


def driven(xs: list[float]) -> Wheels:
    """Wheels that have told the place x at each scan so far; the robot went as they say."""
    wheels = Wheels(SlamConfig())
    for i, x in enumerate(xs):
        step(wheels, i, x)
        wheels.went(np.array([x - xs[max(i - 1, 0)], 0.0, 0.0]))
    return wheels


def step(wheels: Wheels, number: int, x: float) -> tuple[Floats, Floats]:
    stamp = number * PERIOD
    wheels.push(Odometry(stamp, np.array([x, 0.0, 0.0])))
    return wheels.step_or_guess(stamp, wheels.during(scan(stamp)))


def guessed(noise: Floats) -> bool:
    return bool(np.allclose(np.diag(noise), (CRUISE * PERIOD) ** 2))


def test_wheels_that_have_never_turned_say_nothing() -> None:
    wheels = driven([0.0, 0.0, 0.0])
    wheels.went(np.array([0.05, 0.0, 0.02]))
    increment, noise = step(wheels, 3, 0.0)
    np.testing.assert_allclose(increment, [0.05, 0.0, 0.02])
    assert guessed(noise)


def test_wheels_that_turn_are_believed_from_then_on_also_at_rest() -> None:
    wheels = driven([0.0, 0.0, 0.05, 0.10])
    increment, noise = step(wheels, 4, 0.15)
    np.testing.assert_allclose(increment, [0.05, 0.0, 0.0], atol=1e-12)
    assert not guessed(noise)
    wheels.went(increment)
    increment, noise = step(wheels, 5, 0.15)
    np.testing.assert_array_equal(increment, 0.0)
    assert not guessed(noise)


@pytest.mark.parametrize("pushed", [(0.05, 0.0, 0.0), (0.0, 0.0, math.radians(2.0))])
def test_wheels_that_stand_while_the_robot_moves_are_dead_until_they_turn(pushed: tuple[float, float, float]) -> None:
    wheels = driven([0.0, 0.05, 0.10])
    step(wheels, 3, 0.10)
    wheels.went(np.array(pushed))
    increment, noise = step(wheels, 4, 0.10)
    assert guessed(noise)
    np.testing.assert_allclose(increment, pushed)
    assert not guessed(step(wheels, 5, 0.15)[1])


def test_wheels_at_rest_are_believed_where_the_contours_only_tremble() -> None:
    wheels = driven([0.0, 0.05, 0.10])
    for i in range(3, 30):
        assert not guessed(step(wheels, i, 0.10)[1])
        wheels.went(np.array([0.004 * (-1.0) ** i, 0.003, 0.002]))
