"""A drive of any length through an office building, made while it is read: memory does not grow with the way."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.poses import compose, compose_one, interpolate
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.buildings import Building, office_building
from contourslam.simulation.chance import FLAWS, NOISE, ODOMETRY, stream
from contourslam.simulation.config import LidarModel, RobotModel
from contourslam.simulation.follower import Habits
from contourslam.simulation.gliding import Tick, arc, glide
from contourslam.simulation.lidar import IdealScan, turns
from contourslam.simulation.noise import measure
from contourslam.simulation.ray_casting import PlaneCaster, outlines
from contourslam.simulation.tour import tour

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose

BUILDING_LIDAR = LidarModel(samples_per_second=1800.0, turn_rate=5.0)
"""360 beams over 360 degrees at 5 Hz, up to 30 m, 1 cm of noise: a scan each 0.15 m or so."""


@dataclass(frozen=True, slots=True)
class WheelErrors:
    """What is wrong with the wheel odometry of a robot that glides."""

    radius: float = 0.01
    """Believed wheel radius wrong by 0.5 to 1.5 times this, as a fraction, drawn by seed."""
    base: float = 0.02
    """Believed wheel base wrong by 0.5 to 1.5 times this, as a fraction, drawn by seed."""
    slip: float = 0.002
    """Standard deviation of each wheel's way after one metre, m; it grows with the root of the way."""

    def __post_init__(self) -> None:
        for name in ("radius", "base", "slip"):
            if not 0 <= getattr(self, name) < 0.3:
                raise ConfigError(f"WheelErrors.{name} must be 0 or more and below 0.3, got {getattr(self, name)!r}")


@dataclass(frozen=True, slots=True)
class LongDrive:
    """A drive through a building, described; :meth:`messages` drives it.

    Attributes
    ----------
    building : Building
    length : float
        Way to drive, m.
    seed : int
        Of the way, the odometry and the noise.
    speed : float
        Cruising speed, m/s; bends are driven slower.
    lidar : LidarModel
    robot : RobotModel
    wheels : WheelErrors
    """

    building: Building
    length: float
    seed: int
    speed: float = 0.8
    lidar: LidarModel = BUILDING_LIDAR
    robot: RobotModel = field(default_factory=RobotModel)
    wheels: WheelErrors = field(default_factory=WheelErrors)

    def __post_init__(self) -> None:
        if not 1.0 <= self.length < math.inf:
            raise ConfigError(f"LongDrive.length must be at least 1 m, got {self.length!r}")
        if not 0.0 < self.speed <= 1.5:
            raise ConfigError(f"LongDrive.speed must lie above 0 and up to 1.5 m/s, got {self.speed!r}")

    @property
    def lidar_mount(self) -> Floats:
        """Pose of the lidar in the base frame: x (m), y (m), heading (rad), shape (3,)."""
        return np.array([self.lidar.mount_x, 0.0, 0.0])

    def ticks(self) -> Iterator[Tick]:
        """The truth, 20 times a second."""
        chance, driven = stream(self.seed, FLAWS), 0.0
        swing, period, phase = chance.uniform((0.05, 15.0, 0.0), (0.15, 30.0, 2 * math.pi)).tolist()
        habits = Habits(self.speed, swing, period, phase)
        points = (point for leg in tour(self.building, self.seed) for point in leg.points)
        for tick in glide(points, habits):
            yield tick
            driven += tick.advance
            if driven >= self.length:
                return

    def messages(self) -> Iterator[Message]:
        """All messages in the order in which they are published, made one after the other.

        Each scan comes once it is complete, right after the first odometry reading that is not older than its last
        beam; the true pose at its stamp comes just before it.
        """
        caster = PlaneCaster(*outlines(self.building.room, self.lidar.mount_height))
        noise, wheels = stream(self.seed, NOISE), _Wheels(self)
        spins = turns(self.lidar, self.seed)
        stamp, offsets, angles = next(spins)
        recent: list[Tick] = []
        for tick in self.ticks():
            recent.append(tick)
            yield Odometry(tick.time, wheels.roll(tick))
            while tick.time >= stamp + offsets[-1]:
                times, poses = np.array([t.time for t in recent]), np.array([t.pose for t in recent])
                yield TruePose(stamp, interpolate(times, poses, np.array([stamp]))[0])
                lidar = compose(interpolate(times, poses, stamp + offsets), self.lidar_mount)
                ranges, incidences = caster.cast(lidar[:, :2], lidar[:, 2] + angles, self.lidar.range_max)
                yield measure(IdealScan(stamp, angles, offsets, ranges, incidences), self.lidar, noise)
                stamp, offsets, angles = next(spins)
                recent = recent[next((k for k, (_, b) in enumerate(pairwise(recent)) if b.time > stamp), -1) :]


class _Wheels:
    """The encoders and what the robot makes of them: ticks of wheels that it believes a little wrong. Mutable."""

    def __init__(self, drive: LongDrive) -> None:
        robot, errors, self._chance = drive.robot, drive.wheels, stream(drive.seed, ODOMETRY)
        wrong = self._chance.choice([-1.0, 1.0], 2) * self._chance.uniform(0.5, 1.5, 2) * (errors.radius, errors.base)
        self._tick = 2 * math.pi * robot.wheel_radius / robot.ticks_per_turn  # m
        self._believed_tick, self._believed_base = self._tick * (1 + wrong[0]), robot.wheel_base * (1 + wrong[1])
        self._base, self._slip = robot.wheel_base, errors.slip
        self._rolled, self._count = np.zeros(2), np.zeros(2)
        self._pose = np.zeros(3)

    def roll(self, tick: Tick) -> Floats:
        """Pose in the odometry frame after a step."""
        rolled = tick.advance + tick.turn * self._base / 2 * np.array([-1.0, 1.0])
        self._rolled += rolled + self._slip * np.sqrt(np.abs(rolled)) * self._chance.standard_normal(2)
        count = np.floor(self._rolled / self._tick)
        left, right = ((count - self._count) * self._believed_tick).tolist()
        self._count = count
        self._pose = compose_one(self._pose, arc((left + right) / 2, (right - left) / self._believed_base))
        return self._pose


def building_drive(
    length: float,
    seed: int = 0,
    *,
    most_corridors: int = 14,
    speed: float = 0.8,
    lidar: LidarModel = BUILDING_LIDAR,
    wheels: WheelErrors | None = None,
) -> LongDrive:
    """Describe a drive through a building that is large enough for half of the way to lead through new places.

    Parameters
    ----------
    length : float
        Way to drive, m.
    seed : int
        Of the building and everything that happens in it.
    most_corridors : int
        The building does not grow beyond this many corridors in each direction; 14 do for 10 km.
    speed : float
        Cruising speed, m/s.
    lidar : LidarModel
    wheels : WheelErrors, optional

    Returns
    -------
    LongDrive

    Raises
    ------
    ConfigError
        If a setting is out of bounds.
    """
    corridors = 2
    while corridors < most_corridors and 26.0 * corridors * (corridors - 1) < length / 2:
        corridors += 1
    building = office_building(corridors, seed)
    return LongDrive(building, length, seed, speed, lidar, wheels=wheels or WheelErrors())
