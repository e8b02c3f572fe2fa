"""Wheel odometry: encoders that count in ticks, and a robot that is a little wrong about its own wheels."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.motion import unicycle_step
from contourslam.simulation.chance import ODOMETRY, stream
from contourslam.simulation.config import RobotModel
from contourslam.simulation.drive import STEPS_PER_TICK, TICK, Drive

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


def read_odometry(drive: Drive, robot: RobotModel, seed: int) -> WheelOdometry:
    """Integrate the encoders through the paper's motion model (eq. 28).

    Parameters
    ----------
    drive : Drive
    robot : RobotModel
        As it is; what it believes of its wheel radius and wheel base is wrong by 0.5 to 1.5 %, drawn by seed.
    seed : int

    Returns
    -------
    WheelOdometry
    """
    chance = stream(seed, ODOMETRY)
    radius_error, base_error = chance.choice([-1.0, 1.0], 2) * chance.uniform(0.005, 0.015, 2)
    radius, base = robot.wheel_radius * (1 + radius_error), robot.wheel_base * (1 + base_error)

    turns = drive.wheel_angles[::STEPS_PER_TICK] / (2 * math.pi)
    ticks = np.floor(turns * robot.ticks_per_turn).astype(np.int64)
    rolled = np.diff(ticks, axis=0) * (2 * math.pi / robot.ticks_per_turn * radius)
    poses = [np.zeros(3)]
    for left, right in rolled.tolist():
        poses.append(unicycle_step(poses[-1], (left + right) / 2 / TICK, (right - left) / base / TICK, TICK))
    stamps = np.round(drive.times[::STEPS_PER_TICK], 9)
    return WheelOdometry(stamps, np.array(poses), ticks, float(radius_error), float(base_error))
