"""What mapping and localisation have in common: messages go into a session, its results come out as messages."""

import tempfile
import time
from collections import OrderedDict, deque
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from tf2_msgs.msg import TFMessage

from contourslam.errors import ContourslamError
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.live.events import Source
from contourslam.live.processed import Processed
from contourslam.live.rehearsal import SHORT, stages
from contourslam.live.session import Session
from contourslam.live.warming import warm_up
from contourslam.live.worker import Onlooker, Worker
from contourslam.robot.config import load_robot
from contourslam.robot.live_map import settings_of
from contourslam.scan import LaserScan, Odometry
from contourslam.view.followed import Followed
from contourslam.view.server import ServeError
from contourslam.view.serving import page_server
from contourslam_ros.fleet_link import FleetLink
from contourslam_ros.frames import SENT
from contourslam_ros.grid_sender import GridSender
from contourslam_ros.latency import Latencies
from contourslam_ros.map_sender import MapSender
from contourslam_ros.messages import diagnostic_message, header, pose_message, transform_message
from contourslam_ros.onlookers import Onlookers
from contourslam_ros.sensors import Sensors
from contourslam_ros.services import Services
from contourslam_ros.settings import Settings, declared

HELD = 200  # odometry readings before the first scan


class LiveNode(Node):
    """A node around a session; what the session is for is said by :meth:`begin`.

    The node's thread takes in messages and sends the map; the worker's thread makes poses and sends them at once, and
    draws the map up while no scan waits.

    Parameters
    ----------
    name : str

    Raises
    ------
    ConfigError
        If a parameter is wrong.

    Attributes
    ----------
    rehearsed : tuple of str
        Stages of :mod:`contourslam.live.rehearsal` that the node may come to.
    back_end : str or None
        What the live page calls the work; None for that of the configuration.
    link : FleetLink or None
        What tells a fleet server of the mapping.
    failure : BaseException or None
        Why the node cannot go on.
    """

    rehearsed: tuple[str, ...] = ()
    back_end: str | None = None

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.settings = _of_robot(declared(self))
        self.config = self.settings.node
        self.failure: BaseException | None = None
        self.link: FleetLink | None = None
        self._sensors = Sensors(
            self, self.settings, on_scan=self._on_scan, on_odometry=self._on_odometry, on_refused=self._on_refused
        )
        self._session: Session | None = None
        self._worker: Worker | None = None
        self._early: deque[Odometry] = deque(maxlen=HELD)
        # Of each scan, its stamp to the bit and when it came.
        self._arrived: OrderedDict[float, tuple[Time, int]] = OrderedDict()
        self._latencies = Latencies()
        self._page: Followed | None = None
        self._serving = ExitStack()

    def begin(self, mount: np.ndarray) -> Session:
        """Make the session, now that it is known where the lidar sits (``T_base_lidar``, shape (3,))."""
        raise NotImplementedError

    def warm_up(self) -> None:
        """Have everything that the node may do done once before the first scan comes, so that it is compiled."""
        self.get_logger().info("warming up, which takes minutes when it is the first time on this machine")
        with tempfile.TemporaryDirectory() as folder:
            work = dict(stages(Path(folder)))
            for name in self.rehearsed:
                work[name]()
        warm_up(self.settings.core, laps=SHORT)  # with the detector and the filter that were chosen

    @property
    def topics(self) -> dict[Source, str]:
        """What the sensors' messages come on, for people."""
        odometry = "/tf" if self.config.odometry == "tf" else self.resolve_topic_name("odom")
        return {"scan": self.resolve_topic_name("scan"), "odometry": odometry}

    def start(self) -> None:
        """Publish and subscribe; from here on messages come in."""
        self._poses = self.create_publisher(PoseWithCovarianceStamped, "pose", 10)
        self._map, self._grid = MapSender(self, self.config), GridSender(self, self.config)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._transforms = self.create_publisher(TFMessage, "/tf", SENT)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._send_diagnostics, clock=steady)
        self.create_timer(self.config.map_period, self._send_map, clock=steady)
        if self.config.grid_period > 0.0:
            self.create_timer(self.config.grid_period, self._send_grid, clock=steady)
        if self.config.publish_tf and self.config.odometry != "none":
            self.create_timer(self.config.tf_period, self._send_transform, clock=steady)
        Services(self, self.running, self.config.map_file)
        if self.link is not None:
            self.link.start()
        if self.config.view_port:
            self._serve_page()
        self._sensors.listen()
        self.get_logger().info(f"ready: waiting for {' and '.join(self.topics.values())}")

    def stop(self) -> None:
        """End the session: what is to be saved by itself is saved."""
        if self._worker is not None:
            self._worker.stop()
            if self.link is not None:
                self.link.finish()
            self._worker = self._session = None
            self._grid.close()
        self._serving.close()

    def running(self) -> Session:
        """Give the session.

        Raises
        ------
        ContourslamError
            While there is none; the message says what is missing.
        """
        if self._session is None:
            raise ContourslamError(self._sensors.trouble)
        return self._session

    def _on_scan(self, scan: LaserScan, stamp: Time, came: int) -> None:
        if self._worker is None:
            if self._sensors.mounting is None or self.failure is not None:
                return
            try:
                self._session = self.begin(self._sensors.mounting.pose)
            except ContourslamError as error:
                self.failure = error
                return
            onlookers: list[Onlooker] = []
            if self.link is not None:
                onlookers.append(self.link.follow(self._session))
            if self._page is not None:
                onlookers.append(self._page.follow(self._session, self._sensors.mounting.pose))
            self._worker = Worker(
                self._session, self._on_done, clock=time.monotonic, failed=self._on_failure,
                onlooker=Onlookers(onlookers) if onlookers else None,
            )  # fmt: skip
            self._worker.start()
            while self._early:
                self._worker.push_odometry(self._early.popleft())
        while len(self._arrived) > 1000:  # those of scans that were dropped
            self._arrived.popitem(last=False)
        self._arrived[scan.stamp] = stamp, came
        self._worker.push_scan(scan)

    def _on_odometry(self, reading: Odometry) -> None:
        if self._worker is None:
            self._early.append(reading)
        else:
            self._worker.push_odometry(reading)

    def _on_refused(self, source: Source, stamp: float, why: str) -> None:
        self.get_logger().warning(f"{source} refused: {why}", throttle_duration_sec=10.0)
        if self._session is not None:
            self._session.refuse(source, stamp, why, time.monotonic())

    def _on_done(self, done: Processed) -> None:
        """Send the pose; called in the worker's thread."""
        stamp, came = self._arrived.pop(done.stamp)
        if self.link is not None:
            self.link.stamp = stamp
        if not done.localized:
            return
        head = header(stamp, self.config.frame(self.config.map_frame))
        self._poses.publish(pose_message(head, done.T_map_base, done.covariance))
        self._latencies.add((time.monotonic_ns() - came) * 1e-9)
        if self.config.publish_tf and self.config.odometry == "none":
            base = transform_message(head, self.config.frame(self.config.base_frame), done.T_map_base)
            self._send_transforms(base)

    def _on_failure(self, error: BaseException) -> None:
        self.failure = error

    def _serve_page(self) -> None:
        name = self.get_fully_qualified_name().lstrip("/")
        page = self._page = Followed(self.settings.core, title=name, back_end=self.back_end, health=self._missing)
        server = page_server(page.show, page.lag, host=self.config.view_host, port=self.config.view_port)
        try:
            self._serving.enter_context(server)
        except ServeError as error:
            raise ServeError(f"{error}; choose another view_port (0 for no page) or view_host") from error
        self.get_logger().info(f"the live page is at {server.url}")

    def _missing(self) -> tuple[Diagnostic, ...]:
        """Say what keeps the session from beginning; it tells the rest itself."""
        return (Diagnostic(Level.WARN, "scans", self._sensors.trouble),) if self._session is None else ()

    def _send_transform(self) -> None:
        now = self.get_clock().now().nanoseconds
        correction = None if self._session is None else self._session.map_to_odom(now * 1e-9)
        if correction is None:
            return
        seconds, nanoseconds = divmod(now + round(self.config.tf_ahead * 1e9), 1_000_000_000)
        head = header(Time(sec=seconds, nanosec=nanoseconds), self.config.frame(self.config.map_frame))
        odom = transform_message(head, self.config.frame(self.config.odom_frame), correction)
        self._send_transforms(odom)

    def _send_transforms(self, below: TransformStamped) -> None:
        """Send what lies below the map, and where the map lies in a common one."""
        above = None if self.link is None else self.link.transform(below.header.stamp)
        self._transforms.publish(TFMessage(transforms=[below] if above is None else [above, below]))

    def _send_map(self) -> None:
        if self._session is not None:
            self._map.send(self._session)

    def _send_grid(self) -> None:
        if self._session is not None and self._sensors.mounting is not None:
            self._grid.send(self._session, self._sensors.mounting.pose)

    def _send_diagnostics(self) -> None:
        told = self._missing()
        if self._session is not None:
            told = (*self._session.diagnostics(time.monotonic()), self._latencies.diagnostic())
        if self.link is not None:
            told = (*told, self.link.diagnostic())
        head = header(self.get_clock().now().to_msg(), "")
        self._diagnostics.publish(diagnostic_message(head, self.get_fully_qualified_name(), told))


def _of_robot(settings: Settings) -> Settings:
    """Let the core know what the robot's file says, where there is one."""
    if not settings.node.robot:
        return settings
    return replace(settings, core=settings_of(load_robot(Path(settings.node.robot).expanduser()), settings.core))
