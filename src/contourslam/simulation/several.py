"""Several robots in one building: each drives, looks around and is seen by the others; their messages as they come."""

import math
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.rigid import from_planar
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.buildings import Building
from contourslam.simulation.chance import DRIVER, NOISE, TRAFFIC, seed_of, stream
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.drive import Drive, drive_of, take_place
from contourslam.simulation.follower import Follower
from contourslam.simulation.gliding import Gliding
from contourslam.simulation.lanes import ways_of
from contourslam.simulation.lidar import IdealScan, SolidCaster, beams, turns
from contourslam.simulation.noise import measure
from contourslam.simulation.odometry import Encoders
from contourslam.simulation.others import cast_others
from contourslam.simulation.ray_casting import PlaneCaster, outlines
from contourslam.simulation.robot import drums
from contourslam.simulation.rolling import STEPS_PER_TICK, TICK, Moments, Rolling
from contourslam.simulation.room import Room
from contourslam.simulation.traffic import Traffic
from contourslam.simulation.world import TIMESTEP

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose
Turn = tuple[float, Floats, Floats]
DURATION = 180.0
"""Length of a drive of several robots where none is asked for, s."""
_SLOWEST = 0.8  # of the speed asked for, at which a robot goes
_PATIENCE = 10.0  # s without getting on though the way is free, after which a robot counts as stuck


class SeveralRobots:
    """Robots that drive together, described; :meth:`messages` drives them.

    Each has flaws, noise and habits of its own; all have one clock and one world frame. The first is no faster than the
    speed asked for, the others up to a fifth slower. They keep to the right, wait for each other, and never touch.

    Parameters
    ----------
    place : Room or Building
        In a building, or a room that is one, each robot drives a tour of its own; elsewhere all drive the room's lap,
        one behind the other.
    config : SimulationConfig
    seed : int
        Of everything that chance decides.
    robots : int
        How many. One alone does what :func:`~contourslam.simulation.simulate.simulate` simulates.
    contact_free : bool
        Without physics: robots glide as they are told, and beams are cast in the plane. For many.

    Attributes
    ----------
    ways : list of Way
    starts : list of (x, y, heading)
        m, m, rad.

    Raises
    ------
    ConfigError
        If so many robots do not fit; the message says how many do.
    """

    def __init__(
        self,
        place: Room | Building,
        config: SimulationConfig,
        seed: int,
        robots: int,
        *,
        contact_free: bool = False,
    ) -> None:
        self.room = place if isinstance(place, Room) else place.room
        self.config, self.seeds = config, [seed_of(seed, robot) for robot in range(robots)]
        self.duration = DURATION if config.duration is None else config.duration
        speeds = config.speed * stream(seed, TRAFFIC).uniform(_SLOWEST, 1.0, robots)
        speeds[:1] = config.speed
        self._speeds: list[float] = speeds.tolist()
        self.ways, self._firsts = ways_of(place, robots, 1.2 * config.speed * self.duration + 10.0, seed)
        self.starts = [start for _, start in self.drivers()]
        self._contact_free = contact_free

    def drivers(self) -> list[tuple[Follower, tuple[float, float, float]]]:
        """Give each robot a new driver, at its start."""
        return [
            take_place(way.points, first, speed, stream(seed, DRIVER))
            for way, first, speed, seed in zip(self.ways, self._firsts, self._speeds, self.seeds, strict=True)
        ]

    @property
    def lidar_place(self) -> Floats:
        """T_base_lidar of every robot, from the floor below the axle, shape (4, 4), m."""
        lidar = self.config.lidar
        return from_planar(np.array([lidar.mount_x, 0.0, 0.0]), lidar.mount_height)

    def messages(self) -> Iterator[tuple[int, Message]]:
        """Drive, and hand on what the sensors say, with the truth, as it comes.

        The messages of each robot come in the order in which they are published, as
        :meth:`~contourslam.simulation.simulate.SimulatedRun.messages` has them; those of all are sorted by the time
        of publication. They come as fast as they are computed: who wants them at the pace of a clock waits for it.

        Yields
        ------
        robot : int
            Counted from 0.
        message : LaserScan, Odometry or TruePose

        Raises
        ------
        MissingExtraError
            If MuJoCo is not installed, which only robots without contact do without.
        ConfigError
            If a robot gets stuck.
        """
        config, room = self.config, self.room
        world: Rolling | Gliding
        if self._contact_free:
            world = Gliding(config.robot, self.seeds, self.starts)
        else:
            world = Rolling(room, config.robot, self.seeds, self.starts)
        helm, past = _Helm(self), Past(world.begun, world.spacing)
        eyes = _Eyes(room, config, contact_free=self._contact_free)
        ticks = _ticks(self.duration)
        senses = [_Senses(robot, seed, config, eyes, ticks * TICK) for robot, seed in enumerate(self.seeds)]
        for tick in range(ticks + 1):
            if tick < ticks:  # one tick ahead: what is between two moments needs both
                past.add(world.step(helm.steer(past.latest, tick)))
            now = round(tick * TICK, 9)
            for robot, sense in enumerate(senses):
                for message in sense.tick(now, past):
                    yield robot, message
            past.forget(min(sense.oldest for sense in senses))


