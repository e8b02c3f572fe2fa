"""The map as messages, sent where it has changed and somebody listens."""

import math
import threading
import time

from contourslam_msgs.msg import LandmarkMap
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from visualization_msgs.msg import MarkerArray

from contourslam.live.session import Session
from contourslam_ros.markers import map_markers
from contourslam_ros.messages import header, landmark_message
from contourslam_ros.settings import NodeConfig

# Who comes later gets the last one.
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class MapSender:
    """Publishes corners and walls, as a message and as markers.

    Parameters
    ----------
    node : Node
    config : NodeConfig
    """

    def __init__(self, node: Node, config: NodeConfig) -> None:
        self._node, self._config = node, config
        self._landmarks = node.create_publisher(LandmarkMap, "landmarks", LATCHED)
        self._markers = node.create_publisher(MarkerArray, "markers", LATCHED)
        self._versions: dict[Publisher, int] = {self._landmarks: -1, self._markers: -1}
        self._sent_at = -math.inf
        self._busy = threading.Lock()

    def send(self, session: Session, *, slack: float = 0.0) -> None:
        """Send what is due; may be called from any thread.

        Parameters
        ----------
        session : Session
        slack : float
            Leave it to others until it is overdue by this much, s.
        """
        due = self._sent_at + self._config.map_period + slack
        if time.monotonic() < due or not self._busy.acquire(blocking=False):
            return
        try:
            version = session.map_version
            wanted = [p for p, sent in self._versions.items() if sent != version and p.get_subscription_count()]
            if wanted:
                self._sent_at = time.monotonic()
                self._versions.update(dict.fromkeys(wanted, version))
                self._publish(session, wanted)
        finally:
            self._busy.release()

    def _publish(self, session: Session, wanted: list[Publisher]) -> None:
        corners, walls = session.corner_map(), session.wall_map()
        head = header(self._node.get_clock().now().to_msg(), self._config.frame(self._config.map_frame))
        if self._landmarks in wanted:
            self._landmarks.publish(landmark_message(head, corners, walls))
        if self._markers in wanted:
            self._markers.publish(map_markers(head, corners, walls, self._config.ellipse_sigmas))
