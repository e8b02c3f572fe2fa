"""ROS messages turned into scans, odometry and true poses.

Only standard messages are read. Their layout has never changed, so that one set of definitions also serves bags that
carry none, and a bag's other messages may be of any type.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from contourslam.errors import ScanError
from contourslam.recordings.salvage import RawMessage
from contourslam.scan import LaserScan, Odometry, TruePose, evenly_spaced

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
POSE = "geometry_msgs/msg/PoseStamped"
POSE_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
TRANSFORM = "geometry_msgs/msg/TransformStamped"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
# ROS 1's first name of it, the same on the wire.
OLD_TRANSFORMS = "tf/msg/tfMessage"

OMNIDIRECTIONAL = "omnidir"
"""What a ``CameraInfo`` calls Mei's model; its D is k1, k2, p1, p2, xi and, where known, the full view, degrees."""

# Far beyond any building: a corrupt number must not overflow in what follows.
_LARGEST = 1e9


@lru_cache
def standard_types(ros1: bool = False) -> "Typestore":
    """Definitions of the standard messages; built once, as that takes a tenth of a second."""
    from rosbags.typesys import Stores, get_typestore

    if not ros1:
        return get_typestore(Stores.ROS2_HUMBLE)
    store = get_typestore(Stores.ROS1_NOETIC)
    definition = standard_types().fielddefs[TRANSFORMS]
    store.register({TRANSFORMS: definition, OLD_TRANSFORMS: definition})
    return store


def message_decoder(ros1: bool) -> Callable[[RawMessage], Any]:
    """Make the function that deserializes a raw message; it may raise any exception on corrupt bytes."""
    deserialize = standard_types().deserialize_cdr if not ros1 else standard_types(ros1=True).deserialize_ros1
    return lambda raw: deserialize(raw.data, raw.message_type)


def stamp_of(header: Any) -> float:
    """Stamp of a message header, s."""
    return float(header.stamp.sec + header.stamp.nanosec * 1e-9)


def frame_name(name: str) -> str:
    """Name of a frame without the slash that old bags put before it."""
    return name.lstrip("/")


def scan_from(message: Any, mirrored: bool) -> LaserScan:
    """Turn a ``LaserScan`` message into a scan.

    Parameters
    ----------
    message
    mirrored : bool
        The lidar hangs upside down, so that its angles run clockwise seen from above: they are negated.

    Raises
    ------
    ScanError
        If its angles, stamps or limits are no numbers.
    """
    time_increment = message.time_increment
    if time_increment == 0.0 and message.scan_time > 0.0 and len(message.ranges):
        time_increment = message.scan_time / len(message.ranges)
    sign = -1.0 if mirrored else 1.0
    with np.errstate(all="ignore"):  # what is not finite is refused, or is a range that means "no return"
        return evenly_spaced(
            stamp_of(message.header),
            message.ranges,
            angle_min=sign * message.angle_min,
            angle_increment=sign * message.angle_increment,
            range_min=message.range_min,
            range_max=message.range_max,
            time_increment=time_increment,
        )


def odometry_from(message: Any, message_type: str) -> Odometry:
    """Turn an ``Odometry`` message, or any of the stamped poses, into an odometry reading.

    Raises
    ------
    ScanError
        If a value is not finite or the orientation is no rotation.
    """
    return Odometry(stamp_of(message.header), _planar_pose(message, message_type))


def truth_from(message: Any, message_type: str) -> TruePose:
    """Turn an ``Odometry`` message, or any of the stamped poses, into a true pose.

    Raises
    ------
    ScanError
        If a value is not finite or the orientation is no rotation.
    """
    return TruePose(stamp_of(message.header), _planar_pose(message, message_type))


def _planar_pose(message: Any, message_type: str) -> np.ndarray:
    if message_type == TRANSFORM:
        position, rotation = message.transform.translation, message.transform.rotation
    else:
        pose = message.pose if message_type == POSE else message.pose.pose
        position, rotation = pose.position, pose.orientation
    values = (position.x, position.y, heading_of(rotation))
    if not all(abs(value) < _LARGEST for value in values):
        raise ScanError("a pose that is not finite")
    return np.array(values)


def heading_of(rotation: Any) -> float:
    """Heading of a quaternion message, rad: where its x axis points in the plane.

    Raises
    ------
    ScanError
        If the quaternion is not of unit length.
    """
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    if not abs(x * x + y * y + z * z + w * w - 1.0) < 0.1:
        raise ScanError("an orientation that is no unit quaternion")
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
