"""Robots on their wheels in one world, step by step: MuJoCo's physics."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.config import RobotModel
from contourslam.simulation.mjcf import import_mujoco
from contourslam.simulation.robot import Standing, draw_flaws
from contourslam.simulation.room import Room
from contourslam.simulation.world import TIMESTEP, compile_world

Floats = NDArray[np.float64]
STEPS_PER_TICK = 10  # physics steps per odometry reading and per decision of the driver
TICK = STEPS_PER_TICK * TIMESTEP  # s: 50 Hz
_SETTLING = 0.3  # s in which the robots sink onto their wheels before the clock starts
_EACH = 9  # numbers that say how a robot stands: place, quaternion, two wheels


@dataclass(frozen=True, slots=True)
class Moments:
    """How several robots stood, one row per moment.

    Attributes
    ----------
    poses : ndarray, shape (n, robots, 3)
        x (m), y (m), heading (rad) of each base in the world frame.
    positions : ndarray, shape (n, robots, 3)
        Middle of each axle in the world frame, m.
    rotations : ndarray, shape (n, robots, 3, 3)
        Axes of each base in the world frame, as columns.
    wheel_angles : ndarray, shape (n, robots, 2)
        How far the left and the right wheel have turned, rad.
    """

    poses: Floats
    positions: Floats
    rotations: Floats
    wheel_angles: Floats

    def last_pose(self, robot: int) -> tuple[float, float, float]:
        """Of the base of one robot at the last moment: x (m), y (m), heading (rad)."""
        x, y, _ = self.positions[-1, robot].tolist()
        ahead = self.rotations[-1, robot, :, 0]
        return x, y, math.atan2(ahead[1], ahead[0])

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All moments of the parts, one after the other."""
        return cls(
            np.concatenate([part.poses for part in parts]),
            np.concatenate([part.positions for part in parts]),
            np.concatenate([part.rotations for part in parts]),
            np.concatenate([part.wheel_angles for part in parts]),
        )


class Rolling:
    """Robots in a room, driven by how fast they shall go. Mutable.

    Parameters
    ----------
    room : Room
    robot : RobotModel
        All are alike but for their flaws.
    seeds : sequence of int
        Of each robot's flaws.
    starts : sequence of (x, y, heading)
        m, m, rad.

    Attributes
    ----------
    spacing : float
        Between two moments, s.
    begun : Moments
        The one at 0 s.

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    """

    spacing = TIMESTEP

    def __init__(
        self, room: Room, robot: RobotModel, seeds: Sequence[int], starts: Sequence[tuple[float, float, float]]
    ) -> None:
        self._mujoco, self._robot = import_mujoco(), robot
        # Where the model's robots stand decides the last digits of what its solver does: always at the room's start.
        self._model = compile_world(room, [Standing(robot, draw_flaws(seed), room.start) for seed in seeds])
        self._data = self._mujoco.MjData(self._model)
        each = self._data.qpos.reshape(-1, _EACH)
        for qpos, (x, y, heading) in zip(each, starts, strict=True):
            qpos[:2] = x, y
            qpos[3:7] = math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)
        self._mujoco.mj_step(self._model, self._data, round(_SETTLING / TIMESTEP))
        each[:, 7:] = 0.0  # from here on the encoders count
        self.begun = _moments(each.copy()[None])

    def step(self, twists: Sequence[tuple[float, float]]) -> Moments:
        """Move on by a tick, 20 ms; returns the moments after that at which it began.

        Parameters
        ----------
        twists : sequence of (v, omega)
            How fast each robot is told to go, m/s, and to turn, rad/s.
        """
        robot, ctrl = self._robot, self._data.ctrl.reshape(-1, 2)
        for wheels, (v, omega) in zip(ctrl, twists, strict=True):
            half_turn = 0.5 * omega * robot.wheel_base
            wheels[:] = (v - half_turn) / robot.wheel_radius, (v + half_turn) / robot.wheel_radius
        states = []
        for _ in range(STEPS_PER_TICK):
            self._mujoco.mj_step(self._model, self._data)
            states.append(self._data.qpos.copy())
        return _moments(np.array(states).reshape(STEPS_PER_TICK, -1, _EACH))


def _moments(qpos: Floats) -> Moments:
    """What the free joints and wheels, shape (n, robots, 9), say."""
    rotations = _rotations(qpos[..., 3:7])
    heading = np.arctan2(rotations[..., 1, 0], rotations[..., 0, 0])
    poses = np.stack([qpos[..., 0], qpos[..., 1], heading], axis=-1)
    return Moments(poses, qpos[..., :3], rotations, qpos[..., 7:])


def _rotations(quaternions: Floats) -> Floats:
    """Rotation matrices of quaternions (w, x, y, z), shape (..., 3, 3)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))
