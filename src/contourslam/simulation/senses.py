"""What the sensors of several robots say, moment by moment."""

import math
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.poses import between, compose
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.chance import NOISE, stream
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.drive import Drive, drive_of
from contourslam.simulation.lidar import IdealScan, SolidCaster, beams, turns
from contourslam.simulation.noise import measure
from contourslam.simulation.odometry import Encoders
from contourslam.simulation.others import cast_others
from contourslam.simulation.ray_casting import PlaneCaster, outlines
from contourslam.simulation.robot import drums
from contourslam.simulation.rolling import Moments
from contourslam.simulation.room import Room

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose
Turn = tuple[float, Floats, Floats]


class Past:
    """The last moments of all robots. Mutable.

    Attributes
    ----------
    latest : Moments
        Those that were added last.
    """

    def __init__(self, begun: Moments, spacing: float) -> None:
        self.latest, self._spacing, self._first = begun, spacing, 0
        self._parts = deque([begun])
        self._whole: Moments | None = None
        self._now, self._truth = math.nan, np.empty((0, 3))

    def add(self, moments: Moments) -> None:
        """Remember what came next."""
        self.latest, self._whole = moments, None
        self._parts.append(moments)

    def forget(self, stamp: float) -> None:
        """Forget what is older than a stamp, s, and not needed for what was then."""
        while len(self._parts) > 2 and (self._first + len(self._parts[0].poses)) * self._spacing < stamp:
            self._first += len(self._parts.popleft().poses)
            self._whole = None

    @property
    def moments(self) -> Moments:
        """All that is remembered."""
        if self._whole is None:
            self._whole = Moments.joined(self._parts)
        return self._whole

    def truth(self, now: float) -> Floats:
        """True poses of all bases now (s), shape (robots, 3): computed once for all, as it is wanted each tick."""
        if self._now != now:
            poses = self.moments.poses
            times = self._spacing * np.arange(self._first, self._first + len(poses))
            at = int(np.clip(np.searchsorted(times, now, side="right") - 1, 0, len(times) - 2))
            weight = min(max((now - times[at]) / (times[at + 1] - times[at]), 0.0), 1.0)
            self._truth = compose(poses[at], between(poses[at], poses[at + 1]) * weight)
            self._now = now
        return self._truth

    def wheel_angles(self, now: float) -> Floats:
        """Angles of all wheels now (s), shape (robots, 2), rad."""
        angles: Floats = self.moments.wheel_angles[round(now / self._spacing) - self._first]
        return angles

    def drive(self, robot: int) -> Drive:
        """The remembered part of the drive of one robot."""
        return drive_of(self.moments, robot, spacing=self._spacing, first=self._first)


class Eyes:
    """What beams meet: the room, and the other robots in it.

    Parameters
    ----------
    room : Room
    config : SimulationConfig
    contact_free : bool
        Cast in the plane of the lidar, and not in space.
    """

    def __init__(self, room: Room, config: SimulationConfig, *, contact_free: bool) -> None:
        self._lidar = config.lidar
        self._parts = drums(config.robot)
        self._plane = PlaneCaster(*outlines(room, config.lidar.mount_height)) if contact_free else None
        self._solid = None if contact_free else SolidCaster(room)

    def look(self, past: Past, robot: int, mount_z: float, times: Floats, angles: Floats) -> tuple[Floats, Floats]:
        """Ranges (m) and incidences (rad) of the beams of one robot.

        Parameters
        ----------
        past : Past
            With the times in it.
        robot : int
        mount_z : float
            Height of its lidar above its axle, m.
        times, angles : ndarray, shape (n,)
            Of the beams, s, and rad in the lidar's frame.
        """
        drive = past.drive(robot)
        origins, directions = beams(drive, self._lidar, mount_z, times, angles)
        if self._solid is not None:
            found = self._solid.cast(origins, directions)
        else:
            assert self._plane is not None
            bearings = np.arctan2(directions[:, 1], directions[:, 0])
            found = self._plane.cast(origins[:, :2].copy(), bearings, self._lidar.range_max)
        if past.moments.poses.shape[1] == 1:
            return found
        moments = past.moments
        return cast_others(
            origins, directions, found, *drive.between(times), moments.positions, moments.rotations, self._parts, robot
        )


class Senses:
    """Encoders and lidar of one robot, and the messages that they send. Mutable.

    Parameters
    ----------
    robot : int
        Counted from 0.
    seed : int
        Its own.
    config : SimulationConfig
    eyes : Eyes
    end : float
        When the drive ends, s: no turn of the lidar is begun that would not be over by then.

    Attributes
    ----------
    oldest : float
        Stamp of the oldest moment that is still needed, s.
    """

    def __init__(self, robot: int, seed: int, config: SimulationConfig, eyes: Eyes, end: float) -> None:
        self._robot, self._config, self._eyes, self._end = robot, config, eyes, end
        self._lidar = config.measuring_lidar
        self._encoders, self._noise = Encoders(config.robot, seed), stream(seed, NOISE)
        self._turns, self._begun = turns(config.lidar, seed), deque[Turn]()
        self._next: Turn = next(self._turns)
        self._mount_z = math.nan
        self.oldest = 0.0

    def tick(self, now: float, past: Past) -> Iterator[Message]:
        """All messages until now (s) since the last call."""
        if now == 0.0:
            self._mount_z = self._lidar.mount_height - float(past.moments.positions[0, self._robot, 2])
        while (stamp := self._next[0]) <= now:
            if stamp + self._next[1][-1] <= self._end:
                if stamp < now:
                    yield TruePose(stamp, past.drive(self._robot).truth(np.array([stamp]))[0])
                self._begun.append(self._next)
            self._next = next(self._turns)
        yield TruePose(now, past.truth(now)[self._robot])
        yield Odometry(now, self._encoders.read(past.wheel_angles(now)[self._robot].tolist())[0])
        while self._begun and round(self._begun[0][0] + float(self._begun[0][1][-1]), 9) <= now:
            stamp, offsets, angles = self._begun.popleft()
            ranges, incidences = self._eyes.look(past, self._robot, self._mount_z, stamp + offsets, angles)
            yield measure(IdealScan(stamp, angles, offsets, ranges, incidences), self._lidar, self._noise)
        self.oldest = self._begun[0][0] if self._begun else now
