"""Pictures and their camera come back from a recording as they were put into it."""

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.errors import RecordingError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import from_planar, rigid, rotation_from_vector
from contourslam.recordings import Message, Picture, RecordingWriter, open_recording, write_recording
from contourslam.recordings.bag_pictures import open_pictures
from contourslam.recordings.png import encode_png
from contourslam.recordings.ros_encoding import Encoder

Entry = tuple[str, float, Any]
BagMaker = Callable[[str, Path, Iterator[Entry]], Path]
Drain = Callable[[Iterator[Any]], tuple[list[Any], RecordingError | None]]

MODEL = FisheyeModel(640, 480, 1.6, 310.0, 309.0, 0.2, 320.5, 239.0, -0.02, 0.004, 6e-4, -4e-4, 210.0)
PLACE = rigid(rotation_from_vector((1.1, -1.3, 0.9)), (0.05, -0.02, 0.31))


def pixels(seed: int = 0, shape: tuple[int, ...] = (24, 32, 3)) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)


def a_picture(stamp: float, seed: int = 0) -> Picture:
    return Picture(stamp, encode_png(pixels(seed)), "png")


def raw_image(encoder: Encoder, values: np.ndarray, encoding: str, padding: int = 0, cut: int = 0) -> Any:
    rows = values.reshape(values.shape[0], -1)
    rows = np.hstack([rows, np.zeros((len(rows), padding), np.uint8)])
    return encoder.store.types["sensor_msgs/msg/Image"](
        header=encoder.header(7.5, "camera"), height=values.shape[0], width=values.shape[1], encoding=encoding,
        is_bigendian=0, step=rows.shape[1], data=rows.ravel()[: rows.size - cut],
    )  # fmt: skip


def decoded(picture: Picture) -> np.ndarray:
    pillow = pytest.importorskip("PIL.Image")
    return np.asarray(pillow.open(io.BytesIO(picture.data)))


def test_pictures_and_their_camera_come_back(tmp_path: Path, messages: list[Message]) -> None:
    pictures = [a_picture(100.0 + 0.5 * i, i) for i in range(5)]
    mixed = sorted([*messages, *pictures], key=lambda message: message.stamp)
    lidar = rigid(rotation_from_vector((0.01, 0.02, 0.5)), (0.1, 0.0, 0.18))
    write_recording(tmp_path / "run", mixed, lidar_mount=lidar, camera=(MODEL, PLACE))
    recording = open_recording(tmp_path / "run")
    for _ in range(2):  # each call is a new pass
        assert list(recording.pictures()) == pictures
    assert recording.skipped_pictures == {}
    assert len(list(recording.messages())) == len(messages)
    assert recording.camera() is not None and recording.T_base_lidar is not None
    model, place = recording.camera()
    assert model == MODEL
    np.testing.assert_allclose(place, PLACE, atol=1e-12)
    np.testing.assert_allclose(recording.T_base_lidar, lidar, atol=1e-12)
    counts = {topic.name: topic.count for topic in recording.topics()}
    assert (counts["/camera/image/compressed"], counts["/camera/camera_info"], counts["/tf_static"]) == (5, 5, 1)


def test_a_recording_without_pictures_or_camera_says_so(tmp_path: Path, messages: list[Message]) -> None:
    write_recording(tmp_path / "run", messages, lidar_mount=(0.2, 0.0, 0.1))
    recording = open_recording(tmp_path / "run")
    assert list(recording.pictures()) == [] and recording.camera() is None
    np.testing.assert_allclose(recording.T_base_lidar, from_planar((0.2, 0.0, 0.1)), atol=1e-12)
    with pytest.raises(RecordingError, match="holds no pictures"):
        open_pictures(tmp_path / "run")
    with pytest.raises(RecordingError, match="has no pictures on /top; topics of pictures: none"):
        list(recording.pictures("/top"))


def test_a_recording_may_hold_pictures_alone(tmp_path: Path) -> None:
    write_recording(tmp_path / "run", [a_picture(1.0)], camera=(MODEL, PLACE))
    pictures = open_pictures(tmp_path / "run")
    assert list(pictures.read()) == [a_picture(1.0)]
    camera = pictures.camera("base_link")
    assert camera is not None and camera[0] == MODEL


