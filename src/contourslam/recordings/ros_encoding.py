"""Scans, odometry, true poses and pictures turned into ROS 2 messages."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from contourslam.errors import RecordingError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import from_planar, quaternion
from contourslam.recordings.base_readings import InertialReading, WheelReading
from contourslam.recordings.picture import Picture
from contourslam.recordings.ros_messages import OMNIDIRECTIONAL, standard_types
from contourslam.scan import LaserScan

# What single precision and a lidar's own resolution leave of an angle, rad, and a generous bound for a beam's time, s.
_EVEN_ANGLE = 1e-4
_EVEN_TIME = 1e-4


class Encoder:
    """Builds standard messages (definitions of ROS 2 Humble; later ones are the same on the wire)."""

    def __init__(self) -> None:
        self.store = standard_types()
        self._types = self.store.types

    def serialize(self, message: Any) -> bytes:
        """Serialize a message as CDR."""
        return bytes(self.store.serialize_cdr(message, message.__msgtype__))

    def _make(self, name: str, /, **fields: Any) -> Any:
        return self._types[name](**fields)

    def header(self, stamp: float, frame: str) -> Any:
        """Build a header; the stamp keeps its nanoseconds."""
        seconds, nanoseconds = split_stamp(stamp)
        time = self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
        return self._make("std_msgs/msg/Header", stamp=time, frame_id=frame)

    def scan(self, scan: LaserScan, frame: str) -> Any:
        """Build a ``LaserScan`` message.

        Raises
        ------
        RecordingError
            If the beams are not evenly spaced in angle and time, which is all that the message can say.
        """
        angle_min, angle_increment = _even(np.unwrap(scan.angles), _EVEN_ANGLE, scan.stamp, "angle")
        first_offset, time_increment = _even(scan.offsets, _EVEN_TIME, scan.stamp, "time")
        count = scan.ranges.size
        with np.errstate(over="ignore", invalid="ignore"):  # a range beyond single precision becomes inf: no return
            ranges = scan.ranges.astype(np.float32)
        return self._make(
            "sensor_msgs/msg/LaserScan",
            header=self.header(scan.stamp + first_offset, frame),
            angle_min=angle_min,
            angle_max=angle_min + angle_increment * max(count - 1, 0),
            angle_increment=angle_increment,
            time_increment=time_increment,
            scan_time=abs(time_increment) * count,
            range_min=scan.range_min,
            range_max=scan.range_max,
            ranges=ranges,
            intensities=np.empty(0, dtype=np.float32),
        )

    def odometry(self, stamp: float, pose: np.ndarray, frame: str, child: str) -> Any:
        """Build an ``Odometry`` message; covariance and speed are left at zero, which means unknown."""
        x, y, heading = map(float, pose)
        zero = self._make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        return self._make(
            "nav_msgs/msg/Odometry",
            header=self.header(stamp, frame),
            child_frame_id=child,
            pose=self._make(
                "geometry_msgs/msg/PoseWithCovariance",
                pose=self._make(
                    "geometry_msgs/msg/Pose",
                    position=self._make("geometry_msgs/msg/Point", x=x, y=y, z=0.0),
                    orientation=self._rotation(heading),
                ),
                covariance=np.zeros(36),
            ),
            twist=self._make(
                "geometry_msgs/msg/TwistWithCovariance",
                twist=self._make("geometry_msgs/msg/Twist", linear=zero, angular=zero),
                covariance=np.zeros(36),
            ),
        )

    def transform(self, stamp: float, pose: np.ndarray, frame: str, child: str) -> Any:
        """Build a ``TFMessage`` of one transform in the plane."""
        return self.transforms(stamp, frame, {child: from_planar(pose)})

    def transforms(self, stamp: float, frame: str, children: Mapping[str, np.ndarray]) -> Any:
        """Build a ``TFMessage`` of the places, shape (4, 4), of several frames in one."""
        made = []
        for child, matrix in children.items():
            x, y, z = map(float, matrix[:3, 3])
            qx, qy, qz, qw = quaternion(matrix[:3, :3])
            transform = self._make(
                "geometry_msgs/msg/Transform",
                translation=self._make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
                rotation=self._make("geometry_msgs/msg/Quaternion", x=qx, y=qy, z=qz, w=qw),
            )
            header = self.header(stamp, frame)
            made.append(
                self._make(
                    "geometry_msgs/msg/TransformStamped", header=header, child_frame_id=child, transform=transform
                )
            )
        return self._make("tf2_msgs/msg/TFMessage", transforms=made)

    def picture(self, picture: Picture, frame: str) -> Any:
        """Build a ``CompressedImage`` message."""
        return self._make(
            "sensor_msgs/msg/CompressedImage",
            header=self.header(picture.stamp, frame),
            format=picture.encoding,
            data=np.frombuffer(picture.data, dtype=np.uint8),
        )

    def camera_info(self, stamp: float, model: FisheyeModel, frame: str) -> Any:
        """Build a ``CameraInfo`` message of the distortion model ``omnidir``."""
        region = self._make(
            "sensor_msgs/msg/RegionOfInterest", x_offset=0, y_offset=0, height=0, width=0, do_rectify=False
        )
        return self._make(
            "sensor_msgs/msg/CameraInfo",
            header=self.header(stamp, frame),
            height=model.height,
            width=model.width,
            distortion_model=OMNIDIRECTIONAL,
            d=np.array([*model.distortion, model.xi, model.field_of_view_deg]),
            k=model.matrix.ravel(),
            r=np.eye(3).ravel(),
            p=np.column_stack([model.matrix, np.zeros(3)]).ravel(),
            binning_x=0,
            binning_y=0,
            roi=region,
        )

    def wheels(self, reading: WheelReading, frame: str) -> Any:
        """Build a ``JointState`` message."""
        return self._make(
            "sensor_msgs/msg/JointState",
            header=self.header(reading.stamp, frame),
            name=["left_wheel", "right_wheel"],
            position=np.array(reading.angles),
            velocity=np.array(reading.speeds),
            effort=np.empty(0),
        )

    def inertial(self, reading: InertialReading, frame: str) -> Any:
        """Build an ``Imu`` message, which says that it knows no orientation."""
        unknown = np.zeros(9)
        return self._make(
            "sensor_msgs/msg/Imu",
            header=self.header(reading.stamp, frame),
            orientation=self._rotation(0.0),
            orientation_covariance=np.array([-1.0, *unknown[1:]]),
            angular_velocity=self._vector(reading.gyro),
            angular_velocity_covariance=unknown,
            linear_acceleration=self._vector(reading.acceleration),
            linear_acceleration_covariance=unknown,
        )

    def _vector(self, values: tuple[float, float, float]) -> Any:
        return self._make("geometry_msgs/msg/Vector3", **dict(zip("xyz", map(float, values), strict=True)))

    def _rotation(self, heading: float) -> Any:
        half = 0.5 * heading
        return self._make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(half), w=math.cos(half))


def split_stamp(stamp: float) -> tuple[int, int]:
    """Split a stamp into the seconds and nanoseconds that ROS can hold.

    Raises
    ------
    RecordingError
        If it lies before 0 or after the year 2038.
    """
    if not 0.0 <= stamp < 2.0**31 - 1:
        raise RecordingError(f"a message at stamp {stamp} s cannot be recorded: ROS stamps run from 0 to 2**31 - 2")
    seconds = math.floor(stamp)
    nanoseconds = round((stamp - seconds) * 1e9)
    return seconds + nanoseconds // 10**9, nanoseconds % 10**9


def _even(values: np.ndarray, tolerance: float, stamp: float, what: str) -> tuple[float, float]:
    """First value and step of evenly spaced values."""
    if values.size == 0:
        return 0.0, 0.0
    first = float(values[0])
    step = float(values[-1] - values[0]) / max(values.size - 1, 1)
    if np.abs(values - (first + step * np.arange(values.size))).max() > tolerance:
        raise RecordingError(
            f"the scan at stamp {stamp} s cannot be recorded: its beams are not evenly spaced in {what}"
        )
    return first, step
