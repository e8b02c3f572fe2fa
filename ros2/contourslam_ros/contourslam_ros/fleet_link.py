"""A robot's link to the fleet server: what it maps goes out, and where that lies in a common map comes in."""

import math
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

import rclpy
from builtin_interfaces.msg import Time
from contourslam_msgs.msg import FleetPacket
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from contourslam.config import LiveConfig
from contourslam.errors import MessageError
from contourslam.fleet.facts import Answer
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.wire import decode
from contourslam.graph.slam import GraphSlam
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.live.processed import Processed
from contourslam.live.session import Session
from contourslam.live.smoothing import Smoother
from contourslam.slam.mapper import Mapper
from contourslam_ros.fleet_topics import QUALITY, REPORTS, answers_to, packet
from contourslam_ros.messages import header, pose_message, transform_message
from contourslam_ros.settings import NodeConfig

TURN = 0.2  # s between two looks whether something is to be sent
PERIOD = 2.0  # s between two reports, and between two statuses: more often would cost more than 2 kB/s on the wire
QUIET = 2.0  # s without a scan after which a robot is taken to stand still
AWAY = 8.0  # s without an answer after which there is no server
TOLD = 10.0  # s for which it is said that something could not be told
LAST_WORDS = 4.0  # s that a node which ends waits at most for the server to have all


