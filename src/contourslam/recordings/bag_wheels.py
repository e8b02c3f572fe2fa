"""The angles of the wheels in a bag."""

from collections.abc import Iterator
from typing import Any

from contourslam.errors import RecordingError
from contourslam.recordings.base_readings import WheelReading
from contourslam.recordings.recording import SkipCount
from contourslam.recordings.ros_messages import message_decoder, stamp_of
from contourslam.recordings.storage import Storage

_JOINTS = "sensor_msgs/msg/JointState"


def read_wheels(storage: Storage, skipped: dict[str, int]) -> Iterator[WheelReading]:
    """Yield the wheels' readings of a bag; see :meth:`Recording.wheel_readings`.

    A joint whose name holds ``left`` and ``wheel`` is the left wheel, and so for the right one.
    """
    topics = [topic.name for topic in storage.topics if topic.message_type == _JOINTS]
    decode, skip = message_decoder(storage.ros1), SkipCount(skipped)
    if not topics:
        return
    with storage.session() as read:
        for number, raw in enumerate(read(topics), start=1):
            try:
                message = decode(raw)
            except Exception:  # corrupt bytes fail in as many ways as the deserializer has steps
                skip.add(f"{raw.topic}: a message that is corrupt", f"message {number}")
                continue
            try:
                reading = _wheels_from(message)
            except RecordingError as error:
                skip.add(f"{raw.topic}: {error}", f"message {number}")
                continue
            if reading is not None:
                yield reading


def _wheels_from(message: Any) -> WheelReading | None:
    """Give the wheels of a ``JointState`` message; None where they are not in it."""
    places = []
    for side in ("left", "right"):
        named = [k for k, name in enumerate(message.name) if side in name.lower() and "wheel" in name.lower()]
        if len(named) != 1 or named[0] >= len(message.position):
            return None
        places.append(named[0])
    left, right = places
    turning = len(message.velocity) == len(message.position)
    speeds = (float(message.velocity[left]), float(message.velocity[right])) if turning else (0.0, 0.0)
    angles = float(message.position[left]), float(message.position[right])
    return WheelReading(stamp_of(message.header), angles, speeds)
