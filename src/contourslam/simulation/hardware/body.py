"""The robot in its room, step by step: wheels turned by DC motors, encoders that count, what the IMU feels."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.config import RobotModel
from contourslam.simulation.mjcf import import_mujoco
from contourslam.simulation.robot import Standing, draw_flaws
from contourslam.simulation.room import Room
from contourslam.simulation.world import TIMESTEP, compile_world

Floats = NDArray[np.float64]
GRAVITY = 9.81
_SETTLING = 0.3  # s in which the robot sinks onto its wheels before the clock starts
_KEPT = 64  # steps that are remembered, for beams of a moment ago


@dataclass(frozen=True, slots=True)
class Motor:
    """A DC motor with its gear: its torque falls evenly from standstill to its no-load speed.

    Attributes
    ----------
    stall : float
        Torque at full duty while it stands, Nm.
    no_load : float
        Speed at full duty without load, rad/s.
    """

    stall: float = 0.6
    no_load: float = 16.0

    def torque(self, duty: float, omega: float) -> float:
        """Torque (Nm) at a duty (-1 to 1) and a speed (rad/s)."""
        return self.stall * (duty - omega / self.no_load)


@dataclass(frozen=True, slots=True)
class Moment:
    """The body after one step.

    Attributes
    ----------
    time : float
        s since the start.
    position : tuple of (float, float, float)
        Middle of the axle, m, world frame.
    axes : ndarray, shape (3, 3)
        Axes of the base in the world frame, as columns.
    """

    time: float
    position: tuple[float, float, float]
    axes: Floats

    @property
    def pose(self) -> tuple[float, float, float]:
        """Of the base: x (m), y (m), heading (rad)."""
        return *self.position[:2], math.atan2(self.axes[1, 0], self.axes[0, 0])


class Body:
    """The robot; changed by every step.

    Parameters
    ----------
    room : Room
    robot : RobotModel
    motor : Motor
    seed : int
        Of what is a little wrong about this one copy, and how it stands.
    """

    def __init__(self, room: Room, robot: RobotModel, motor: Motor, seed: int) -> None:
        self._mujoco = import_mujoco()
        self._model = compile_world(room, [Standing(robot, draw_flaws(seed), room.start)])
        # A velocity servo of this gain, told the speed at which the duty's voltage is used up, is a DC motor.
        gain = motor.stall / motor.no_load
        self._model.actuator_gainprm[:, 0], self._model.actuator_biasprm[:, 2] = gain, -gain
        self._model.actuator_forcerange[:] = -motor.stall, motor.stall
        self._data = self._mujoco.MjData(self._model)
        self._no_load, self._ticks_per_turn = motor.no_load, robot.ticks_per_turn
        chance = np.random.default_rng([seed, 101])
        heading = float(room.start[2]) + chance.uniform(-0.05, 0.05)
        self._data.qpos[:2] = room.start[:2] + chance.uniform(-0.03, 0.03, 2)
        self._data.qpos[3:7] = math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)
        self._mujoco.mj_step(self._model, self._data, round(_SETTLING / TIMESTEP))
        self._data.qpos[7:9] = 0.0  # from here on the encoders count
        self._steps = 0
        self.moments: deque[Moment] = deque(maxlen=_KEPT)
        self._remember()

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self._steps * TIMESTEP

    @property
    def now(self) -> Moment:
        """The body as it is now."""
        return self.moments[-1]

    def step(self, duty: tuple[float, float]) -> None:
        """Move on by one step of the physics, 2 ms.

        Parameters
        ----------
        duty : tuple of (float, float)
            Of the left and the right motor, -1 to 1.
        """
        self._data.ctrl[:] = duty[0] * self._no_load, duty[1] * self._no_load
        self._mujoco.mj_step(self._model, self._data)
        self._steps += 1
        self._remember()

    def _remember(self) -> None:
        x, y, z, w, i, j, k = self._data.qpos[:7].tolist()
        axes = np.array(
            [
                [1 - 2 * (j * j + k * k), 2 * (i * j - w * k), 2 * (i * k + w * j)],
                [2 * (i * j + w * k), 1 - 2 * (i * i + k * k), 2 * (j * k - w * i)],
                [2 * (i * k - w * j), 2 * (j * k + w * i), 1 - 2 * (i * i + j * j)],
            ]
        )
        self.moments.append(Moment(self.time, (x, y, z), axes))

    def ticks(self) -> tuple[int, int]:
        """What the encoders have counted since the start, left and right."""
        left, right = (self._data.qpos[7:9] / (2.0 * math.pi) * self._ticks_per_turn).tolist()
        return math.floor(left), math.floor(right)

    def wheels(self) -> tuple[Floats, Floats]:
        """Angles (rad) and speeds (rad/s) of the two wheels."""
        return np.array(self._data.qpos[7:9]), np.array(self._data.qvel[6:8])

    def felt(self) -> tuple[Floats, Floats]:
        """Turn rate (rad/s) and specific force (m/s², gravity included: at rest z is +9.81) in the axes of the base."""
        up = np.array(self._data.qacc[:3])
        up[2] += GRAVITY
        return np.array(self._data.qvel[3:6]), self.now.axes.T @ up
