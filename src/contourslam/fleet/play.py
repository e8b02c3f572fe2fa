"""Several robots' messages played side by side, each robot mapping for itself, to one server."""

import heapq
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import process_time

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.fleet.channel import Air, Channel
from contourslam.fleet.common import Joined
from contourslam.fleet.facts import Answer
from contourslam.fleet.inbox import Inbox
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.server import Fault, FleetServer, Shared
from contourslam.fleet.wire import decode, encode
from contourslam.geometry.poses import between_one, compose, interpolate
from contourslam.graph.slam import GraphSlam
from contourslam.scan import LaserScan, Odometry, TruePose

TICK, ANSWER = 0.5, 1.0  # s between two rounds of the server's work, and between two answers
PATIENCE = 120.0  # s for which the last messages are waited for once the robots have stopped
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
        s after its begin at which the robot's program dies and begins anew, knowing nothing.
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
    """

    name: str
    up: Channel
    down: Channel
    told: list[Told] = field(default_factory=list)
    truth: list[TruePose] = field(default_factory=list)

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
        for source, frames in shared.frames():
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


@dataclass(frozen=True, slots=True)
class Fleet:
    """A fleet that was played.

    Attributes
    ----------
    robots : tuple of Played
    maps : tuple of Shared
        All common maps at the end, solved as a whole.
    joined : tuple of Joined
    faults : tuple of Fault
    seconds : float
        CPU time of the server's.
    solving : float
        CPU time of the maps' last solution.
    answers : tuple of Answer
        The last ones.
    """

    robots: tuple[Played, ...]
    maps: tuple[Shared, ...]
    joined: tuple[Joined, ...]
    faults: tuple[Fault, ...]
    seconds: float
    solving: float
    answers: tuple[Answer, ...]


class _Robot:
    """A robot that maps, tells and listens."""

    def __init__(self, player: Player, number: int, config: Config, air: Air, seed: int) -> None:
        def chance(what: int) -> np.random.Generator:
            return np.random.default_rng([seed, number, what])

        self._config, self._mount, self._runs = config, player.lidar_mount, chance(0)
        self._restarts = sorted(player.restarts)
        self.reporter = Reporter(player.name, lambda: int(self._runs.integers(1 << 62)))
        self.played = Played(player.name, Channel(air, chance(1)), Channel(air, chance(2)))
        self._slam = self._begun()

    def _begun(self) -> GraphSlam:
        return GraphSlam(self._config, lidar_mount=self._mount)

    def take(self, now: float, message: Message) -> None:
        """Take in a message of its sensors."""
        if self._restarts and now >= self._restarts[0]:
            self._restarts.pop(0)
            self._slam = self._begun()
        if isinstance(message, TruePose):
            self.played.truth.append(message)
        elif isinstance(message, Odometry):
            self._slam.push_odometry(message)
        else:
            update = self._slam.push_scan(message)
            self.reporter.push(self._slam, update, now)
            memory, placed = self._slam.memory, self.reporter.placed()
            keyframe = memory.keyframes[-1].local
            seen = np.zeros(3) if memory.contour is None else between_one(keyframe, memory.contour.pose)
            common, pose = (-1, NOWHERE) if placed is None else (placed.common, placed.pose)
            last = len(memory.keyframes) - 1
            self.played.told.append(
                Told(
                    now,
                    message.stamp,
                    self.reporter.run or 0,
                    last,
                    seen,
                    self._slam.odometry_pose.copy(),
                    common,
                    pose,
                )
            )
            self.speak(now)

    def speak(self, now: float) -> None:
        """Send what is due, and take in what has come."""
        for data in self.played.down.arrived(now):
            answer = decode(data)
            if isinstance(answer, Answer):
                self.reporter.answered(answer)
        for data in self.reporter.due(now):
            self.played.up.send(now, data)


class _Server:
    """The server, which may die and begin again from its journal."""

    def __init__(
        self, robots: Sequence[_Robot], config: Config, folder: Path | None, restarts: Sequence[float]
    ) -> None:
        self._robots = {robot.played.name: robot for robot in robots}
        self._config, self._folder, self._restarts = config, folder, sorted(restarts)
        self._due, self._answer_due = TICK, ANSWER
        self.server, self.seconds = self._begun(), 0.0

    def _begun(self) -> FleetServer:
        return FleetServer(self._config, inbox=Inbox(self._folder))

    def work(self, now: float) -> None:
        """Take in what has arrived; now and then work, and answer."""
        if now < self._due:
            return
        self._due = now + TICK
        before = process_time()
        if self._restarts and now >= self._restarts[0]:
            self._restarts.pop(0)
            self.server.answers()  # nobody hears these; the files are let go of
            self.server = self._begun()
        for robot in self._robots.values():
            for data in robot.played.up.arrived(now):
                self.server.push(data)
        self.server.tick(now)
        if now >= self._answer_due:
            self._answer_due = now + ANSWER
            for answer in self.server.answers():
                self._robots[answer.robot].played.down.send(now, encode(answer))
        self.seconds += process_time() - before


def play(
    players: Sequence[Player],
    config: Config,
    air: Air | None = None,
    *,
    seed: int = 0,
    folder: Path | None = None,
    server_restarts: Sequence[float] = (),
) -> Fleet:
    """Play robots side by side, each from its own first message on, to one server.

    Parameters
    ----------
    players : sequence of Player
        Their names differ.
    config : Config
    air : Air, optional
        How messages travel, both ways; at once and surely by default.
    seed : int
        Of all that chance decides.
    folder : Path, optional
        Where the server keeps what it has acknowledged; needed for its restarts.
    server_restarts : sequence of float
        s after the begin at which the server's program dies and begins anew.

    Returns
    -------
    Fleet

    Raises
    ------
    ContourslamError
        If a recording or the folder cannot be read.
    """
    robots = [_Robot(player, i, config, air or Air(), seed) for i, player in enumerate(players)]
    server = _Server(robots, config, folder, server_restarts)
    now = 0.0
    for now, number, message in heapq.merge(*(_timed(i, p.messages) for i, p in enumerate(players)), key=_order):
        robots[number].take(now, message)
        server.work(now)
    for robot in robots:
        robot.reporter.flush(now)
    until = now + PATIENCE
    while now < until and not all(robot.reporter.settled for robot in robots):
        now += TICK
        for robot in robots:
            robot.speak(now)
        server.work(now)
    before = process_time()
    server.server.flush(now)
    solving = process_time()
    maps = server.server.settle()
    return Fleet(
        tuple(robot.played for robot in robots),
        maps,
        server.server.joined(),
        server.server.faults(),
        server.seconds + solving - before,
        process_time() - solving,
        server.server.answers(),
    )


def _timed(number: int, messages: Iterable[Message]) -> Iterator[tuple[float, int, Message]]:
    """Messages with the time since the first one, which never goes back."""
    begin = now = -np.inf
    for message in messages:
        begin = message.stamp if begin == -np.inf else begin
        now = max(now, message.stamp - begin)
        yield now, number, message


def _order(timed: tuple[float, int, Message]) -> float:
    return timed[0]
