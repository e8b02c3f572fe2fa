"""How many bytes a robot's drive takes on its way to the server, beside its scans and the same facts as plain numbers.

Messages of both ways are counted as they leave, with a status, an answer and at most one report a second: two logs, and
drives through an office that a lidar of 500 beams at 10 Hz makes, slow and fast. Everything runs on one core, and
chance decides nothing but the drives, by their seed.
"""

from collections.abc import Iterable, Iterator
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from contourslam.cli.run import DEFAULTS
from contourslam.fleet.facts import Answer, Fact, KeyframeFact, RelationFact
from contourslam.fleet.inbox import Inbox
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.reporter_outbox import OVERHEAD
from contourslam.fleet.wire import encode
from contourslam.graph import GraphSlam
from contourslam.recordings import Message
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.config import LidarModel
from contourslam.simulation.long_drive import building_drive
from logs import find_logs
from table import Table, publish

LOGS, SECONDS = ("intel", "mit_csail"), 300.0
SPEEDS, LENGTH, SEED = (0.4, 1.0), 100.0, 0  # m/s, m
SCAN_HEAD = 60  # bytes of a sensor_msgs/LaserScan beside its ranges: CDR, stamp, name of the frame, angles, times
SCANS = 10.0  # raw scans a second that the messages are held against
COLUMNS = (
    "drive", "beams", "keyframes a second", "bytes a keyframe", "plain", "bytes a second", "on the wire", "raw scans",
)  # fmt: skip


class Way:
    """From a robot to a server and back; counts what goes over it."""

    def __init__(self) -> None:
        self.robot, self._inbox, self._answered = Reporter("robot1", lambda: 1), Inbox(), 0.0
        self.facts: list[Fact] = []
        self.messages = self.reports = self.other = 0  # how many, and bytes of both kinds

    def carry(self, now: float) -> None:
        """Let the robot send what is due."""
        for data in self.robot.due(now):
            taken = self._inbox.take(data)
            self.messages += 1
            if taken.status is None:
                self.reports += len(data)
            else:
                self.other += len(data)
            self.facts += (fact for report in taken.reports for fact in report.facts)

    def answer(self, now: float, slam: GraphSlam) -> None:
        """Let the server answer once a second."""
        if now < self._answered + 1.0:
            return
        self._answered = now
        self._inbox.settle()
        keyframes, known = slam.memory.keyframes, self._inbox.state(("robot1", 1))
        answer = Answer("robot1", 1, *known, 1, ("robot1",), len(keyframes) - 1, keyframes[-1].local, np.eye(3))
        self.other += len(encode(answer))
        self.messages += 1
        self.robot.answered(answer)


def row(name: str, messages: Iterable[Message], mount: NDArray[np.float64] | None) -> list[object]:
    """Map a drive, tell of it and count."""
    slam, way = GraphSlam(DEFAULTS, lidar_mount=mount), Way()
    scans = beams = 0
    begin = now = 0.0
    for message in messages:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            begin = begin if scans else message.stamp
            now = max(now, message.stamp - begin)
            scans, beams = scans + 1, beams + len(message.ranges)
            way.robot.push(slam, slam.push_scan(message), now)
            way.carry(now)
            way.answer(now, slam)
    seconds = now
    way.robot.flush(now)
    while not way.robot.settled:  # what was held back for its rate
        now += 1.0
        way.carry(now)
        way.answer(now, slam)
    keyframes = sum(isinstance(fact, KeyframeFact) for fact in way.facts)
    rate = (way.reports + way.other) / seconds
    return [
        name, round(beams / scans), f"{keyframes / seconds:.1f}", round(way.reports / keyframes),
        round(sum(map(plain, way.facts)) / keyframes), round(rate), round(rate + OVERHEAD * way.messages / seconds),
        round(SCANS * (SCAN_HEAD + 4.0 * beams / scans)),
    ]  # fmt: skip


def plain(fact: Fact) -> int:
    """Bytes of a fact as plain numbers: 32 bits for points and sightings, 64 for all others."""
    if isinstance(fact, KeyframeFact):
        return 8 * 7 + 4 * fact.points.size + 4 * fact.seen.size
    return 8 * (2 + 3 + 9 + 1) + 1 if isinstance(fact, RelationFact) else 8 + 8 * len(fact.members) + fact.seen.nbytes


def begun(messages: list[Message]) -> Iterator[Message]:
    """The first `SECONDS` of a log."""
    return takewhile(lambda message: message.stamp < messages[0].stamp + SECONDS, messages)


def main() -> None:
    rows = []
    for log in find_logs():
        if log.name in LOGS:
            mount = log.recording.lidar_mount
            title = f"{log.name}, first {SECONDS:.0f} s"
            rows.append(row(title, begun(log.messages), None if mount is None else np.array(mount, np.float64)))
    for speed in SPEEDS:
        drive = building_drive(LENGTH, SEED, speed=speed, lidar=LidarModel())
        rows.append(row(f"simulated office, {speed:g} m/s", drive.messages(), drive.lidar_mount))
    publish(Table("fleet_messages", COLUMNS, rows))


if __name__ == "__main__":
    main()
