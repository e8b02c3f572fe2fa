"""The pictures of a bag, and the camera that took them."""

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError, RecordingError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.nearest import perhaps
from contourslam.recordings.mount import FrameTree
from contourslam.recordings.picture import Picture, encoding_of
from contourslam.recordings.png import encode_png
from contourslam.recordings.recording import Camera, SkipCount
from contourslam.recordings.ros_messages import OMNIDIRECTIONAL, message_decoder, stamp_of
from contourslam.recordings.storage import Storage, open_storage
from contourslam.recordings.text import first_bytes

COMPRESSED, RAW, CAMERA_INFO = (f"sensor_msgs/msg/{name}" for name in ("CompressedImage", "Image", "CameraInfo"))

_PREFERRED = "/camera/image/compressed"
_TF_MESSAGES = 500
# Channels of a raw picture, and which of them are red, green and blue.
_LAYOUTS: dict[str, tuple[int, list[int]]] = {
    "mono8": (1, [0]), "8UC1": (1, [0]), "rgb8": (3, [0, 1, 2]), "bgr8": (3, [2, 1, 0]), "8UC3": (3, [2, 1, 0]),
    "rgba8": (4, [0, 1, 2]), "bgra8": (4, [2, 1, 0]),
}  # fmt: skip


class BagPictures:
    """Reads the pictures of a bag; the bag need hold nothing else.

    Parameters
    ----------
    storage : Storage

    Attributes
    ----------
    skipped : dict of str to int
        Pictures that could not be used in the latest pass: the reason, with the place of the first, and how many.
    """

    def __init__(self, storage: Storage) -> None:
        self._storage = storage
        self._decode = message_decoder(storage.ros1)
        self._types = {topic.name: topic.message_type for topic in storage.topics}
        self.skipped: dict[str, int] = {}

    def topics(self) -> list[str]:
        """Name the topics of pictures."""
        return [name for name, kind in self._types.items() if kind in (COMPRESSED, RAW)]

    def read(self, topic: str | None = None) -> Iterator[Picture]:
        """Yield the pictures of a topic; see :meth:`Recording.pictures`."""
        name = self._choose(topic)
        if name is None:
            self.skipped.clear()
            return
        skip = SkipCount(self.skipped)
        convert: Callable[[Any], Picture] = _from_compressed if self._types[name] == COMPRESSED else _from_raw
        with self._storage.session() as read:
            for number, raw in enumerate(read((name,)), start=1):
                try:
                    message = self._decode(raw)
                except Exception:  # corrupt bytes fail in as many ways as the deserializer has steps
                    skip.add(f"{name}: a message that is corrupt", f"message {number}")
                    continue
                try:
                    yield convert(message)
                except RecordingError as error:
                    skip.add(f"{name}: {str(error).removeprefix('a picture: ')}", f"message {number}")

    def camera(self, base: str, topic: str | None = None) -> Camera | None:
        """Find the model of the camera and its place on the robot; see :meth:`Recording.camera`."""
        with suppress(RecordingError):
            name = self._choose(topic)
            if name is None:
                return None
            spaces = [name.rsplit("/", depth)[0] + "/camera_info" for depth in (1, 2)]
            infos = [space for space in spaces if self._types.get(space) == CAMERA_INFO]
            infos = infos or [topic for topic, kind in self._types.items() if kind == CAMERA_INFO][:1]
            for info in infos:
                message = next(self._first(info, 1), None)
                model = None if message is None else model_from(message)
                if message is None or model is None:
                    continue
                place = self._place(base, message.header.frame_id)
                return None if place is None else (model, place)
        return None

    def _place(self, base: str, frame: str) -> NDArray[np.float64] | None:
        tree = FrameTree()
        for topic, count in (("/tf_static", None), ("/tf", _TF_MESSAGES)):
            for message in self._first(topic, count):
                tree.add(message.transforms)
            if (found := tree.from_base(frame, base)) is not None:
                return found[1]
        return None

    def _first(self, topic: str, count: int | None) -> Iterator[Any]:
        with suppress(RecordingError), self._storage.session() as read:
            for raw in islice(read((topic,)), count):
                with suppress(Exception):
                    yield self._decode(raw)

    def _choose(self, wanted: str | None) -> str | None:
        topics = self.topics()
        listed = ", ".join(topics) or "none"
        if wanted is not None:
            for name in topics:
                if name.lstrip("/") == wanted.lstrip("/"):
                    return name
            near = perhaps(wanted, topics)
            raise RecordingError(
                f"{self._storage.path}: has no pictures on {wanted}{near}; topics of pictures: {listed}"
            )
        if len(topics) < 2:
            return topics[0] if topics else None
        if _PREFERRED in topics:
            return _PREFERRED
        raise RecordingError(f"{self._storage.path}: several topics hold pictures, name one of them: {listed}")


def open_pictures(path: str | Path) -> BagPictures:
    """Open a bag for its pictures alone; it need hold no scans.

    Raises
    ------
    RecordingError
        If it cannot be read, is no bag, or holds no pictures.
    """
    path = Path(path)
    if not path.is_dir():
        first_bytes(path, 16)
    pictures = BagPictures(open_storage(path))
    if not pictures.topics():
        raise RecordingError(f"{path}: holds no pictures ({COMPRESSED} or {RAW})")
    return pictures


def model_from(message: Any) -> FisheyeModel | None:
    """Turn a ``CameraInfo`` message into a fisheye model; None where it is of another kind or makes no sense."""
    old = hasattr(message, "K")  # ROS 1 has capitals
    distortion = np.asarray(message.D if old else message.d)
    matrix = np.asarray(message.K if old else message.k).reshape(3, 3)
    if message.distortion_model != OMNIDIRECTIONAL or len(distortion) not in (5, 6):
        return None
    k1, k2, p1, p2, xi, *view = (float(value) for value in distortion)
    try:
        return FisheyeModel(
            int(message.width), int(message.height), xi, float(matrix[0, 0]), float(matrix[1, 1]),
            float(matrix[0, 1]), float(matrix[0, 2]), float(matrix[1, 2]), k1, k2, p1, p2, *view,
        )  # fmt: skip
    except ConfigError:
        return None


def _from_compressed(message: Any) -> Picture:
    data = bytes(message.data)
    encoding = encoding_of(data)
    if encoding is None:
        raise RecordingError(f"a picture: {message.format!r} that is neither JPEG nor PNG")
    return Picture(stamp_of(message.header), data, encoding)


def _from_raw(message: Any) -> Picture:
    if message.encoding not in _LAYOUTS:
        raise RecordingError(f"a picture: pixels of kind {message.encoding!r}, of which nothing is made")
    channels, colours = _LAYOUTS[message.encoding]
    height, width, step = int(message.height), int(message.width), int(message.step)
    data = np.asarray(message.data, dtype=np.uint8)
    if min(height, width) < 1 or step < width * channels or data.size < height * step:
        raise RecordingError("a picture: fewer bytes than its size says")
    pixels = data[: height * step].reshape(height, step)[:, : width * channels].reshape(height, width, channels)
    chosen = pixels[:, :, 0] if channels == 1 else pixels[:, :, colours]
    stamp = stamp_of(message.header)
    if not math.isfinite(stamp):
        raise RecordingError("a picture: its stamp is not finite")
    return Picture(stamp, encode_png(chosen), "png")
