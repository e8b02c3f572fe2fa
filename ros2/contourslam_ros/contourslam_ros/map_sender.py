"""Corners and walls as messages, sent where they have changed and somebody listens."""

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
        self._sent: dict[Publisher, object] = {}

    def send(self, session: Session) -> None:
        """Send the map as it was drawn up last to those who have not had it."""
        listened_to = [p for p in (self._landmarks, self._markers) if p.get_subscription_count()]
        drawn = session.latest_map() if listened_to else None
        wanted = [p for p in listened_to if drawn is not None and self._sent.get(p) is not drawn]
        if drawn is None or not wanted:
            return
        self._sent.update(dict.fromkeys(wanted, drawn))
        head = header(self._node.get_clock().now().to_msg(), self._config.frame(self._config.map_frame))
        if self._landmarks in wanted:
            self._landmarks.publish(landmark_message(head, drawn.corners, drawn.walls))
        if self._markers in wanted:
            self._markers.publish(map_markers(head, drawn.corners, drawn.walls, self._config.ellipse_sigmas))
