"""Several robots in one building: each drives, looks around and is seen by the others; their messages as they come."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.geometry.rigid import from_planar
from contourslam.simulation.buildings import Building
from contourslam.simulation.chance import DRIVER, TRAFFIC, seed_of, stream
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.drive import PATIENCE, take_place
from contourslam.simulation.follower import Follower
from contourslam.simulation.gliding import Gliding
from contourslam.simulation.lanes import ways_of
from contourslam.simulation.rolling import STEPS_PER_TICK, TICK, Moments, Rolling
from contourslam.simulation.room import Room
from contourslam.simulation.senses import Eyes, Message, Past, Senses
from contourslam.simulation.traffic import Traffic
from contourslam.simulation.world import TIMESTEP

Floats = NDArray[np.float64]
DURATION = 180.0
"""Length of a drive of several robots where none is asked for, s."""
_SLOWEST = 0.8  # of the speed asked for, at which a robot goes


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
    speeds : list of float
        At which each likes to go, m/s.

    Raises
    ------
    ConfigError
        If there is no robot, or so many do not fit; the message says how many do.
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
        if robots < 1:
            raise ConfigError(f"there must be at least one robot, got {robots}")
        self.room = place if isinstance(place, Room) else place.room
        self.config, self.seeds = config, [seed_of(seed, robot) for robot in range(robots)]
        self.duration = DURATION if config.duration is None else config.duration
        speeds = config.speed * stream(seed, TRAFFIC).uniform(_SLOWEST, 1.0, robots)
        speeds[:1] = config.speed
        self.speeds: list[float] = speeds.tolist()
        self.ways, self._firsts = ways_of(place, robots, 1.2 * config.speed * self.duration + 10.0, seed)
        self.starts = [start for _, start in self.drivers()]
        self.contact_free = contact_free

    def drivers(self) -> list[tuple[Follower, tuple[float, float, float]]]:
        """Give each robot a new driver, at its start."""
        return [
            take_place(way.points, first, speed, stream(seed, DRIVER))
            for way, first, speed, seed in zip(self.ways, self._firsts, self.speeds, self.seeds, strict=True)
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
        eyes = Eyes(self.room, self.config, contact_free=self.contact_free)
        ticks = _ticks(self.duration)
        senses = [Senses(robot, seed, self.config, eyes, ticks * TICK) for robot, seed in enumerate(self.seeds)]
        moments = self.moments()
        past = Past(next(moments), (Gliding if self.contact_free else Rolling).spacing)
        for tick in range(ticks + 1):
            if tick < ticks:  # one tick ahead: what is between two moments needs both
                past.add(next(moments))
            now = round(tick * TICK, 9)
            for robot, sense in enumerate(senses):
                for message in sense.tick(now, past):
                    yield robot, message
            past.forget(min(sense.oldest for sense in senses))

    def moments(self) -> Iterator[Moments]:
        """Drive without looking around: the truth alone, at 0 s and then tick by tick. Errors as :meth:`messages`."""
        world: Rolling | Gliding
        if self.contact_free:
            world = Gliding(self.config.robot, self.seeds, self.starts)
        else:
            world = Rolling(self.room, self.config.robot, self.seeds, self.starts)
        helm, latest = _Helm(self), world.begun
        yield latest
        for tick in range(_ticks(self.duration)):
            latest = world.step(helm.steer(latest, tick))
            yield latest


def _ticks(duration: float) -> int:
    """How many ticks a drive of one robot of this length (s) has."""
    return max(math.ceil((duration - TIMESTEP / 2) / TICK - 1e-9), 0)


class _Helm:
    """The drivers of all robots, who heed the traffic. Mutable."""

    def __init__(self, robots: SeveralRobots) -> None:
        self._drivers = [driver for driver, _ in robots.drivers()]
        self._traffic = Traffic(robots.ways, [driver.index for driver in self._drivers])
        self._room, self._speeds = robots.room.name, robots.speeds
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
            elif time - since > PATIENCE:
                x, y, _ = moments.last_pose(robot)
                raise ConfigError(f"room {self._room}: robot {robot + 1} got stuck at ({x:.2f}, {y:.2f}) m")
        return [
            driver.steer(moments.last_pose(robot), time, TICK, limit)
            for robot, (driver, limit) in enumerate(zip(self._drivers, limits, strict=True))
        ]
