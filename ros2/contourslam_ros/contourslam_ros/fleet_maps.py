"""Common maps as messages, sent where they have changed and somebody listens."""

import time
from collections.abc import Sequence

from contourslam_msgs.msg import LandmarkMap
from nav_msgs.msg import Path
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from contourslam.fleet.facts import Answer
from contourslam.fleet.server import FleetServer
from contourslam_ros.fleet_drawing import fleet_markers, way_message
from contourslam_ros.fleet_settings import FleetConfig
from contourslam_ros.fleet_topics import in_topic
from contourslam_ros.map_sender import LATCHED
from contourslam_ros.messages import header, landmark_message

SHARE = 4.0  # times as long as it takes to draw them, the maps are left alone


class FleetMaps:
    """Publishes the common maps.

    Topics are made by the node's thread (:meth:`offer`), for its executor looks through what the node has; maps are
    drawn and sent by the thread that works the server (:meth:`send`).

    Parameters
    ----------
    node : Node
    config : FleetConfig
    """

    def __init__(self, node: Node, config: FleetConfig) -> None:
        self._node, self._config = node, config
        self._markers = node.create_publisher(MarkerArray, "/fleet/markers", LATCHED)
        self._landmarks: dict[int, Publisher] = {}
        self._ways: dict[str, Publisher] = {}
        self._due = 0.0
        self._sent: dict[Publisher, object] = {}

    def offer(self, answers: Sequence[Answer]) -> None:
        """Have a topic for each common map and each robot."""
        for answer in answers:
            if answer.keyframe < 0:
                continue
            if answer.common not in self._landmarks:
                topic = f"/fleet/map_{answer.common}/landmarks"
                self._landmarks[answer.common] = self._node.create_publisher(LandmarkMap, topic, LATCHED)
            if answer.robot not in self._ways:
                topic = f"/fleet/way/{in_topic(answer.robot)}"
                self._ways[answer.robot] = self._node.create_publisher(Path, topic, LATCHED)

    def send(self, server: FleetServer, answers: Sequence[Answer]) -> None:
        """Send what has changed since to those who listen; drawn up only then.

        Parameters
        ----------
        server : FleetServer
        answers : sequence of Answer
            Of late: the maps have changed where these have.
        """
        now = time.monotonic()
        if now < self._due:
            return
        self._due = now + self._config.map_period
        state = tuple((a.robot, a.run, a.common, a.keyframe, *a.pose.tolist()) for a in answers)
        landmarks, ways = dict(self._landmarks), dict(self._ways)
        publishers = [self._markers, *landmarks.values(), *ways.values()]
        wanted = {p for p in publishers if p.get_subscription_count() and self._sent.get(p) != state}
        if not wanted:
            return
        maps = server.common_maps()
        newest = {answer.robot: answer.run for answer in answers}  # the last is the youngest
        standing = {shared.number: shared.saved for shared in maps}
        for number, publisher in landmarks.items():
            if publisher in wanted:
                head, saved = self._head(number), standing.get(number)
                gone = LandmarkMap(header=head)  # into another map
                publisher.publish(gone if saved is None else landmark_message(head, saved.corners, saved.walls))
        for shared in maps:
            for (robot, run), stamps, poses in shared.frames():
                if newest.get(robot) == run and ways.get(robot) in wanted:
                    ways[robot].publish(way_message(self._head(shared.number), stamps, poses))
        if self._markers in wanted:
            robots = sorted({robot for shared in maps for robot, _ in shared.members})
            self._markers.publish(fleet_markers(maps, self._head, self._config.ellipse_sigmas, robots))
        self._sent.update(dict.fromkeys(wanted, state))
        done = time.monotonic()
        self._due = max(self._due, done + SHARE * (done - now))

    def _head(self, number: int) -> Header:
        return header(self._node.get_clock().now().to_msg(), self._config.frame(number))
