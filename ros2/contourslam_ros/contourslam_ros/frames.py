"""Transforms heard on /tf and /tf_static: where the lidar sits, and odometry that comes as a transform.

tf2's own buffer is not needed for that: mountings do not change, and odometry is interpolated in the core.
"""

from collections.abc import Callable, Iterable, Iterator

import numpy as np
from geometry_msgs.msg import TransformStamped
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription
from tf2_msgs.msg import TFMessage

from contourslam.recordings.ros_messages import frame_name
from contourslam.scan.mounting import Mounting, mounting

Floats = NDArray[np.float64]

SENT = QoSProfile(depth=100)
STATIC = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Frames:
    """The latest transform to each frame from its parent; changed in place.

    Attributes
    ----------
    on_moved : callable
        Called with each transform that comes on /tf.
    """

    def __init__(self, on_moved: Callable[[TransformStamped], None] = lambda stamped: None) -> None:
        self._parents: dict[str, tuple[str, Floats]] = {}
        self._on_moved = on_moved
        self._moving: tuple[Node, Subscription] | None = None

    def listen(self, node: Node) -> None:
        """Subscribe a node to both topics."""
        node.create_subscription(TFMessage, "/tf_static", lambda message: self.add(message.transforms), STATIC)
        self._moving = node, node.create_subscription(TFMessage, "/tf", self._moved, SENT)

    def stand_still(self) -> None:
        """Listen no longer to /tf, on which there are some hundred transforms a second."""
        if self._moving is not None:
            node, subscription = self._moving
            node.destroy_subscription(subscription)
            self._moving = None

    def _moved(self, message: TFMessage) -> None:
        self.add(message.transforms)
        for stamped in message.transforms:
            self._on_moved(stamped)

    def add(self, transforms: Iterable[TransformStamped]) -> None:
        """Take in transforms; the latest counts, and what is no motion does not."""
        for stamped in transforms:
            t, q = stamped.transform.translation, stamped.transform.rotation
            row = np.array([t.x, t.y, t.z, q.x, q.y, q.z, q.w])
            length = float(np.linalg.norm(row[3:]))
            if np.isfinite(row).all() and abs(length - 1.0) < 0.1:
                row[3:] /= length
                self._parents[frame_name(stamped.child_frame_id)] = frame_name(stamped.header.frame_id), row

    def mounting(self, lidar: str, base: str) -> Mounting | None:
        """Find how a lidar is mounted on the base; None where no transforms join the two.

        Raises
        ------
        ScanError
            If it does not scan level.
        """
        place = self.between(base, lidar)
        return None if place is None else mounting(place[:3], place[3:], frame=lidar)

    def between(self, target: str, source: str) -> Floats | None:
        """Give the pose of a frame in another: x, y, z, m, and quaternion x, y, z, w; None where nothing joins them."""
        up = dict(self._above(frame_name(target)))
        for frame, place in self._above(frame_name(source)):
            if frame in up:
                return _product(_inverse(up[frame]), place)
        return None

    def _above(self, frame: str) -> Iterator[tuple[str, Floats]]:
        """Yield a frame and all above it, with the pose of the first in each."""
        place = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        seen = set()
        while frame not in seen:  # a cycle would be a wrong description
            yield frame, place
            seen.add(frame)
            if frame not in self._parents:
                return
            frame, step = self._parents[frame]
            place = _product(step, place)


def _turned(q: Floats, v: Floats) -> Floats:
    """Turn a vector by a unit quaternion x, y, z, w."""
    twice = 2.0 * np.cross(q[:3], v)
    turned: Floats = v + q[3] * twice + np.cross(q[:3], twice)
    return turned


def _product(first: Floats, second: Floats) -> Floats:
    a, b = first[3:], second[3:]
    vector = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.array([*(first[:3] + _turned(a, second[:3])), *vector, a[3] * b[3] - a[:3] @ b[:3]])


def _inverse(place: Floats) -> Floats:
    back = place[3:] * np.array([-1.0, -1.0, -1.0, 1.0])
    return np.array([*-_turned(back, place[:3]), *back])
