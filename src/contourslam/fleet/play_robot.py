"""A robot whose messages are played: it maps, tells the server, listens, and may die and begin anew."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.fleet.channel import Air, Channel
from contourslam.fleet.facts import Answer
from contourslam.fleet.reporter import Reporter, seen_from
from contourslam.fleet.shared import Shared
from contourslam.fleet.wire import decode
from contourslam.geometry.poses import compose, interpolate
from contourslam.graph.slam import GraphSlam
from contourslam.scan import LaserScan, Odometry, TruePose

Message = LaserScan | Odometry | TruePose


@dataclass(frozen=True, slots=True)
class Player:
    """A robot whose messages are played.

    Attributes
    ----------
    name : str
    messages : iterable of LaserScan, Odometry or TruePose
        As they were recorded.
    lidar_mount : ndarray, shape (3,), or None
        ``T_base_lidar``; None for that of the configuration.
    restarts : tuple of float
        s after its begin at which the robot's program dies, with its map and all that it has not sent, and begins anew.
    """

    name: str
    messages: Iterable[Message]
    lidar_mount: Floats | None = None
    restarts: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Told:
    """What was known of a robot at one of its scans.

    Attributes
    ----------
    time, stamp : float
        s, since the fleet's begin, and in the recording's clock.
    run : int
    keyframe : int
    seen : ndarray, shape (3,)
        Base seen from that keyframe: m, m, rad.
    odometry : ndarray, shape (3,)
        Raw odometry.
    common : int
        Common map that the server had told of by then; -1 for none.
    pose : ndarray, shape (3,)
        Base there, as the robot itself reckoned it from what it had been told; NaN for none.
    """

    time: float
    stamp: float
    run: int
    keyframe: int
    seen: Floats
    odometry: Floats
    common: int
    pose: Floats


NOWHERE = np.full(3, np.nan)


@dataclass(slots=True)
class Played:
    """One robot of a fleet that was played; grows while it is played.

    Attributes
    ----------
    name : str
    told : list of Told
        One for each scan.
    truth : list of TruePose
    up, down : Channel
        To the server and back.
    restarts : int
        How often its program died and began anew.
    damage : str
        What ended its recording early; empty where nothing did.
    """

    name: str
    up: Channel
    down: Channel
    told: list[Told] = field(default_factory=list)
    truth: list[TruePose] = field(default_factory=list)
    restarts: int = 0
    damage: str = ""

    @property
    def shift(self) -> float:
        """From the fleet's time to the recording's clock, s."""
        return self.told[0].stamp - self.told[0].time

    def online(self, common: int) -> tuple[Floats, Floats]:
        """Give times, shape (n,), and poses, shape (n, 3), as the robot knew them then, in one common map."""
        told = [each for each in self.told if each.common == common]
        return np.array([each.time for each in told]), np.array([each.pose for each in told]).reshape(-1, 3)

    def final(self, shared: Shared) -> tuple[Floats, Floats]:
        """Give the times (s) of its scans that are in a common map, shape (n,), and the poses there, shape (n, 3)."""
        poses: list[Floats] = []
        times: list[float] = []
        for source, _, frames in shared.frames():
            told = [each for each in self.told if source == (self.name, each.run) and each.keyframe < len(frames)]
            if told:
                keys = np.array([each.keyframe for each in told])
                poses.append(compose(frames[keys], np.array([each.seen for each in told])))
                times += [each.time for each in told]
        order = np.argsort(times, kind="stable")
        return np.array(times)[order], np.concatenate([np.empty((0, 3)), *poses])[order]

    def true(self, times: Floats) -> Floats:
        """Give the true poses at some times, shape (n, 3); NaN where the recording holds none."""
        if not self.truth or not len(times):
            return np.full((len(times), 3), np.nan)
        stamps, poses = np.array([each.stamp for each in self.truth]), np.array([each.pose for each in self.truth])
        return interpolate(stamps, poses, times + self.shift)


class Robot:
    """A robot that maps, tells and listens."""

    def __init__(self, player: Player, number: int, config: Config, air: Air, seed: int) -> None:
        def chance(what: int) -> np.random.Generator:
            return np.random.default_rng([seed, number, what])

        self._config, self._mount, self._runs = config, player.lidar_mount, chance(0)
        self._restarts = sorted(player.restarts)
        self.played = Played(player.name, Channel(air, chance(1)), Channel(air, chance(2)))
        self._begin()

    def _begin(self) -> None:
        """Begin with nothing, as a program does; what was sent before is still on its way."""
        self._slam = GraphSlam(self._config, lidar_mount=self._mount)
        self.reporter = Reporter(self.played.name, lambda: int(self._runs.integers(1 << 62)))

    def take(self, now: float, message: Message) -> None:
        """Take in a message of its sensors."""
        if self._restarts and now >= self._restarts[0]:
            self._restarts.pop(0)
            self.played.restarts += 1
            self._begin()
        if isinstance(message, TruePose):
            self.played.truth.append(message)
        elif isinstance(message, Odometry):
            self._slam.push_odometry(message)
        else:
            update = self._slam.push_scan(message)
            self.reporter.push(self._slam, update, now)
            memory, placed = self._slam.memory, self.reporter.placed()
            last, run = len(memory.keyframes) - 1, self.reporter.run or 0
            seen, odometry = seen_from(memory, last), self._slam.odometry_pose.copy()
            common, pose = (-1, NOWHERE) if placed is None else (placed.common, placed.pose)
            self.played.told.append(Told(now, message.stamp, run, last, seen, odometry, common, pose))
            self.speak(now)

    def speak(self, now: float) -> None:
        """Send what is due, and take in what has come."""
        for data in self.played.down.arrived(now):
            answer = decode(data)
            if isinstance(answer, Answer):
                self.reporter.answered(answer)
        for data in self.reporter.due(now):
            self.played.up.send(now, data)
