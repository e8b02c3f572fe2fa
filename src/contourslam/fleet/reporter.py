"""The robot's side: what is new in its graph becomes reports, and answers tell where it is in the common map."""

import math
import secrets
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.errors import MessageError
from contourslam.fleet.facts import Answer, Fact, KeyframeFact, Report, Status
from contourslam.fleet.reporter_facts import News
from contourslam.fleet.reporter_outbox import Allowance, Outbox
from contourslam.fleet.wire import RUN_BITS, check_name, encode
from contourslam.geometry.poses import between_one, compose, inverse
from contourslam.graph.memory import Memory
from contourslam.graph.slam import GraphSlam
from contourslam.matching.small import moved, turned
from contourslam.slam.result import ScanUpdate

FULL = 4  # keyframes after which a report is closed before its time
FORMER = 16 << 20  # bytes of runs before this one that are kept for a server that misses them: some hours of driving


def draw_run() -> int:
    """Draw the number of a run: no two are alike, on whatever machine."""
    return secrets.randbits(RUN_BITS)


@dataclass(frozen=True, slots=True)
class Placed:
    """Where a robot is in the common map.

    Attributes
    ----------
    stamp : float
        Of the scan, s.
    common : int
        Number of the common map.
    members : tuple of str
        Robots whose maps are joined there.
    pose : ndarray, shape (3,)
        Base in the frame of the common map: m, m, rad.
    covariance : ndarray, shape (3, 3)
        In the axes of the common map.
    own : ndarray, shape (3,)
        Base in the robot's own map.
    T_common_map : ndarray, shape (3,)
        Frame of the robot's own map in that of the common map, here: both may be bent elsewhere.
    """

    stamp: float
    common: int
    members: tuple[str, ...]
    pose: Floats
    covariance: Floats
    own: Floats
    T_common_map: Floats


