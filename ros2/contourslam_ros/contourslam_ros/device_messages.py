"""What the robot's parts measure, as ROS messages."""

from array import array

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, CompressedImage
from sensor_msgs.msg import LaserScan as ScanMessage
from std_msgs.msg import Header

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import quaternion as quaternion_of
from contourslam.recordings.picture import Picture
from contourslam.recordings.ros_messages import OMNIDIRECTIONAL
from contourslam.scan import LaserScan
from contourslam_ros.messages import header

Floats = NDArray[np.float64]
_PLANE = np.ix_([0, 1, 5], [0, 1, 5])  # x, y and the turn about z in a covariance of six


def stamped(stamp: float, frame: str) -> Header:
    """Make a header for a time, s, that ROS can hold."""
    seconds, nanoseconds = divmod(round(stamp * 1e9), 1_000_000_000)
    return header(Time(sec=seconds, nanosec=nanoseconds), frame)


def place_message(parent: str, child: str, place: Floats) -> TransformStamped:
    """Make the transform to a part that sits at `place`, shape (4, 4), m; for /tf_static."""
    message = TransformStamped(header=header(Time(), parent), child_frame_id=child)
    x, y, z = place[:3, 3].tolist()
    message.transform.translation = Vector3(x=x, y=y, z=z)
    x, y, z, w = quaternion_of(place[:3, :3])
    message.transform.rotation = Quaternion(x=x, y=y, z=z, w=w)
    return message


def scan_message(scan: LaserScan, frame: str) -> ScanMessage:
    """Make a scan out of one whose beams are evenly spaced in angle and time (``even_beams``)."""
    count = scan.ranges.size
    turned = np.unwrap(scan.angles)
    angle, time = (float(v[-1] - v[0]) / max(count - 1, 1) if count else 0.0 for v in (turned, scan.offsets))
    message = ScanMessage(header=stamped(scan.stamp + (float(scan.offsets[0]) if count else 0.0), frame))
    message.angle_min = float(turned[0]) if count else 0.0
    message.angle_max = message.angle_min + angle * max(count - 1, 0)
    message.angle_increment, message.time_increment, message.scan_time = angle, time, abs(time) * count
    message.range_min, message.range_max = scan.range_min, scan.range_max
    message.ranges = array("f", scan.ranges.astype(np.float32).tobytes())
    return message


def picture_message(picture: Picture, frame: str) -> CompressedImage:
    """Make a picture."""
    data = array("B")
    data.frombytes(picture.data)  # copied at once, where a list would be checked byte by byte
    return CompressedImage(header=stamped(picture.stamp, frame), format=picture.encoding, data=data)


def camera_info_message(stamp: float, model: FisheyeModel, frame: str) -> CameraInfo:
    """Make the model of a camera: D is k1, k2, p1, p2, xi and the field of view, degrees."""
    message = CameraInfo(header=stamped(stamp, frame), width=model.width, height=model.height)
    message.distortion_model = OMNIDIRECTIONAL
    message.d = [*model.distortion.tolist(), model.xi, model.field_of_view_deg]
    message.k, message.r = model.matrix.ravel(), np.eye(3).ravel()
    message.p = np.column_stack([model.matrix, np.zeros(3)]).ravel()
    return message
