"""Scans and odometry out of messages, for a robot whose lidar sits anywhere on it."""

import time
from collections import deque
from collections.abc import Callable

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.subscription import MessageInfo
from sensor_msgs.msg import LaserScan as ScanMessage

from contourslam.errors import ScanError
from contourslam.geometry.poses import compose
from contourslam.live.events import Source
from contourslam.recordings.ros_messages import ODOMETRY, TRANSFORM, frame_name, odometry_from, scan_from, stamp_of
from contourslam.scan import LaserScan, Odometry
from contourslam.scan.mounting import Mounting
from contourslam_ros.frames import Frames
from contourslam_ros.settings import Settings

# As the sensors' own profile, but deep enough for what comes while the machine is busy for some seconds.
SENSOR = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)


class Sensors:
    """Subscriptions of a node; scans are held back until it is known where the lidar sits.

    Parameters
    ----------
    node : Node
    settings : Settings
    on_scan : callable
        Called with each scan, its stamp to the bit, and when the middleware had it, ns on the monotonic clock.
    on_odometry : callable
        Called with each reading, for the base frame.
    on_refused : callable
        Called with the source, the stamp, s, and what is wrong, of a message that is none.

    Attributes
    ----------
    mounting : Mounting or None
        Where the lidar sits, once that is known.
    trouble : str
        Why there are no scans yet, and what to do.
    """

    def __init__(
        self,
        node: Node,
        settings: Settings,
        *,
        on_scan: Callable[[LaserScan, Time, int], None],
        on_odometry: Callable[[Odometry], None],
        on_refused: Callable[[Source, float, str], None],
    ) -> None:
        self._node, self._config, self._lidar = node, settings.node, settings.core.lidar
        self._on_scan, self._on_odometry, self._on_refused = on_scan, on_odometry, on_refused
        self.mounting: Mounting | None = None
        self.trouble = f"no scan has come on {node.resolve_topic_name('scan')} yet"
        self._held: deque[tuple[ScanMessage, int]] = deque(maxlen=int(settings.live.max_waiting))
        self._frames = Frames(self._take_transform)
        self._base, self._odom = (
            self._config.frame(name) for name in (self._config.base_frame, self._config.odom_frame)
        )

    def listen(self) -> None:
        """Subscribe; from here on messages come in."""
        self._frames.listen(self._node)
        if self._config.odometry == "topic":
            self._node.create_subscription(OdometryMessage, "odom", self._take_odometry, SENSOR)
        self._node.create_subscription(ScanMessage, "scan", self._take_scan, SENSOR)

    def _take_scan(self, message: ScanMessage, info: MessageInfo) -> None:
        # As of when the middleware had it: that it then waits for this thread counts as latency too.
        came = time.monotonic_ns() - max(0, time.time_ns() - info["received_timestamp"])
        self._held.append((message, came))
        if self.mounting is None:
            self._find_mounting(message.header.frame_id)
        while self.mounting is not None and self._held:
            message, came = self._held.popleft()
            try:
                scan = scan_from(message, self.mounting.upside_down)
            except ScanError as error:
                self._on_refused("scan", stamp_of(message.header), str(error))
                continue
            self._on_scan(scan, message.header.stamp, came)

    def _find_mounting(self, lidar: str) -> None:
        if not self._config.mount_from_tf:
            self.mounting = Mounting(np.array(self._lidar.mount), self._config.upside_down)
            return
        try:
            self.mounting = self._frames.mounting(lidar, self._base)
        except ScanError as error:
            self.trouble = str(error)
            return
        if self.mounting is None:
            self.trouble = (
                f"no transform from {self._base} to {lidar}: publish it (robot_state_publisher, "
                "static_transform_publisher), or set mount_from_tf to false and give lidar.mount_x, lidar.mount_y and "
                "lidar.mount_yaw"
            )
            return
        if self._config.odometry != "tf":
            self._frames.stand_still()
        x, y, yaw = self.mounting.pose
        where = f"{lidar} sits at x {x:.3f} m, y {y:.3f} m, {np.degrees(yaw):.1f} degrees on {self._base}"
        self._node.get_logger().info(where + (", upside down" if self.mounting.upside_down else ""))

    def _take_odometry(self, message: OdometryMessage) -> None:
        self._take(message, ODOMETRY, message.child_frame_id)

    def _take_transform(self, stamped: TransformStamped) -> None:
        if self._config.odometry == "tf" and frame_name(stamped.header.frame_id) == self._odom:
            self._take(stamped, TRANSFORM, stamped.child_frame_id)

    def _take(self, message: OdometryMessage | TransformStamped, kind: str, child: str) -> None:
        try:
            reading = odometry_from(message, kind)
        except ScanError as error:
            self._on_refused("odometry", stamp_of(message.header), str(error))
            return
        if child and frame_name(child) != self._base:  # such as base_footprint
            base = self._frames.between(child, self._base)
            if base is not None:
                heading = 2.0 * np.arctan2(base[5], base[6])
                reading = Odometry(reading.stamp, compose(reading.pose, np.array([*base[:2], heading])))
        self._on_odometry(reading)
