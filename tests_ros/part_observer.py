"""Listens to the nodes of the robot's parts."""

import time
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import TransformStamped
from observer import Observer, wait_for
from tf2_msgs.msg import TFMessage

from contourslam.recordings.ros_messages import stamp_of
from contourslam_ros.frames import STATIC


class PartObserver(Observer):
    """What was heard so far of one robot.

    Attributes
    ----------
    heard : dict of str to list of (float, message)
        By topic, when each message came (monotonic), and what.
    places : dict of str to TransformStamped
        What was said on /tf_static, by the child's name.
    """

    def __init__(self, namespace: str, **topics: Any) -> None:
        super().__init__(namespace, "part_observer")
        self.heard: dict[str, list[tuple[float, Any]]] = {topic: [] for topic in topics}
        self.places: dict[str, TransformStamped] = {}
        for topic, kind in topics.items():
            self.listen(topic, kind)
        self.node.create_subscription(TFMessage, "/tf_static", self._on_place, STATIC)

    def listen(self, topic: str, kind: Any) -> None:
        """Listen to one more topic; two underscores in its name stand for a slash."""
        rows = self.heard.setdefault(topic, [])
        name = topic.replace("__", "/")
        self.node.create_subscription(kind, name, lambda message: rows.append((time.monotonic(), message)), 1000)

    def _on_place(self, message: TFMessage) -> None:
        self.places |= {stamped.child_frame_id: stamped for stamped in message.transforms}

    def messages(self, topic: str, since: float = 0.0) -> list[Any]:
        """What came on a topic, after a time."""
        return [message for when, message in list(self.heard[topic]) if when >= since]

    def stamps(self, topic: str, since: float = 0.0) -> np.ndarray:
        """Stamps of what came, s."""
        return np.array([stamp_of(message.header) for message in self.messages(topic, since)])

    def comes(self, topic: str, count: int = 1, *, since: float = 0.0, seconds: float = 30.0) -> bool:
        """Wait for so many messages."""
        return wait_for(lambda: len(self.messages(topic, since)) >= count, seconds)

    def hears(self, *words: str, since: float = 0.0, seconds: float = 15.0) -> bool:
        """Wait for a diagnostic that is no OK and holds all words."""
        return wait_for(lambda: self.said(*words, since=since), seconds)

    def is_well(self, name: str, since: float, seconds: float = 15.0) -> bool:
        """Wait for a diagnostic that is OK, of something whose name ends so."""

        def told() -> bool:
            rows = [s for when, s in self._mine() if when >= since and s.name.endswith(name)]
            return any(status.level == DiagnosticStatus.OK for status in rows)

        return wait_for(told, seconds)
