"""What the robot's parts measure, as ROS messages."""

import math
from array import array

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Quaternion, TransformStamped, Vector3
from nav_msgs.msg import Odometry as OdometryMessage
from numpy.typing import NDArray
from sensor_msgs.msg import BatteryState, CameraInfo, CompressedImage, Imu, JointState, MagneticField
from sensor_msgs.msg import LaserScan as ScanMessage
from std_msgs.msg import Header

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import quaternion as quaternion_of
from contourslam.recordings.base_readings import InertialReading, WheelReading
from contourslam.recordings.picture import Picture
from contourslam.recordings.ros_encoding import split_stamp
from contourslam.recordings.ros_messages import OMNIDIRECTIONAL
from contourslam.robot.base.odometry import BaseOdometry
from contourslam.scan import LaserScan
from contourslam_ros.messages import header, quaternion

Floats = NDArray[np.float64]


def stamped(stamp: float, frame: str) -> Header:
    """Make a header for a time, s, that ROS can hold."""
    seconds, nanoseconds = split_stamp(stamp)
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


def odometry_message(odometry: BaseOdometry, frame: str, base: str) -> OdometryMessage:
    """Make the odometry with its covariances; those of what cannot move, z, roll and pitch, are zero."""
    message = OdometryMessage(header=stamped(odometry.stamp, frame), child_frame_id=base)
    x, y, heading = odometry.pose.tolist()
    message.pose.pose.position = Point(x=x, y=y)
    message.pose.pose.orientation = quaternion(heading)
    message.pose.covariance = _of_six([0, 1, 5], odometry.covariance)
    message.twist.twist.linear.x, message.twist.twist.angular.z = odometry.speed, odometry.turn_rate
    message.twist.covariance = _of_six([0, 5], odometry.twist_covariance)
    return message


def _of_six(rows: list[int], covariance: Floats) -> Floats:
    full = np.zeros((6, 6))
    full[np.ix_(rows, rows)] = covariance
    return full.ravel()


def imu_message(reading: InertialReading, frame: str, gyro_sigma: float, acceleration_sigma: float) -> Imu:
    """Make a message of the inertial sensors, which says that it knows no orientation.

    Parameters
    ----------
    reading : InertialReading
    frame : str
    gyro_sigma, acceleration_sigma : float
        Standard deviations, rad/s and m/s².
    """
    message = Imu(header=stamped(reading.stamp, frame))
    message.orientation_covariance[0] = -1.0
    message.angular_velocity, message.linear_acceleration = _vector(reading.gyro), _vector(reading.acceleration)
    message.angular_velocity_covariance = (gyro_sigma**2 * np.eye(3)).ravel()
    message.linear_acceleration_covariance = (acceleration_sigma**2 * np.eye(3)).ravel()
    return message


def field_message(stamp: float, compass: tuple[float, float, float], frame: str, sigma: float) -> MagneticField:
    """Make a message of the compass, T, with its standard deviation."""
    message = MagneticField(header=stamped(stamp, frame), magnetic_field=_vector(compass))
    message.magnetic_field_covariance = (sigma**2 * np.eye(3)).ravel()
    return message


def _vector(values: tuple[float, float, float]) -> Vector3:
    return Vector3(x=values[0], y=values[1], z=values[2])


def wheels_message(reading: WheelReading) -> JointState:
    """Make the angles of the two wheels."""
    return JointState(
        header=stamped(reading.stamp, ""),
        name=["left_wheel", "right_wheel"],
        position=reading.angles,
        velocity=reading.speeds,
    )


def battery_message(stamp: float, volts: float) -> BatteryState:
    """Make the state of a battery of which only the voltage is known."""
    unknown = math.nan
    return BatteryState(
        header=stamped(stamp, ""),
        voltage=volts,
        temperature=unknown,
        current=unknown,
        charge=unknown,
        capacity=unknown,
        design_capacity=unknown,
        percentage=unknown,
        power_supply_status=BatteryState.POWER_SUPPLY_STATUS_DISCHARGING,
        present=True,
    )
