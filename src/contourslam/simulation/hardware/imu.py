"""What an MPU-9250 makes of the body's motion: noise, bias, a filter, and steps of its digits."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.world import TIMESTEP

Floats = NDArray[np.float64]
GYRO, ACCEL, COMPASS = 4096.0, 1000.0, 10.0
"""Digits for a rad/s, a m/s², a microtesla."""
_BANDWIDTH = 41.0  # Hz, of the part's own low-pass filter
_GYRO_NOISE, _ACCEL_NOISE, _COMPASS_NOISE = 0.0015, 0.03, 0.6  # rad/s, m/s², µT: of one reading
_HORIZONTAL, _DOWN = 20.0, 45.0  # µT, the Earth's field in the middle of Europe
_WALK = 0.00003  # rad/s per root s, of the gyroscope's bias


class Imu:
    """The part; changed by every reading.

    Parameters
    ----------
    seed : int
        Of biases, scales and noise.

    Attributes
    ----------
    bias : ndarray, shape (3,)
        Of the gyroscope as it is now, rad/s.
    """

    def __init__(self, seed: int) -> None:
        self._chance = np.random.default_rng([seed, 102])
        draw = self._chance.uniform
        self.bias = draw(-0.02, 0.02, 3)
        self._scale = 1.0 + draw(-0.005, 0.005, 3)
        self._accel_bias, self._iron = draw(-0.2, 0.2, 3), draw(-8.0, 8.0, 3)
        north = draw(-math.pi, math.pi)
        self._field = np.array([_HORIZONTAL * math.cos(north), _HORIZONTAL * math.sin(north), -_DOWN])
        self._turn, self._force = np.zeros(3), np.array([0.0, 0.0, 9.81])
        self._weight = 1.0 - math.exp(-2.0 * math.pi * _BANDWIDTH * TIMESTEP)

    def read(self, turn: Floats, force: Floats, axes: Floats) -> tuple[int, ...]:
        """Take one step's motion, and give what the registers hold after it.

        Parameters
        ----------
        turn, force : ndarray, shape (3,)
            Turn rate (rad/s) and specific force (m/s²) in the axes of the base.
        axes : ndarray, shape (3, 3)
            Of the base in the world, as columns.

        Returns
        -------
        tuple of 9 int
            Gyroscope (1/4096 rad/s), accelerometer (mm/s²), compass (0.1 µT).
        """
        self._turn = self._turn + self._weight * (turn - self._turn)
        self._force = self._force + self._weight * (force - self._force)
        noise = self._chance.standard_normal(12)
        self.bias = self.bias + _WALK * math.sqrt(TIMESTEP) * noise[9:]
        gyro = GYRO * (self._scale * self._turn + self.bias + _GYRO_NOISE * noise[:3])
        accel = ACCEL * (self._force + self._accel_bias + _ACCEL_NOISE * noise[3:6])
        compass = COMPASS * (axes.T @ self._field + self._iron + _COMPASS_NOISE * noise[6:9])
        digits = np.clip(np.rint(np.concatenate([gyro, accel, compass])), -32768, 32767)
        return tuple(int(digit) for digit in digits.tolist())
