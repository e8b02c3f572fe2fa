"""What the base measured is kept in a recording and comes back."""

import math
from pathlib import Path

import numpy as np
import pytest

from contourslam.errors import RecordingError
from contourslam.recordings import InertialReading, RecordingWriter, WheelReading, open_recording
from contourslam.recordings.storage import open_storage
from contourslam.scan import LaserScan, Odometry


def a_scan(stamp: float) -> LaserScan:
    angles = np.linspace(-3.0, 3.0, 50)
    return LaserScan(stamp, angles, np.full(50, 2.0), np.zeros(50), 0.1, 10.0)


def test_wheels_come_back_as_they_were_written(tmp_path: Path) -> None:
    wheels = [WheelReading(10.0 + k, (0.1 * k, -0.2 * k), (1.5, -2.5)) for k in range(5)]
    with RecordingWriter(tmp_path / "drive") as writer:
        for reading in wheels:
            writer.write(reading)
            writer.write(InertialReading(reading.stamp, (0.0, 0.01, 0.5), (0.1, 0.2, 9.81)))
            writer.write(Odometry(reading.stamp, np.zeros(3)))
        writer.write(a_scan(15.0))
    recording = open_recording(tmp_path / "drive")
    assert list(recording.wheel_readings()) == wheels == list(recording.wheel_readings())
    assert len(list(recording.messages())) == 6 and recording.skipped_wheels == {}


def test_the_inertial_readings_are_standard_messages_of_unknown_orientation(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "drive") as writer:
        writer.write(InertialReading(1.0, (0.25, 0.5, -0.75), (1.0, 2.0, 9.5)))
    from contourslam.recordings.ros_messages import message_decoder

    storage = open_storage(tmp_path / "drive")
    with storage.session() as read:
        (message,) = map(message_decoder(storage.ros1), read(("/imu/data",)))
    rates = message.angular_velocity
    assert (rates.x, rates.y, rates.z) == (0.25, 0.5, -0.75)
    assert message.linear_acceleration.z == 9.5
    assert message.orientation_covariance[0] == -1.0  # which says so in ROS
    assert message.header.frame_id == "base_link"


def test_a_recording_without_wheels_has_none(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "drive") as writer:
        writer.write(Odometry(1.0, np.zeros(3)))
        writer.write(a_scan(1.0))
    assert list(open_recording(tmp_path / "drive").wheel_readings()) == []


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_what_is_not_finite_is_no_reading(value: float) -> None:
    with pytest.raises(RecordingError, match="finite"):
        WheelReading(1.0, (value, 0.0), (0.0, 0.0))
    with pytest.raises(RecordingError, match="finite"):
        InertialReading(1.0, (0.0, 0.0, 0.0), (0.0, 0.0, value))
