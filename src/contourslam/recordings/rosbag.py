"""Bags of ROS 1 and ROS 2: which of their topics are used, and their messages as values."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import Any

from contourslam.errors import RecordingError, ScanError
from contourslam.recordings.bag_pictures import BagPictures
from contourslam.recordings.bag_wheels import read_wheels
from contourslam.recordings.base_readings import WheelReading
from contourslam.recordings.mount import FrameTree, Mount
from contourslam.recordings.picture import Picture
from contourslam.recordings.recording import Camera, Message, Recording, SkipCount, Topic
from contourslam.recordings.ros_messages import (
    ODOMETRY,
    TRANSFORM,
    frame_name,
    message_decoder,
    odometry_from,
    scan_from,
    truth_from,
)
from contourslam.recordings.salvage import RawMessage
from contourslam.recordings.storage import Read, open_storage
from contourslam.recordings.topic_choice import TF_TYPES, choose_odometry, choose_scan, choose_truth, no_odometry

# The transforms of a robot come many times a second: what is not among the first is not there.
_TF_MESSAGES = 500
_BASES = ("base_link", "base_footprint")


class BagRecording(Recording):
    """A rosbag1 file, a rosbag2 folder, or a lone ``.mcap`` or ``.db3`` file.

    Messages come in the order of recording; in a bag whose index is damaged, in the order of the file. The lidar's
    place is read from the static transforms. A lidar that hangs upside down is turned over: its angles are negated.

    Parameters
    ----------
    path : Path
    scan_topic, odometry_topic, truth_topic : str or None
        Topics to use. By default the only one of its type, or the usual name among several (``/scan``, ``/odom``,
        ``/ground_truth``); without an odometry topic, the transform from odom to the base in ``/tf``.

    Raises
    ------
    RecordingError
        If it cannot be read, is no bag, or lacks scans or odometry (the message lists its topics).
    """

    def __init__(self, path: Path, scan_topic: str | None, odometry_topic: str | None, truth_topic: str | None) -> None:
        super().__init__(path)
        self._storage = open_storage(path)
        topics = self._storage.topics
        self._scan_topic = choose_scan(path, topics, scan_topic)
        self._truth_topic = choose_truth(path, topics, truth_topic)
        self._odometry_frames = ("", "")
        self._decode = message_decoder(self._storage.ros1)
        self._types = {topic.name: topic.message_type for topic in topics}
        odometry = choose_odometry(path, topics, odometry_topic)
        with self._storage.session() as read:
            if odometry is None or self._types[odometry] in TF_TYPES:
                odometry = odometry or "/tf"
                self._odometry_frames = self._find_odometry_transform(read, odometry)
                if not self._odometry_frames[1]:
                    if odometry_topic is not None:
                        raise no_odometry(path, topics)
                    self.notes.append(f"{no_odometry(path, topics)}; the scans alone must do")
                    odometry = ""
            self._odometry_topic = odometry
            self._base = self._base_frame(read)
            mount = self._find_mount(read)
        self._pictures = BagPictures(self._storage)
        self.skipped_pictures = self._pictures.skipped
        self._mirrored = mount is not None and mount.mirrored
        if mount is None:
            self.notes.append("no transform says where the lidar sits on the robot")
        else:
            self.lidar_mount, self.T_base_lidar = mount.pose, mount.matrix
        if self._mirrored:
            self.notes.append("the lidar hangs upside down: its angles are negated")

    def topics(self) -> list[Topic]:
        """List the topics."""
        return list(self._storage.topics)

    def pictures(self, topic: str | None = None) -> Iterator[Picture]:
        """See :meth:`Recording.pictures`."""
        return self._pictures.read(topic)

    def wheel_readings(self) -> Iterator[WheelReading]:
        """See :meth:`Recording.wheel_readings`."""
        return read_wheels(self._storage, self.skipped_wheels)

    def camera(self, topic: str | None = None) -> Camera | None:
        """See :meth:`Recording.camera`."""
        return self._pictures.camera(self._base, topic)

    @property
    def start(self) -> float | None:
        """Time at which the first message was recorded, s."""
        return self._storage.start

    @property
    def end(self) -> float | None:
        """Time at which the last message was recorded, s."""
        return self._storage.end

    def messages(self) -> Iterator[Message]:
        """Yield scans, odometry and true poses; a message that cannot be used is skipped and counted.

        Raises
        ------
        RecordingError
            Where the bag is damaged, after everything before; the message names the number of the last good message.
            Also at the end if no scan could be used.
        """
        skip = SkipCount(self.skipped)
        converters: dict[str, Callable[[RawMessage, Any], Iterator[Message]]] = {
            self._scan_topic: self._scan,
            self._odometry_topic: self._odometry,
        }
        if self._truth_topic is not None:
            converters[self._truth_topic] = self._truth
        scans = 0
        with self._storage.session() as read:
            for number, raw in enumerate(read(converters), start=1):
                try:
                    message = self._decode(raw)
                except Exception:  # corrupt bytes fail in as many ways as the deserializer has steps
                    skip.add(f"{raw.topic}: a message that is corrupt", f"message {number}")
                    continue
                try:
                    for value in converters[raw.topic](raw, message):
                        yield value
                        scans += raw.topic == self._scan_topic
                except ScanError as error:
                    why = str(error).partition(": ")[2] or str(error)
                    skip.add(f"{raw.topic}: {why}", f"message {number}")
        if not scans:
            skipped = "; ".join(f"{reason}: {count}" for reason, count in self.skipped.items()) or "none is there"
            raise RecordingError(f"{self.path}: no usable scan on {self._scan_topic}: {skipped}")

    def _scan(self, raw: RawMessage, message: Any) -> Iterator[Message]:
        yield scan_from(message, self._mirrored)

    def _odometry(self, raw: RawMessage, message: Any) -> Iterator[Message]:
        if raw.message_type not in TF_TYPES:
            yield odometry_from(message, raw.message_type)
            return
        for stamped in message.transforms:
            if (frame_name(stamped.header.frame_id), frame_name(stamped.child_frame_id)) == self._odometry_frames:
                yield odometry_from(stamped, TRANSFORM)

    def _truth(self, raw: RawMessage, message: Any) -> Iterator[Message]:
        yield truth_from(message, raw.message_type)

    def _first(self, read: Read, topic: str, count: int | None = 1) -> Iterator[Any]:
        """Deserialize the first messages of a topic, as far as they can be read; messages() tells of the damage."""
        with suppress(RecordingError):
            for raw in islice(read((topic,)), count):
                with suppress(Exception):
                    yield self._decode(raw)

    def _find_odometry_transform(self, read: Read, topic: str) -> tuple[str, str]:
        """Parent and child frame of the odometry in ``/tf``; empty names if it is not there."""
        for message in self._first(read, topic, _TF_MESSAGES):
            for stamped in message.transforms:
                parent, child = frame_name(stamped.header.frame_id), frame_name(stamped.child_frame_id)
                if "odom" in parent.lower() and child.rpartition("/")[2] in _BASES:
                    return parent, child
        return "", ""

    def _base_frame(self, read: Read) -> str:
        """Frame of the base that the odometry speaks of; empty where it names none."""
        if self._types.get(self._odometry_topic) == ODOMETRY:
            return next((str(m.child_frame_id) for m in self._first(read, self._odometry_topic)), "")
        return self._odometry_frames[1]

    def _find_mount(self, read: Read) -> Mount | None:
        lidar_frame = next((m.header.frame_id for m in self._first(read, self._scan_topic)), None)
        if lidar_frame is None:
            return None
        tree = FrameTree()
        for topic, count in (("/tf_static", None), ("/tf", _TF_MESSAGES)):
            for message in self._first(read, topic, count):
                tree.add(message.transforms)
            if mount := tree.mount(lidar_frame, self._base):
                return mount
        return None
