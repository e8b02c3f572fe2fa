"""What every recording offers, whatever its format."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.display import card
from contourslam.errors import RecordingError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.recordings.base_readings import WheelReading
from contourslam.recordings.picture import Picture
from contourslam.scan import LaserScan, Odometry, TruePose

Message = LaserScan | Odometry | TruePose
Camera = tuple[FisheyeModel, NDArray[np.float64]]
"""A camera's model, and ``T_base_camera``, shape (4, 4), m."""


@dataclass(frozen=True, slots=True)
class Topic:
    """One stream of messages in a recording.

    Attributes
    ----------
    name : str
        Topic of a bag, or the keyword that starts the lines of a CARMEN log.
    message_type : str
        ROS message type, or what a CARMEN line holds.
    count : int
        Number of messages; in a damaged recording, of those that can be read.
    start, end : float or None
        First and last stamp, s, where they are cheap to know.
    """

    name: str
    message_type: str
    count: int
    start: float | None = None
    end: float | None = None


class Recording(ABC):
    """A recording that is read message by message, never whole into memory.

    Attributes
    ----------
    path : Path
        File or folder.
    lidar_mount : tuple of (float, float, float), or None
        x (m), y (m), yaw (rad) of the lidar in the base frame, where the recording says so.
    T_base_lidar : ndarray, shape (4, 4), or None
        The same place in space, m.
    skipped : dict of str to int
        Messages that could not be used in the latest pass of :meth:`messages`: the reason, with the place of the
        first, and how many.
    skipped_pictures : dict of str to int
        The same of the latest pass of :meth:`pictures`.
    skipped_wheels : dict of str to int
        The same of the latest pass of :meth:`wheel_readings`.
    notes : list of str
        What is worth knowing about the recording and changes nothing in how it is read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lidar_mount: tuple[float, float, float] | None = None
        self.T_base_lidar: NDArray[np.float64] | None = None
        self.skipped: dict[str, int] = {}
        self.skipped_pictures: dict[str, int] = {}
        self.skipped_wheels: dict[str, int] = {}
        self.notes: list[str] = []

    @abstractmethod
    def topics(self) -> list[Topic]:
        """List what is in the recording, used or not, by name."""

    @abstractmethod
    def messages(self) -> Iterator[Message]:
        """Yield scans, odometry and true poses in the order of the recording.

        Stamps may repeat or run backwards. Each call starts a new pass.

        Raises
        ------
        RecordingError
            Where the recording is damaged or cut short, after everything before the damage has been yielded.
        """

    def pictures(self, topic: str | None = None) -> Iterator[Picture]:
        """Yield the pictures in the order of the recording; a damaged one is skipped and counted.

        Each call starts a new pass.

        Parameters
        ----------
        topic : str, optional
            Where several topics hold pictures; by default the only one, or ``/camera/image/compressed``.

        Raises
        ------
        RecordingError
            If the choice of the topic is not clear, and where the recording is damaged or cut short.
        """
        return iter(())

    def wheel_readings(self) -> Iterator[WheelReading]:
        """Yield the angles of the wheels in the order of the recording, where it has any (``sensor_msgs/JointState``).

        One that cannot be used is skipped and counted. Each call starts a new pass.

        Raises
        ------
        RecordingError
            Where the recording is damaged or cut short.
        """
        return iter(())

    def camera(self, topic: str | None = None) -> Camera | None:
        """Give the model of the fisheye camera and its place ``T_base_camera`` (4, 4), where the recording says both.

        Parameters
        ----------
        topic : str, optional
            Of its pictures, as :meth:`pictures` takes it.
        """
        return None

    @property
    @abstractmethod
    def start(self) -> float | None:
        """Earliest stamp, s; None in an empty recording."""

    @property
    @abstractmethod
    def end(self) -> float | None:
        """Latest stamp, s; None in an empty recording."""

    @property
    def duration(self) -> float | None:
        """From the earliest to the latest stamp, s."""
        start, end = self.start, self.end
        return None if start is None or end is None else end - start

    def _repr_html_(self) -> str:
        """Show it in a notebook: what is in it."""
        figures: dict[str, object] = {}
        try:
            figures = {topic.name: f"{topic.count} × {topic.message_type}" for topic in self.topics()}
            if self.duration is not None:
                figures["time"] = f"{self.duration:.1f} s"
        except RecordingError as error:
            figures["damage"] = error
        if self.lidar_mount is not None:
            x, y, yaw = self.lidar_mount
            figures["lidar on the robot"] = f"x {x:.3f} m, y {y:.3f} m, {np.degrees(yaw):.1f}°"
        return card(f"Recording {self.path.name}", figures | {f"note {i + 1}": n for i, n in enumerate(self.notes)})


class SkipCount:
    """Counts what was skipped, by reason, into a recording's `skipped`; the reason carries the first place."""

    def __init__(self, skipped: dict[str, int]) -> None:
        skipped.clear()
        self._skipped = skipped
        self._keys: dict[str, str] = {}

    def add(self, reason: str, place: str) -> None:
        """Count one message skipped for `reason` at `place`."""
        key = self._keys.setdefault(reason, f"{reason} (first: {place})")
        self._skipped[key] = self._skipped.get(key, 0) + 1
