"""How many bytes a robot's drive takes on its way to the server."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.fleet.facts import Answer, Fact, KeyframeFact, RelationFact
from contourslam.fleet.inbox import Inbox
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.reporter_outbox import OVERHEAD
from contourslam.fleet.wire import encode
from contourslam.graph.slam import GraphSlam
from contourslam.scan import LaserScan, Odometry, TruePose

SCAN_HEAD = 60  # bytes of a sensor_msgs/LaserScan beside its ranges: CDR, stamp, name of the frame, angles, times


@dataclass(frozen=True, slots=True)
class Traffic:
    """What a drive took, messages of both ways.

    Attributes
    ----------
    seconds : float
        From the first scan to the last.
    scans, beams : int
        Scans, and the beams of them all.
    keyframes, points, sightings : int
        That were told of.
    plain : int
        Bytes of all facts as plain numbers: 32 bits for points and sightings, 64 for others.
    reports : int
        Bytes of the reports.
    other : int
        Bytes of statuses and answers.
    messages : int
        Of all kinds, both ways.
    """

    seconds: float
    scans: int
    beams: int
    keyframes: int
    points: int
    sightings: int
    plain: int
    reports: int
    other: int
    messages: int

    @property
    def per_keyframe(self) -> float:
        """Bytes of reports for each keyframe."""
        return self.reports / max(self.keyframes, 1)

    @property
    def plain_per_keyframe(self) -> float:
        """Bytes of plain numbers for each keyframe."""
        return self.plain / max(self.keyframes, 1)

    @property
    def rate(self) -> float:
        """Bytes a second of all messages, without the transport's own."""
        return (self.reports + self.other) / self.seconds

    @property
    def rate_sent(self) -> float:
        """Bytes a second with what the transport is thought to add."""
        return self.rate + OVERHEAD * self.messages / self.seconds

    def scan_rate(self, hertz: float) -> float:
        """Bytes a second of the raw scans as ``sensor_msgs/LaserScan``, so many a second."""
        return hertz * (SCAN_HEAD + 4.0 * self.beams / max(self.scans, 1))


def measure(
    messages: Iterable[LaserScan | Odometry | TruePose], config: Config, *, lidar_mount: Floats | None = None
) -> Traffic:
    """Map a drive, tell of it and count.

    Parameters
    ----------
    messages : iterable of LaserScan, Odometry or TruePose
    config : Config
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.

    Returns
    -------
    Traffic
    """
    slam, reporter, inbox = GraphSlam(config, lidar_mount=lidar_mount), Reporter("robot1", lambda: 1), Inbox()
    facts: list[Fact] = []
    scans = beams = other = count = 0
    begin = now = answered = 0.0
    sizes: dict[bool, int] = {True: 0, False: 0}

    def carry() -> None:
        nonlocal count
        for data in reporter.due(now):
            taken = inbox.take(data)
            sizes[taken.status is None] += len(data)
            count += 1
            facts.extend(fact for report in taken.reports for fact in report.facts)

    for message in messages:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            begin = message.stamp if scans == 0 else begin
            now = max(now, message.stamp - begin)
            scans, beams = scans + 1, beams + len(message.ranges)
            reporter.push(slam, slam.push_scan(message), now)
            carry()
            if now >= answered + 1.0:
                answered = now
                inbox.settle()
                last = slam.memory.keyframes[-1]
                known = inbox.state(("robot1", 1))
                key = len(slam.memory.keyframes) - 1
                answer = Answer("robot1", 1, *known, 1, ("robot1",), key, last.local, np.eye(3))
                other, count = other + len(encode(answer)), count + 1
                reporter.answered(answer)
    seconds = now
    reporter.flush(now)
    while not reporter.settled:  # what was held back for its rate
        now += 1.0
        carry()
        inbox.settle()
        known = inbox.state(("robot1", 1))
        reporter.answered(Answer("robot1", 1, *known, 1, (), -1, np.zeros(3), np.zeros((3, 3))))
    keyframes = [fact for fact in facts if isinstance(fact, KeyframeFact)]
    return Traffic(
        seconds, scans, beams, len(keyframes), sum(len(fact.points) for fact in keyframes),
        sum(len(fact.seen) for fact in keyframes), sum(map(_plain, facts)), sizes[True], sizes[False] + other, count,
    )  # fmt: skip


def _plain(fact: Fact) -> int:
    """Bytes of a fact as plain numbers."""
    if isinstance(fact, KeyframeFact):
        return 8 * 7 + 4 * fact.points.size + 4 * fact.seen.size
    return 8 * (2 + 3 + 9 + 1) + 1 if isinstance(fact, RelationFact) else 8 + 8 * len(fact.members) + fact.seen.nbytes
