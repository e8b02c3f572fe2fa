"""The node camera, over a folder of pictures that comes as fast as it was taken."""

import os
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from part_observer import PartObserver
from sensor_msgs.msg import CameraInfo, CompressedImage

from conftest import Processes
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.recordings.picture import Picture
from contourslam.recordings.png import encode_png
from contourslam.recordings.ros_messages import stamp_of
from contourslam.robot.config import CameraPart, RobotConfig, save_robot
from contourslam_ros.picture_size import picture_size

LENS = FisheyeModel(64, 48, 1.6, 31.0, 31.0, 0.0, 31.5, 23.5)
PERIOD, COUNT = 0.2, 40
START = 1_795_000_000.0


def picture(number: int, width: int = 64, height: int = 48) -> bytes:
    return encode_png(np.full((height, width, 3), number, dtype=np.uint8))


def folder(path: Path, width: int = 64) -> Path:
    path.mkdir()
    for number in range(COUNT):
        file = path / f"{number:03d}.png"
        file.write_bytes(picture(number, width))
        os.utime(file, (START + PERIOD * number,) * 2)
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, CameraPart]:
    there = tmp_path_factory.mktemp("robot")
    part = CameraPart(LENS, source=str(folder(there / "pictures")), x=0.05, z=0.3, pitch_deg=-90.0, yaw_deg=30.0)
    save_robot(there / "robot.yaml", RobotConfig(camera=part))
    return there / "robot.yaml", part


@pytest.fixture(scope="module")
def late(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder that is not there yet."""
    return tmp_path_factory.mktemp("late") / "pictures"


@pytest.fixture(scope="module")
def robot(files: tuple[Path, CameraPart], late: Path, parts: Processes, ros: None) -> Iterator[PartObserver]:
    observer = PartObserver("r1", camera__image__compressed=CompressedImage, camera__camera_info=CameraInfo)
    parts.start("camera", namespace="r1", frame_prefix="r1/", robot=files[0])
    wide = folder(late.with_name("wide"), 80)
    for name, source in (("wide", wide), ("late", late)):  # at the same time, for a node takes seconds to start
        parts.start("camera", namespace=f"r2/{name}", robot=files[0], source=source)
    assert observer.comes("camera__camera_info", 10), observer.faults()
    yield observer
    observer.close()


@pytest.fixture(scope="module")
def other(robot: PartObserver) -> Iterator[PartObserver]:
    """Two cameras on a second robot, one of which has pictures of another size."""
    topics = {f"{name}__camera__image__compressed": CompressedImage for name in ("wide", "late")}
    observer = PartObserver("r2", **topics)
    yield observer
    observer.close()


def test_pictures_come_as_they_are_with_their_stamps(robot: PartObserver) -> None:
    images = robot.messages("camera__image__compressed")
    assert len(images) >= 9
    for image in images:
        number = round((stamp_of(image.header) - START) / PERIOD)
        assert stamp_of(image.header) == pytest.approx(START + PERIOD * number, abs=1e-3)
        assert (image.format, image.header.frame_id) == ("png", "r1/camera_optical")
        assert bytes(image.data) == picture(number)
    came = np.array([when for when, _ in robot.heard["camera__image__compressed"]])
    assert np.diff(came).mean() > 0.25 * PERIOD  # as they were taken, not all at once; a busy machine catches up


def test_each_has_the_model_of_the_lens_stamped_alike(robot: PartObserver) -> None:
    images, infos = (set(robot.stamps(topic)) for topic in ("camera__image__compressed", "camera__camera_info"))
    assert len(images & infos) >= 9
    info = robot.messages("camera__camera_info")[-1]
    assert info.distortion_model == "omnidir"
    assert (info.width, info.height) == (64, 48)
    np.testing.assert_array_equal(np.array(info.k).reshape(3, 3), LENS.matrix)
    assert list(info.d) == [*LENS.distortion, LENS.xi, LENS.field_of_view_deg]


def test_the_camera_sits_where_the_robots_file_says(robot: PartObserver, files: tuple[Path, CameraPart]) -> None:
    place = robot.places["r1/camera_optical"].transform
    t, q = place.translation, place.rotation
    assert (t.x, t.y, t.z) == (0.05, 0.0, 0.3)
    # What comes out of the lens, its third axis, points straight up.
    out = [2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x), 1 - 2 * (q.x**2 + q.y**2)]
    np.testing.assert_allclose(out, files[1].T_base_camera[:3, 2], atol=1e-9)
    np.testing.assert_allclose(out, [0.0, 0.0, 1.0], atol=1e-9)


def test_all_is_told_well(robot: PartObserver) -> None:
    assert robot.is_well("camera: camera", since=time.monotonic())
    assert robot.latest("camera: camera").message.endswith(("pictures/s", "come to their end"))


def test_pictures_of_another_size_than_the_lens_was_calibrated_with_are_refused(other: PartObserver) -> None:
    assert other.hears("the pictures have 80 by 48 pixels", "calibrate"), other.faults()
    assert not other.comes("wide__camera__image__compressed", seconds=1.0)


def test_a_source_that_is_not_there_is_named_and_waited_for(other: PartObserver, late: Path) -> None:
    assert other.hears("there is no such file, folder or camera"), other.faults()
    folder(late)
    assert other.comes("late__camera__image__compressed", 3), other.faults()


def test_a_robot_without_a_camera_ends_the_node(parts: Processes) -> None:
    assert parts.start("camera", namespace="r3").wait(30.0) == 1


def test_the_size_of_a_picture_is_told_by_its_first_bytes() -> None:
    assert picture_size(Picture(0.0, picture(1, 80, 20), "png")) == (80, 20)
    segment = bytes.fromhex("ffd8ffe000104a46494600010101004800480000ffc0001108 01e0 0280 03".replace(" ", ""))
    assert picture_size(Picture(0.0, segment + b"\xff\xd9", "jpeg")) == (640, 480)
    assert picture_size(Picture(0.0, b"\xff\xd8\xff\xd9\x00\x00\xff\xd9", "jpeg")) is None
