"""Driving: the physics of one run, step by step, with the truth about every step."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.poses import interpolate
from contourslam.robot.route import sample_route
from contourslam.simulation.chance import DRIVER, stream
from contourslam.simulation.config import RobotModel
from contourslam.simulation.follower import Follower, Habits
from contourslam.simulation.mjcf import import_mujoco
from contourslam.simulation.robot import draw_flaws
from contourslam.simulation.room import Room
from contourslam.simulation.world import TIMESTEP, compile_world

Floats = NDArray[np.float64]
Progress = Callable[[float], None]
STEPS_PER_TICK = 10  # physics steps per odometry reading and per decision of the driver
TICK = STEPS_PER_TICK * TIMESTEP  # s: 50 Hz
_SETTLING = 0.3  # s in which the robot sinks onto its wheels before the clock starts
_LEAST_DURATION, _LEAST_LAPS = 180.0, 2.05
_LONGEST_DURATION = 3600.0
_PATIENCE = 10.0  # s without getting on along the route, after which the robot counts as stuck


@dataclass(frozen=True, slots=True)
class Drive:
    """What really happened, one row per physics step; the clock starts at 0 s.

    Attributes
    ----------
    times : ndarray, shape (n,)
        s, ``TIMESTEP`` apart.
    poses : ndarray, shape (n, 3)
        x (m), y (m), heading (rad) of the base in the world frame.
    positions : ndarray, shape (n, 3)
        Middle of the axle in the world frame, m.
    rotations : ndarray, shape (n, 3, 3)
        Axes of the base in the world frame, as columns; small tilts are in here.
    wheel_angles : ndarray, shape (n, 2)
        How far the left and the right wheel have turned, rad.
    laps : float
        How many laps of the route were driven.
    """

    times: Floats
    poses: Floats
    positions: Floats
    rotations: Floats
    wheel_angles: Floats
    laps: float

    def truth(self, stamps: Floats) -> Floats:
        """True poses of the base (x, y, heading) at the given times (s), shape (m, 3)."""
        return interpolate(self.times, self.poses, np.asarray(stamps, dtype=np.float64))


def drive(
    room: Room,
    robot: RobotModel,
    seed: int,
    *,
    speed: float = 0.4,
    duration: float | None = None,
    progress: Progress | None = None,
) -> Drive:
    """Drive the room's route.

    Parameters
    ----------
    room : Room
    robot : RobotModel
    seed : int
        Varies where the lap starts, how the speed swings, friction and load.
    speed : float
        Cruising speed, m/s.
    duration : float, optional
        s; by default at least 180 s and at least two laps.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Drive

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    ConfigError
        If the robot gets stuck: the route leads through something.
    """
    mujoco = import_mujoco()
    model = compile_world(room, robot, draw_flaws(seed))
    data = mujoco.MjData(model)
    follower = _take_place(room, data, speed, stream(seed, DRIVER))
    mujoco.mj_step(model, data, round(_SETTLING / TIMESTEP))
    data.qpos[7:9] = 0.0  # from here on the encoders count
    states = [data.qpos.copy()]
    laps, advanced = 0.0, 0.0
    end = _LONGEST_DURATION if duration is None else duration
    while (time := len(states) * TIMESTEP) < end + TIMESTEP / 2:
        if duration is None and time > _LEAST_DURATION and follower.laps >= _LEAST_LAPS:
            break
        v, omega = follower.steer(_pose_now(states[-1]), time, TICK)
        half_turn = 0.5 * omega * robot.wheel_base
        data.ctrl[:] = (v - half_turn) / robot.wheel_radius, (v + half_turn) / robot.wheel_radius
        for _ in range(STEPS_PER_TICK):
            mujoco.mj_step(model, data)
            states.append(data.qpos.copy())
        if follower.laps > laps:
            laps, advanced = follower.laps, time
        elif time - advanced > _PATIENCE:
            x, y, _ = _pose_now(states[-1])
            raise ConfigError(
                f"room {room.name}: the robot got stuck at ({x:.2f}, {y:.2f}) m after {advanced:.0f} s; "
                f"let the route keep clear of walls and pieces"
            )
        if progress is not None:
            done = min(time / _LEAST_DURATION, follower.laps / _LEAST_LAPS) if duration is None else time / end
            progress(min(done, 1.0))
    qpos: Floats = np.array(states, dtype=np.float64)
    rotations = _rotations(qpos)
    heading = np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0])
    poses = np.stack([qpos[:, 0], qpos[:, 1], heading], axis=1)
    times = TIMESTEP * np.arange(len(qpos), dtype=np.float64)
    return Drive(times, poses, qpos[:, :3], rotations, qpos[:, 7:9], follower.laps)


def _take_place(room: Room, data: Any, speed: float, chance: np.random.Generator) -> Follower:
    """Put the robot on the route, a little off its start, and give it a driver."""
    route = sample_route(room.route)
    first = int(chance.integers(0, 40))
    along = route[(first + 5) % len(route)] - route[first]
    heading = math.atan2(along[1], along[0]) + chance.uniform(-0.05, 0.05)
    sideways = chance.uniform(-0.03, 0.03)
    x, y = route[first] + sideways * np.array([-math.sin(heading), math.cos(heading)])
    data.qpos[:2] = x, y
    data.qpos[3:7] = math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)
    habits = Habits(speed, chance.uniform(0.05, 0.15), chance.uniform(15.0, 30.0), chance.uniform(0.0, 2 * math.pi))
    return Follower(route, habits, first)


def _pose_now(qpos: Floats) -> tuple[float, float, float]:
    x, y, _, qw, qx, qy, qz = qpos[:7].tolist()
    return x, y, math.atan2(2 * (qx * qy + qw * qz), 1 - 2 * (qy * qy + qz * qz))


def _rotations(qpos: Floats) -> Floats:
    """Rotation matrices of the free joint's quaternions (w, x, y, z), shape (n, 3, 3)."""
    w, x, y, z = qpos[:, 3:7].T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
