"""What mapping and localisation have in common: messages go into a session, its results come out as messages."""

import time
from collections import OrderedDict, deque

import numpy as np
from builtin_interfaces.msg import Time
from contourslam_msgs.msg import LandmarkMap
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from contourslam.errors import ContourslamError
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.live.events import Source
from contourslam.live.session import Processed, Session
from contourslam.live.worker import Worker
from contourslam.scan import LaserScan, Odometry
from contourslam_ros.frames import SENT
from contourslam_ros.latency import Latencies
from contourslam_ros.markers import map_markers
from contourslam_ros.messages import diagnostic_message, header, landmark_message, pose_message, transform_message
from contourslam_ros.sensors import Sensors
from contourslam_ros.services import Services
from contourslam_ros.settings import declared

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
HELD = 200  # odometry readings before the first scan


class LiveNode(Node):
    """A node around a session; what the session is for is said by :meth:`begin`.

    The node's thread takes in messages and sends the map; the worker's thread makes poses and sends them at once.

    Parameters
    ----------
    name : str

    Raises
    ------
    ConfigError
        If a parameter is wrong.

    Attributes
    ----------
    failure : BaseException or None
        Why the node cannot go on.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.settings = declared(self)
        self.config = self.settings.node
        self.failure: BaseException | None = None
        self._sensors = Sensors(
            self, self.settings, on_scan=self._on_scan, on_odometry=self._on_odometry, on_refused=self._on_refused
        )
        self._session: Session | None = None
        self._worker: Worker | None = None
        self._early: deque[Odometry] = deque(maxlen=HELD)
        self._arrived: OrderedDict[float, tuple[Time, int]] = (
            OrderedDict()
        )  # of each scan: its stamp to the bit, and when it came
        self._latencies = Latencies()
        self._sent_version = -1

    def begin(self, mount: np.ndarray) -> Session:
        """Make the session, now that it is known where the lidar sits (``T_base_lidar``, shape (3,))."""
        raise NotImplementedError

    def start(self) -> None:
        """Publish and subscribe; from here on messages come in."""
        self._poses = self.create_publisher(PoseWithCovarianceStamped, "pose", 10)
        self._landmarks = self.create_publisher(LandmarkMap, "landmarks", LATCHED)
        self._markers = self.create_publisher(MarkerArray, "markers", LATCHED)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._transforms = self.create_publisher(TFMessage, "/tf", SENT)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(self.config.map_period, self._send_map, clock=steady)
        self.create_timer(1.0, self._send_diagnostics, clock=steady)
        if self.config.publish_tf and self.config.odometry != "none":
            self.create_timer(self.config.tf_period, self._send_transform, clock=steady)
        Services(self, self._running, self.config.map_file)
        self._sensors.listen()

    def stop(self) -> None:
        """End the session: what is to be saved by itself is saved."""
        if self._worker is not None:
            self._worker.stop()
            self._worker = self._session = None

    def restart(self) -> None:
        """Begin a new session with the next scan."""
        self.stop()
        self._sent_version = -1

    def _running(self) -> Session:
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
            self._worker = Worker(self._session, self._on_done, clock=time.monotonic, failed=self._on_failure)
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
        head = header(stamp, self.config.frame(self.config.map_frame))
        self._poses.publish(pose_message(head, done.T_map_base, done.covariance))
        self._latencies.add((time.monotonic_ns() - came) * 1e-9)
        if self.config.publish_tf and self.config.odometry == "none":
            base = transform_message(head, self.config.frame(self.config.base_frame), done.T_map_base)
            self._transforms.publish(TFMessage(transforms=[base]))

    def _on_failure(self, error: BaseException) -> None:
        self.failure = error

    def _send_transform(self) -> None:
        now = self.get_clock().now().nanoseconds
        correction = None if self._session is None else self._session.map_to_odom(now * 1e-9)
        if correction is None:
            return
        seconds, nanoseconds = divmod(now + round(self.config.tf_ahead * 1e9), 1_000_000_000)
        head = header(Time(sec=seconds, nanosec=nanoseconds), self.config.frame(self.config.map_frame))
        odom = transform_message(head, self.config.frame(self.config.odom_frame), correction)
        self._transforms.publish(TFMessage(transforms=[odom]))

    def _send_map(self) -> None:
        session = self._session
        if session is None or not session.map_changed(self._sent_version):
            return
        self._sent_version = session.map_version
        corners, walls = session.corner_map(), session.wall_map()
        head = header(self.get_clock().now().to_msg(), self.config.frame(self.config.map_frame))
        self._landmarks.publish(landmark_message(head, corners, walls))
        self._markers.publish(map_markers(head, corners, walls, self.config.ellipse_sigmas))

    def _send_diagnostics(self) -> None:
        if self._session is None:
            told: tuple[Diagnostic, ...] = (Diagnostic(Level.WARN, "scans", self._sensors.trouble),)
        else:
            told = (*self._session.diagnostics(time.monotonic()), self._latencies.diagnostic())
        head = header(self.get_clock().now().to_msg(), "")
        self._diagnostics.publish(diagnostic_message(head, self.get_fully_qualified_name(), told))
