"""Several robots' messages played side by side, each robot mapping for itself, to one server."""

import heapq
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

from contourslam.config import Config
from contourslam.errors import RecordingError
from contourslam.fleet.channel import Air
from contourslam.fleet.common import Joined
from contourslam.fleet.faults import Fault
from contourslam.fleet.inbox import Inbox
from contourslam.fleet.play_robot import Message, Played, Player, Robot
from contourslam.fleet.server import FleetServer
from contourslam.fleet.shared import Shared
from contourslam.fleet.wire import encode

TICK, ANSWER = 0.5, 1.0  # s between two rounds of the server's work, and between two answers
PATIENCE = 120.0  # s for which the last messages are waited for once the robots have stopped


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
    restarts : int
        How often the server's program died and began anew.
    complete : bool
        Whether all recordings were played to their end.
    """

    robots: tuple[Played, ...]
    maps: tuple[Shared, ...]
    joined: tuple[Joined, ...]
    faults: tuple[Fault, ...]
    seconds: float
    solving: float
    restarts: int
    complete: bool = True


class _Server:
    """The server, which may die and begin again from its journal."""

    def __init__(self, robots: Sequence[Robot], config: Config, folder: Path | None, restarts: Sequence[float]) -> None:
        self._robots = {robot.played.name: robot for robot in robots}
        self._config, self._folder, self._restarts = config, folder, sorted(restarts)
        self._due, self._answer_due = TICK, ANSWER
        self.seconds, self.restarts = 0.0, 0
        self._begin()

    def _begin(self) -> None:
        self._inbox = Inbox(self._folder)
        self.server = FleetServer(self._config, inbox=self._inbox)

    def close(self) -> None:
        """Let go of the folder, as a program does when it ends."""
        self._inbox.close()

    def work(self, now: float) -> None:
        """Take in what has arrived; now and then work, and answer."""
        if now < self._due:
            return
        self._due = now + TICK
        before = process_time()
        if self._restarts and now >= self._restarts[0]:
            self._restarts.pop(0)
            self.restarts += 1
            self.close()
            self._begin()
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

    A robot whose recording is damaged stops there; the others go on.

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
        If the folder cannot be read.
    """
    robots = [Robot(player, i, config, air or Air(), seed) for i, player in enumerate(players)]
    server = _Server(robots, config, folder, server_restarts)
    now = 0.0
    for now, number, message in heapq.merge(
        *(_timed(i, p.messages, robots[i].played) for i, p in enumerate(players)), key=_order
    ):
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
    ended = process_time()
    server.close()
    return Fleet(
        tuple(robot.played for robot in robots),
        maps,
        server.server.joined(),
        server.server.faults(),
        server.seconds + solving - before,
        ended - solving,
        server.restarts,
        not any(robot.played.damage for robot in robots),
    )


def _timed(number: int, messages: Iterable[Message], played: Played) -> Iterator[tuple[float, int, Message]]:
    """Messages with the time since the first one, which never goes back, up to the damage."""
    begin = now = -np.inf
    try:
        for message in messages:
            begin = message.stamp if begin == -np.inf else begin
            now = max(now, message.stamp - begin)
            yield now, number, message
    except RecordingError as error:
        played.damage = str(error)


def _order(timed: tuple[float, int, Message]) -> float:
    return timed[0]