class Reporter:
    """Makes reports of a graph as it grows, and keeps them until the server has them; changed in place.

    :meth:`push` is for the thread that maps; all others may be called from any thread at any time.

    All reports of the run are kept until it ends, those that the server has acknowledged too: a server that lost its
    folder is told all of it again. That takes 1 to 6 MB an hour. Of runs before it only those are kept of which the
    server still misses something, up to 16 MiB together; beyond, the oldest are given up, and counted.

    Parameters
    ----------
    robot : str
        Its name: 1 to 64 letters, digits, dots, dashes and underscores.
    run : callable
        Gives the number of each run that begins.
    period : float
        s between two reports, and between two statuses.
    rate : float
        Bytes a second that are sent at most on average, the transport's own with them.

    Attributes
    ----------
    robot : str
    given_up : int
        Reports of earlier runs that the server never got, and never will.
    left_out : int
        Facts that could not be sent as they are, as for a number that is not finite: a keyframe was told without its
        contours then, anything else not at all.

    Raises
    ------
    MessageError
        If the name is none.
    """

    def __init__(
        self, robot: str, run: Callable[[], int] = draw_run, *, period: float = 1.0, rate: float = 4000.0
    ) -> None:
        self.robot = check_name(robot)
        self.given_up = self.left_out = 0
        self._draw, self._period = run, period
        self._news: News | None = None
        self._facts: list[Fact] = []
        self._own: Floats = np.zeros(3)  # base in the robot's own map at the last scan
        self._closed_at = -math.inf
        self._lock = threading.Lock()  # held for moments; all below is changed under it
        self._outbox: Outbox | None = None
        self._former: list[Outbox] = []
        self._allowance = Allowance(rate)
        self._status_at = -math.inf
        self._answer: Answer | None = None
        self._placed: Placed | None = None

    @property
    def run(self) -> int | None:
        """Number of the run; None before the first scan."""
        outbox = self._outbox
        return None if outbox is None else outbox.run

    @property
    def waiting(self) -> int:
        """Reports that the server has not said to have."""
        with self._lock:
            return sum(max(len(box.reports) - box.received, 0) for box in self._boxes())

    @property
    def settled(self) -> bool:
        """Whether the server has said that it has everything that there is to tell, but for what was given up."""
        with self._lock:
            return not self._facts and all(box.settled for box in self._boxes())

    def push(self, slam: GraphSlam, update: ScanUpdate, now: float) -> None:
        """Take in what a scan has added to the graph.

        A graph that goes on where another one ended, because the robot was lost and found itself in its own map, goes
        on with the run. Any other one begins a new run.

        Parameters
        ----------
        slam : GraphSlam
            Nothing in it is changed.
        update : ScanUpdate
            What the scan gave.
        now : float
            s, in a clock that nobody sets.
        """
        news = self._news
        if news is None or news.memory is not slam.memory:
            news = self._take_up(slam)
        self._own = update.pose
        self._facts += news.collect(update.pose)
        full = sum(isinstance(fact, KeyframeFact) for fact in self._facts) >= FULL
        if self._facts and (full or now >= self._closed_at + self._period):
            self._close(now)
        self._stand(update, news)

    def flush(self, now: float) -> None:
        """Make a report of what has not been told yet: when the mapping ends."""
        while self._news is not None and (rest := self._news.collect(self._own)):
            self._facts += rest
            self._close(now)
        if self._facts:
            self._close(now)

    def due(self, now: float) -> list[bytes]:
        """Give the messages to be sent now, oldest first; to be called some times a second."""
        with self._lock:
            self._allowance.renew(now)
            out: list[bytes] = []
            self._former = [box for box in self._former if not box.settled]
            boxes = self._boxes()
            for box in boxes:
                out += box.due(now, self._allowance)
            if now >= self._status_at + self._period:
                self._status_at = now
                for news in (box.news() for box in boxes):
                    if news is not None:
                        self._allowance.spend(len(news))
                        out.append(news)
            return out

    def answered(self, answer: Answer) -> None:
        """Take in what the server says; an answer to somebody else is none of ours."""
        if answer.robot != self.robot:
            return
        with self._lock:
            for box in self._boxes():
                if box.run == answer.run:
                    box.answered(answer)
            if self._outbox is not None and answer.run == self._outbox.run:
                self._answer = answer

    def placed(self) -> Placed | None:
        """Give the robot's place in the common map at the last scan; None as long as the server has not told of one."""
        with self._lock:
            return self._placed

    def _boxes(self) -> list[Outbox]:
        """Runs before this one of which the server misses something, and this one."""
        return [*self._former, *([] if self._outbox is None else [self._outbox])]

    def _take_up(self, slam: GraphSlam) -> News:
        """Go on with another graph."""
        before = self._news
        self.flush(self._closed_at)
        self._news = news = News(slam.memory, before)
        with self._lock:
            if self._outbox is None or not news.continued:
                if self._outbox is not None:
                    self._former.append(self._outbox)
                    self._make_room()
                self._outbox = Outbox(self._draw())
                self._answer = self._placed = None
        return news

    def _make_room(self) -> None:
        """Give up the oldest of the earlier runs where they take too much."""
        self._former = [box for box in self._former if not box.settled]
        while self._former and sum(box.size for box in self._former) > FORMER:
            box = self._former.pop(0)
            self.given_up += len(box.reports) - box.received

    def _close(self, now: float) -> None:
        """Make a report of the facts that wait."""
        facts, self._facts, self._closed_at = tuple(self._facts), [], now
        self._tell(facts)

    def _tell(self, facts: tuple[Fact, ...]) -> None:
        """Make a report; where some facts cannot be sent, the others still are, each by itself."""
        outbox = self._outbox
        if outbox is None:
            return
        try:
            report = encode(Report(self.robot, outbox.run, len(outbox.reports), facts))
        except MessageError:
            if len(facts) > 1:
                for fact in facts:
                    self._tell((fact,))
                return
            self.left_out += 1
            fact = facts[0]
            if isinstance(fact, KeyframeFact) and len(fact.points) + len(fact.seen):
                # Those after it count on its number.
                self._tell((replace(fact, points=fact.points[:0], seen=fact.seen[:0]),))
            return
        with self._lock:
            outbox.add(report)

    def _stand(self, update: ScanUpdate, news: News) -> None:
        """Take in where the robot is now."""
        keyframe = len(news.memory.keyframes) - 1
        seen = seen_from(news.memory, keyframe)
        with self._lock:
            outbox, answer = self._outbox, self._answer
            if outbox is not None:
                outbox.status = Status(self.robot, outbox.run, len(outbox.reports), keyframe, seen, update.stamp)
        placed = None
        if answer is not None and 0 <= answer.keyframe < len(news.poses):
            placed = _place(update, answer, news)
        with self._lock:
            self._placed = placed


def seen_from(memory: Memory, keyframe: int) -> Floats:
    """Base seen from a keyframe of this drive, as the contours between the two have it."""
    local = memory.keyframes[keyframe].local
    return np.zeros(3) if memory.contour is None else between_one(local, memory.contour.pose)


def _place(update: ScanUpdate, answer: Answer, news: News) -> Placed:
    """Carry the pose that the server gave one keyframe on to the base."""
    memory, key = news.memory, answer.keyframe
    then, nodes = memory.keyframes[key], memory.landmarks.nodes
    same_drive = then.drive == memory.keyframes[-1].drive
    seen = seen_from(memory, key) if same_drive else between_one(news.poses[key], update.pose)
    # What is lost on the way from there: between the two local maps, and within the one that the robot is in.
    noise = turned(memory.doubt.between(nodes[-1], np.array([nodes[key]]), update.pose)[0], -news.poses[key][2])
    active = None if memory.contour is None else memory.contour.active
    if active is not None:
        noise = noise + turned(active.covariance, -then.local[2])
    pose, covariance = moved(answer.pose, answer.covariance, seen, noise)
    T_common_map = compose(pose, inverse(update.pose))
    return Placed(update.stamp, answer.common, answer.members, pose, covariance, update.pose, T_common_map)
