"""Wheel odometry: encoders that count in ticks, and a robot that is a little wrong about its own wheels."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.motion import unicycle_step
from contourslam.geometry.poses import between
from contourslam.simulation.chance import ODOMETRY, stream
from contourslam.simulation.config import RobotModel
from contourslam.simulation.drive import Drive
from contourslam.simulation.rolling import STEPS_PER_TICK, TICK

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WheelOdometry:
    """What the robot believes about its way.

    Attributes
    ----------
    stamps : ndarray, shape (m,)
        s, from 0.
    poses : ndarray, shape (m, 3)
        x (m), y (m), heading (rad) of the base in the odometry frame, which starts at the base.
    ticks : ndarray of int, shape (m, 2)
        Encoder counts of the left and the right wheel.
    radius_error, base_error : float
        How much too long the wheel radius and the wheel base are believed to be, as a fraction.
    """

    stamps: Floats
    poses: Floats
    ticks: NDArray[np.int64]
    radius_error: float
    base_error: float


def read_odometry(
    drive: Drive, robot: RobotModel, seed: int, *, errors: tuple[float, float] | None = None
) -> WheelOdometry:
    """Integrate the encoders through the paper's motion model (eq. 28).

    Parameters
    ----------
    drive : Drive
    robot : RobotModel
        As it is; what it believes of its wheel radius and wheel base is wrong by 0.5 to 1.5 %, drawn by seed.
    seed : int
    errors : tuple of (float, float), optional
        By how much radius and base are wrong instead, as fractions.

    Returns
    -------
    WheelOdometry
    """
    encoders = Encoders(robot, seed, errors=errors)
    poses, ticks = zip(
        *(encoders.read(angles) for angles in drive.wheel_angles[::STEPS_PER_TICK].tolist()), strict=True
    )
    stamps = np.round(drive.times[::STEPS_PER_TICK], 9)
    return WheelOdometry(stamps, np.array(poses), np.array(ticks), encoders.radius_error, encoders.base_error)


class Encoders:
    """The encoders of a robot, and what it makes of them, reading by reading. Mutable.

    Parameters
    ----------
    robot, seed, errors
        As :func:`read_odometry` takes them.

    Attributes
    ----------
    radius_error, base_error : float
        As of :class:`WheelOdometry`.
    """

    def __init__(self, robot: RobotModel, seed: int, *, errors: tuple[float, float] | None = None) -> None:
        chance = stream(seed, ODOMETRY)
        drawn = chance.choice([-1.0, 1.0], 2) * chance.uniform(0.005, 0.015, 2)
        wrong: tuple[float, float] = tuple(drawn.tolist()) if errors is None else errors
        self.radius_error, self.base_error = wrong
        self._base = robot.wheel_base * (1 + self.base_error)
        self._per_turn = robot.ticks_per_turn
        self._way = 2 * math.pi / robot.ticks_per_turn * (robot.wheel_radius * (1 + self.radius_error))  # m per tick
        self._pose = np.zeros(3)
        self._ticks: tuple[int, int] | None = None

    def read(self, angles: Sequence[float]) -> tuple[Floats, tuple[int, int]]:
        """Pose in the frame of the first reading, shape (3,), and counts, at angles of left and right wheel, rad."""
        now = (self._count(angles[0]), self._count(angles[1]))
        if self._ticks is not None:
            left, right = ((now[side] - self._ticks[side]) * self._way for side in (0, 1))
            self._pose = unicycle_step(self._pose, (left + right) / 2 / TICK, (right - left) / self._base / TICK, TICK)
        self._ticks = now
        return self._pose, now

    def _count(self, angle: float) -> int:
        return math.floor(angle / (2 * math.pi) * self._per_turn)


def effective_wheels(drive: Drive) -> tuple[float, float, float]:
    """Radii and wheel base at which the robot really rolled: tyres creep, so that they are not those of its drawing.

    The mean radius is that which makes the angle of the wheels the true way; the wheel base, and how the radii differ,
    those that make it the true turn (linear least squares over the whole drive, every tick by itself).

    Parameters
    ----------
    drive : Drive

    Returns
    -------
    left_radius, right_radius, wheel_base : float
        m.
    """
    poses, turned = drive.poses[::STEPS_PER_TICK], np.diff(drive.wheel_angles[::STEPS_PER_TICK], axis=0)
    steps = between(poses[:-1], poses[1:])
    way = steps[:, 0] * np.cos(0.5 * steps[:, 2]) + steps[:, 1] * np.sin(0.5 * steps[:, 2])
    mean = turned.mean(axis=1)
    radius = float(way @ mean / (mean @ mean))
    left, right = np.linalg.lstsq(turned, steps[:, 2], rcond=None)[0].tolist()  # -left / base, right / base
    base = 2.0 * radius / (right - left)
    return -left * base, right * base, base