class FleetLink:
    """Tells a fleet server of a session; a :class:`contourslam.live.worker.Onlooker`.

    It reads the graph in the mapping's thread, once a scan's pose has been handed on; the node's thread sends and
    listens. With no server there it keeps what there is to tell, and the mapping knows nothing of it.

    Parameters
    ----------
    node : Node
    config : NodeConfig
    live : LiveConfig
        How fast the transform from a common map may follow.

    Attributes
    ----------
    stamp : Time
        Of the scan that it is shown next, to the bit.
    """

    def __init__(self, node: Node, config: NodeConfig, live: LiveConfig) -> None:
        self._node, self._config = node, config
        self._reporter = Reporter(config.fleet, period=PERIOD)
        self._session: Session | None = None
        self._lock = threading.Lock()  # held while the next two are asked or changed
        self._smoother, self._common = Smoother(live), 0
        self._answer: Answer | None = None
        self._heard, self._trouble = -math.inf, ""
        self._failures, self._failure, self._failed = 0, "", -math.inf
        self._taken = math.inf  # when the last scan was taken in
        self.stamp = Time()

    def start(self) -> None:
        """Publish and subscribe."""
        self._reports = self._node.create_publisher(FleetPacket, REPORTS, QUALITY)
        self._node.create_subscription(FleetPacket, answers_to(self._config.fleet), self._take_answer, QUALITY)
        self._poses = self._node.create_publisher(PoseWithCovarianceStamped, "pose_in_common", 10)
        self._node.create_timer(TURN, self._send, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def follow(self, session: Session) -> Self:
        """Begin to follow a session; before its first scan."""
        self._session = session
        return self

    # In the mapping's thread.

    def take(self, processed: Processed) -> None:
        """Tell what a scan has added, and publish where the robot is in the common map."""
        session = self._session
        if session is not None:
            with self._spared():
                session.inspect(lambda mapper: self._look(mapper, processed))

    def rest(self) -> None:
        """Tell the last of it where no more scans come: else that would wait for the next one."""
        now = time.monotonic()
        if now > self._taken + QUIET:
            self._taken = math.inf
            with self._spared():
                self._reporter.flush(now)

    def _look(self, mapper: Mapper, processed: Processed) -> None:
        assert self._session is not None
        if not isinstance(mapper, GraphSlam) or processed.map_version != self._session.map_version:
            return  # the robot is looked for in a map that was kept, or the mapper that said this is no more
        self._taken = time.monotonic()
        self._reporter.push(mapper, processed.update, self._taken)
        placed = self._reporter.placed()
        with self._lock:
            if placed is None or placed.common != self._common:  # nothing is smooth into another frame
                self._smoother.reset()
            if placed is None:
                return
            self._common = placed.common
            self._smoother.correct(placed.T_common_map, placed.own, processed.stamp)
        head = header(self.stamp, f"{self._config.common_frame}_{placed.common}")
        self._poses.publish(pose_message(head, placed.pose, placed.covariance))

    # In any thread.

    @contextmanager
    def _spared(self) -> Iterator[None]:
        """Let mapping and node go on, and tell the fleet what comes next, whatever could not be told."""
        try:
            yield
        except Exception as error:
            self._failures, self._failure, self._failed = self._failures + 1, repr(error), time.monotonic()
            self._node.get_logger().error(f"the fleet is not told all: {error!r}", throttle_duration_sec=TOLD)

    def transform(self, stamp: Time) -> TransformStamped | None:
        """Give the transform from the common map to the robot's own; None before it is known."""
        with self._lock:
            smooth, common = self._smoother.at(stamp.sec + 1e-9 * stamp.nanosec), self._common
        if smooth is None:
            return None
        head = header(stamp, f"{self._config.common_frame}_{common}")
        return transform_message(head, self._config.frame(self._config.map_frame), smooth)

    def diagnostic(self) -> Diagnostic:
        """Say whether there is a server, what it has, and with whom the robot shares a map."""
        answer, waiting = self._answer, self._reporter.waiting
        values = {
            "robot": self._config.fleet,
            "run": f"{self._reporter.run or 0:x}",
            "acknowledged": "0" if answer is None else str(answer.received),
            "waiting": str(waiting),
            "common map": "" if answer is None else str(answer.common),
            "members": "" if answer is None else ", ".join(answer.members),
            "failures": str(self._failures),
            "given up": str(self._reporter.given_up),
            "left out": str(self._reporter.left_out),
        }
        if time.monotonic() - self._failed < TOLD:
            return Diagnostic(Level.ERROR, "fleet", f"the fleet is not told all: {self._failure}", values)
        if self._trouble:
            return Diagnostic(Level.WARN, "fleet", f"an answer cannot be read: {self._trouble}", values)
        if time.monotonic() - self._heard > AWAY:
            return Diagnostic(
                Level.WARN,
                "fleet",
                f"no fleet server answers on {answers_to(self._config.fleet)}: {waiting} reports wait for it; the "
                "mapping goes on",
                values,
            )
        others = [] if answer is None else [name for name in answer.members if name != self._config.fleet]
        company = f"shares a map with {', '.join(others)}" if others else "has met no other robot yet"
        if self._reporter.given_up or self._reporter.left_out:
            lost = f"{self._reporter.given_up} reports were given up, {self._reporter.left_out} facts not sent whole"
            return Diagnostic(Level.WARN, "fleet", f"connected; {company}; {lost}", values)
        return Diagnostic(Level.OK, "fleet", f"connected; {company}", values)

    # In the node's thread.

    def finish(self) -> None:
        """Tell what has not been told yet, and wait a moment for the server to have it; the mapping has ended."""
        with self._spared():
            self._reporter.flush(time.monotonic())
        end = time.monotonic() + LAST_WORDS
        while not self._reporter.settled and self._heard > end - LAST_WORDS - AWAY and time.monotonic() < end:
            rclpy.spin_once(self._node, timeout_sec=TURN)

    def _send(self) -> None:
        if self._reports.get_subscription_count():  # else all waits
            with self._spared():
                for data in self._reporter.due(time.monotonic()):
                    self._reports.publish(packet(data))

    def _take_answer(self, message: FleetPacket) -> None:
        try:
            answer = decode(bytes(message.data))
            if not isinstance(answer, Answer):
                raise MessageError("what robots say comes where the server answers; is a topic remapped wrongly?")
        except MessageError as error:
            self._trouble = str(error)
            return
        self._trouble, self._heard = "", time.monotonic()
        self._reporter.answered(answer)
        if answer.run == self._reporter.run:
            self._answer = answer
