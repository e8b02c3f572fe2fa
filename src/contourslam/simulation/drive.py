"""Driving: the physics of one run, step by step, with the truth about every step."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.poses import interpolate
from contourslam.robot.route import sample_route
from contourslam.simulation.chance import DRIVER, stream
from contourslam.simulation.config import RobotModel
from contourslam.simulation.follower import Follower, Habits
from contourslam.simulation.rolling import STEPS_PER_TICK, TICK, Moments, Rolling
from contourslam.simulation.room import Room
from contourslam.simulation.world import TIMESTEP

Floats = NDArray[np.float64]
Progress = Callable[[float], None]
_LEAST_DURATION, _LEAST_LAPS = 180.0, 2.05
_LONGEST_DURATION = 3600.0
PATIENCE = 10.0
"""Without getting on though the way is free, a robot counts as stuck after so long, s."""


@dataclass(frozen=True, slots=True)
class Drive:
    """What really happened, one row per physics step; the clock starts at 0 s.

    Attributes
    ----------
    times : ndarray, shape (n,)
        s, `spacing` apart.
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
    spacing : float
        Between two rows, s.
    first : int
        How many rows there were before, in a part of a drive.
    """

    times: Floats
    poses: Floats
    positions: Floats
    rotations: Floats
    wheel_angles: Floats
    laps: float
    spacing: float = TIMESTEP
    first: int = 0

    def between(self, times: Floats) -> tuple[NDArray[np.int64], Floats]:
        """Row before each of some times (s), not the last row, and which part of the way to the next has passed."""
        at = times / self.spacing
        step = np.minimum(at.astype(np.int64), self.first + len(self.times) - 2)
        return step - self.first, at - step

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
    follower, start = take_place(sample_route(room.route), 0, speed, stream(seed, DRIVER))
    world = Rolling(room, robot, [seed], [start])
    moments = [world.begun]
    laps, advanced, ticks = 0.0, 0.0, 0
    end = _LONGEST_DURATION if duration is None else duration
    while (time := (1 + ticks * STEPS_PER_TICK) * TIMESTEP) < end + TIMESTEP / 2:
        if duration is None and time > _LEAST_DURATION and follower.laps >= _LEAST_LAPS:
            break
        moments.append(world.step([follower.steer(moments[-1].last_pose(0), time, TICK)]))
        ticks += 1
        if follower.laps > laps:
            laps, advanced = follower.laps, time
        elif time - advanced > PATIENCE:
            x, y, _ = moments[-1].poses[-1, 0]
            raise ConfigError(
                f"room {room.name}: the robot got stuck at ({x:.2f}, {y:.2f}) m after {advanced:.0f} s; "
                f"let the route keep clear of walls and pieces"
            )
        if progress is not None:
            done = min(time / _LEAST_DURATION, follower.laps / _LEAST_LAPS) if duration is None else time / end
            progress(min(done, 1.0))
    return drive_of(Moments.joined(moments), 0, laps=follower.laps)


def drive_of(moments: Moments, robot: int, *, spacing: float = TIMESTEP, first: int = 0, laps: float = 0.0) -> Drive:
    """What happened to one of several robots.

    Parameters
    ----------
    moments : Moments
    robot : int
        Counted from 0.
    spacing : float
        Between two moments, s.
    first : int
        How many moments there were before.
    laps : float

    Returns
    -------
    Drive
    """
    times = spacing * np.arange(first, first + len(moments.poses), dtype=np.float64)
    return Drive(
        times, moments.poses[:, robot], moments.positions[:, robot], moments.rotations[:, robot],
        moments.wheel_angles[:, robot], laps, spacing, first,
    )  # fmt: skip


def take_place(
    route: Floats, first: int, speed: float, chance: np.random.Generator
) -> tuple[Follower, tuple[float, float, float]]:
    """Give a robot a driver and a place on its route, up to 0.4 m ahead of a point of it and a little beside it.

    Parameters
    ----------
    route : ndarray, shape (n, 2)
        From :func:`contourslam.robot.route.sample_route`.
    first : int
        Index of the point.
    speed : float
        Cruising speed, m/s.
    chance : numpy.random.Generator

    Returns
    -------
    driver : Follower
    pose : tuple of float
        Of the base: x (m), y (m), heading (rad).
    """
    first = (first + int(chance.integers(0, 40))) % len(route)
    along = route[(first + 5) % len(route)] - route[first]
    heading = math.atan2(along[1], along[0]) + chance.uniform(-0.05, 0.05)
    sideways = chance.uniform(-0.03, 0.03)
    x, y = (route[first] + sideways * np.array([-math.sin(heading), math.cos(heading)])).tolist()
    habits = Habits(speed, chance.uniform(0.05, 0.15), chance.uniform(15.0, 30.0), chance.uniform(0.0, 2 * math.pi))
    return Follower(route, habits, first), (x, y, heading)