@pytest.mark.parametrize("kind", ["bag1", "mcap", "sqlite3"])
@pytest.mark.parametrize(
    ("encoding", "channels"), [("rgb8", [0, 1, 2]), ("bgr8", [2, 1, 0]), ("rgba8", [0, 1, 2]), ("mono8", None)]
)
def test_raw_pictures_are_read_in_their_own_colours(
    tmp_path: Path, encoder: Encoder, make_bag: BagMaker, kind: str, encoding: str, channels: list[int] | None
) -> None:
    depth = {"mono8": (), "rgba8": (4,)}.get(encoding, (3,))
    values = pixels(1, (13, 17, *depth))
    info = encoder.camera_info(7.5, MODEL, "camera")
    tf = encoder.transforms(7.5, "base_link", {"camera": PLACE})
    entries = [
        ("/tf_static", 7.0, tf), ("/camera_info", 7.2, info),
        ("/image_raw", 7.5, raw_image(encoder, values, encoding, padding=3)),
    ]  # fmt: skip
    pictures = open_pictures(make_bag(kind, tmp_path, iter(entries)))
    (picture,) = pictures.read()
    assert (picture.stamp, picture.encoding) == (7.5, "png")
    np.testing.assert_array_equal(decoded(picture), values if channels is None else values[:, :, channels])
    camera = pictures.camera("base_link")
    assert camera is not None and camera[0] == MODEL


def test_damaged_pictures_are_skipped_and_counted(tmp_path: Path, encoder: Encoder, make_bag: BagMaker) -> None:
    good = encoder.picture(a_picture(1.0), "camera")
    cut = encoder.picture(a_picture(2.0), "camera")
    cut.data = cut.data[:-40]
    odd = encoder.picture(a_picture(3.0), "camera")
    odd.data, odd.format = np.zeros(100, np.uint8), "webp"
    topic = "/camera/image/compressed"
    entries = [(topic, 1.0, good), (topic, 2.0, cut), (topic, 3.0, odd), (topic, 4.0, cut), (topic, 5.0, good)]
    pictures = open_pictures(make_bag("mcap", tmp_path, iter(entries)))
    assert [picture.stamp for picture in pictures.read()] == [1.0, 1.0]
    assert pictures.skipped == {
        f"{topic}: its png data is cut short (first: message 2)": 2,
        f"{topic}: 'webp' that is neither JPEG nor PNG (first: message 3)": 1,
    }


@pytest.mark.parametrize(("encoding", "cut", "why"), [("rgb8", 1, "fewer bytes"), ("32FC1", 0, "of which nothing")])
def test_raw_pictures_of_no_use_are_skipped(
    tmp_path: Path, encoder: Encoder, make_bag: BagMaker, encoding: str, cut: int, why: str
) -> None:
    entries = [("/image_raw", 1.0, raw_image(encoder, pixels(), encoding, cut=cut))]
    pictures = open_pictures(make_bag("mcap", tmp_path, iter(entries)))
    assert list(pictures.read()) == []
    assert why in next(iter(pictures.skipped))


def test_among_several_cameras_the_user_is_asked(tmp_path: Path, encoder: Encoder, make_bag: BagMaker) -> None:
    message = encoder.picture(a_picture(1.0), "camera")
    entries = [("/front/compressed", 1.0, message), ("/rear/compressed", 1.0, message)]
    pictures = open_pictures(make_bag("mcap", tmp_path, iter(entries)))
    with pytest.raises(RecordingError, match=r"several topics hold pictures.*/front/compressed, /rear/compressed"):
        list(pictures.read())
    assert len(list(pictures.read("rear/compressed"))) == 1


def test_a_bag_that_is_cut_gives_the_pictures_before_the_cut(tmp_path: Path, drain: Drain) -> None:
    write_recording(tmp_path / "run", [a_picture(1.0 + i, i) for i in range(20)])
    whole = (tmp_path / "run" / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    try:
        taken, error = drain(open_pictures(tmp_path / "cut.mcap").read())
    except RecordingError as refused:  # one compressed chunk held them all
        taken, error = [], refused
    assert error is not None and "damaged" in str(error)
    assert taken == [a_picture(1.0 + i, i) for i in range(len(taken))]


@pytest.mark.parametrize(
    ("stamp", "data", "encoding", "why"),
    [
        (float("nan"), encode_png(pixels()), "png", "not finite"),
        (1.0, encode_png(pixels()), "jpeg", "does not start as jpeg"),
        (1.0, encode_png(pixels())[:-9], "png", "cut short"),
        (1.0, b"\xff\xd8\xff\xe0" + bytes(200), "jpeg", "cut short"),
        (1.0, b"GIF89a", "gif", "neither jpeg nor png"),
    ],
    ids=["stamp", "start", "cut-png", "cut-jpeg", "kind"],
)
def test_what_is_no_whole_picture_is_refused(stamp: float, data: bytes, encoding: Any, why: str) -> None:
    with pytest.raises(RecordingError, match=why):
        Picture(stamp, data, encoding)


def test_a_place_that_is_no_rigid_motion_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="camera_optical on the robot is no rigid motion"):
        RecordingWriter(tmp_path / "run", camera=(MODEL, 2.0 * np.eye(4)))
    assert not (tmp_path / "run").exists()