def _ticks(duration: float) -> int:
    """How many ticks a drive of one robot of this length (s) has."""
    return max(math.ceil((duration - TIMESTEP / 2) / TICK - 1e-9), 0)


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

    def drive(self, robot: int) -> Drive:
        """The remembered part of the drive of one robot."""
        return drive_of(self.moments, robot, spacing=self._spacing, first=self._first)


class _Helm:
    """The drivers of all robots, who heed the traffic. Mutable."""

    def __init__(self, robots: SeveralRobots) -> None:
        self._drivers = [driver for driver, _ in robots.drivers()]
        self._traffic = Traffic(robots.ways, [driver.index for driver in self._drivers])
        self._room, self._speeds = robots.room.name, [robots.config.speed] * len(self._drivers)
        self._since = [(driver.index, 0.0) for driver in self._drivers]

    def steer(self, moments: Moments, tick: int) -> list[tuple[float, float]]:
        """Tell each robot how fast to go (m/s) and to turn (rad/s) for the next tick."""
        time = (1 + tick * STEPS_PER_TICK) * TIMESTEP
        at = [driver.index for driver in self._drivers]
        alone = len(at) == 1
        limits = [math.inf] if alone else self._traffic.limits(at, self._speeds)
        for robot, (index, limit) in enumerate(zip(at, limits, strict=True)):
            before, since = self._since[robot]
            if index > before or limit == 0.0:
                self._since[robot] = index, time
            elif time - since > _PATIENCE:
                x, y, _ = moments.last_pose(robot)
                raise ConfigError(f"room {self._room}: robot {robot + 1} got stuck at ({x:.2f}, {y:.2f}) m")
        return [
            driver.steer(moments.last_pose(robot), time, TICK, limit)
            for robot, (driver, limit) in enumerate(zip(self._drivers, limits, strict=True))
        ]


class _Eyes:
    """What beams meet: the room, and the robots in it."""

    def __init__(self, room: Room, config: SimulationConfig, *, contact_free: bool) -> None:
        self._lidar = config.lidar
        self._parts = drums(config.robot)
        self._plane = PlaneCaster(*outlines(room, config.lidar.mount_height)) if contact_free else None
        self._solid = None if contact_free else SolidCaster(room)

    def look(self, past: Past, robot: int, mount_z: float, times: Floats, angles: Floats) -> tuple[Floats, Floats]:
        """Ranges (m) and incidences (rad) of the beams of one robot."""
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
        steps, weights = drive.between(times)
        moments = past.moments
        others = cast_others(
            origins, directions, steps, weights, moments.positions, moments.rotations, self._parts, robot
        )
        nearer = others[0] < found[0]
        return np.where(nearer, others[0], found[0]), np.where(nearer, others[1], found[1])


class _Senses:
    """Encoders and lidar of one robot, and the messages that they send. Mutable.

    Attributes
    ----------
    oldest : float
        Stamp of the oldest moment that is still needed, s.
    """

    def __init__(self, robot: int, seed: int, config: SimulationConfig, eyes: _Eyes, end: float) -> None:
        self._robot, self._config, self._eyes, self._end = robot, config, eyes, end
        self._lidar = config.measuring_lidar
        self._encoders, self._noise = Encoders(config.robot, seed), stream(seed, NOISE)
        self._turns, self._begun = turns(config.lidar, seed), deque[Turn]()
        self._next: Turn = next(self._turns)
        self._mount_z = math.nan
        self.oldest = 0.0

    def tick(self, now: float, past: Past) -> Iterator[Message]:
        """All messages until now (s) since the last call."""
        drive = past.drive(self._robot)
        if now == 0.0:
            self._mount_z = self._lidar.mount_height - float(drive.positions[0, 2])
        stamps = {now}
        while self._next[0] <= now:
            if self._next[0] + self._next[1][-1] <= self._end:
                stamps.add(self._next[0])
                self._begun.append(self._next)
            self._next = next(self._turns)
        wanted = np.array(sorted(stamps))
        for stamp, pose in zip(wanted.tolist(), drive.truth(wanted), strict=True):
            yield TruePose(stamp, pose)
        yield Odometry(now, self._encoders.read(drive.wheel_angles[drive.row(now)].tolist())[0])
        while self._begun and round(self._begun[0][0] + float(self._begun[0][1][-1]), 9) <= now:
            stamp, offsets, angles = self._begun.popleft()
            ranges, incidences = self._eyes.look(past, self._robot, self._mount_z, stamp + offsets, angles)
            yield measure(IdealScan(stamp, angles, offsets, ranges, incidences), self._lidar, self._noise)
        self.oldest = self._begun[0][0] if self._begun else now
