"""What the parts' nodes publish is what a recording of the same would hold."""

import math
from typing import Any

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from tf2_msgs.msg import TFMessage

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import rigid, rotation_from_vector
from contourslam.recordings.base_readings import WheelReading
from contourslam.recordings.picture import Picture
from contourslam.recordings.ros_encoding import Encoder
from contourslam.scan import LaserScan
from contourslam_ros.device_messages import (
    camera_info_message,
    picture_message,
    place_message,
    scan_message,
    wheels_message,
)

STAMP = 1_795_350_000.123456
LENS = FisheyeModel(640, 480, 1.6, 310.0, 311.0, 0.2, 320.5, 239.5, -0.1, 0.02, 1e-3, -2e-3, 220.0)


def falling_scan() -> LaserScan:
    angles = np.deg2rad(170.0) - np.arange(360) * np.deg2rad(1.0)
    ranges = np.where(np.arange(360) % 7 == 0, math.nan, np.linspace(0.2, 9.0, 360))
    return LaserScan(STAMP, angles, ranges, np.linspace(0.0, 0.14, 360), 0.12, 10.0)


def same(published: Any, kept: Any) -> bool:
    """Whether a listener cannot tell one from the other; by their texts, for NaN is no other NaN."""
    sent = (serialize_message(published), Encoder().serialize(kept))  # the two differ in what pads them
    ours, theirs = (str(deserialize_message(data, type(published))) for data in sent)
    return ours == theirs


@pytest.mark.parametrize(
    ("published", "kept"),
    [
        (scan_message(falling_scan(), "laser"), Encoder().scan(falling_scan(), "laser")),
        (
            picture_message(Picture(STAMP, b"\xff\xd8\xff\x00\x01\xff\xd9", "jpeg"), "lens"),
            Encoder().picture(Picture(STAMP, b"\xff\xd8\xff\x00\x01\xff\xd9", "jpeg"), "lens"),
        ),
        (camera_info_message(STAMP, LENS, "lens"), Encoder().camera_info(STAMP, LENS, "lens")),
        (
            wheels_message(WheelReading(STAMP, (1.0, -2.0), (0.1, 0.2))),
            Encoder().wheels(WheelReading(STAMP, (1.0, -2.0), (0.1, 0.2)), ""),
        ),
    ],
    ids=["scan", "picture", "camera_info", "wheels"],
)
def test_a_message_is_that_of_a_recording(published: Any, kept: Any) -> None:
    assert same(published, kept)


def test_a_place_keeps_its_rotation() -> None:
    place = rigid(rotation_from_vector([0.3, -1.0, 2.0]), [0.1, 0.2, 0.3])
    message = TFMessage(transforms=[place_message("base_link", "lens", place)])
    assert same(message, Encoder().transforms(0.0, "base_link", {"lens": place}))
