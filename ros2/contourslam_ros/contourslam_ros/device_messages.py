"""What the robot's parts measure, as ROS messages."""

from array import array

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from sensor_msgs.msg import LaserScan as ScanMessage

from contourslam.scan import LaserScan
from contourslam_ros.messages import header


def time_message(stamp: float) -> Time:
    """Make a stamp, s, one that ROS can hold."""
    seconds, nanoseconds = divmod(round(stamp * 1e9), 1_000_000_000)
    return Time(sec=seconds, nanosec=nanoseconds)


def scan_message(scan: LaserScan, frame: str) -> ScanMessage:
    """Make a scan out of one whose beams are evenly spaced in angle and time (``even_beams``)."""
    count = scan.ranges.size
    turned = np.unwrap(scan.angles)
    angle, time = (float(v[-1] - v[0]) / max(count - 1, 1) if count else 0.0 for v in (turned, scan.offsets))
    first = float(scan.offsets[0]) if count else 0.0
    message = ScanMessage(header=header(time_message(scan.stamp + first), frame))
    message.angle_min = float(turned[0]) if count else 0.0
    message.angle_max = message.angle_min + angle * max(count - 1, 0)
    message.angle_increment, message.time_increment, message.scan_time = angle, time, time * count
    message.range_min, message.range_max = scan.range_min, scan.range_max
    message.ranges = array("f", scan.ranges.astype(np.float32).tobytes())
    return message


def place_message(
    parent: str, child: str, place: tuple[float, float, float], turn: tuple[float, float, float, float]
) -> TransformStamped:
    """Make the transform to a part that sits at `place` (m), turned by the quaternion x, y, z, w; for /tf_static."""
    message = TransformStamped(header=header(Time(), parent), child_frame_id=child)
    message.transform.translation = Vector3(x=place[0], y=place[1], z=place[2])
    message.transform.rotation = Quaternion(x=turn[0], y=turn[1], z=turn[2], w=turn[3])
    return message
