"""Writing of recordings: a rosbag2 folder with one MCAP file of standard messages, which ROS 2 and Foxglove play."""

import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.errors import RecordingError
from contourslam.geometry.rigid import from_planar, is_rigid
from contourslam.recordings.base_readings import BaseReading, InertialReading, WheelReading
from contourslam.recordings.picture import Picture
from contourslam.recordings.recording import Camera, Message
from contourslam.recordings.ros_encoding import Encoder, split_stamp
from contourslam.scan import LaserScan, Odometry

_WORLD, _ODOM, _BASE, _LASER, _CAMERA = "map", "odom", "base_link", "laser", "camera_optical"


class RecordingWriter:
    """Writes messages as they come; a context manager.

    Scans go to ``/scan`` (frame ``laser``), odometry to ``/odom`` and ``/tf`` (odom to base_link), true poses to
    ``/ground_truth`` (frame ``map``), pictures to ``/camera/image/compressed`` (frame ``camera_optical``), each with
    the camera's model in ``/camera/camera_info``, the places of lidar and camera to ``/tf_static``, angles of the
    wheels to ``/joint_states``, and the inertial sensors to ``/imu/data`` (frame ``base_link``). A message is recorded
    at its stamp, a scan at the time of its last beam, and never before the message before it, so that their order is
    kept.

    When the block is left by an exception, Ctrl-C among them, what was written is closed properly and kept. When the
    writing itself fails, for a full disk say, what was written is kept under another name, ``<path>.partial``, which
    :func:`open_recording` reads up to its end.

    Parameters
    ----------
    path : str or Path
        Folder to make; it must not exist.
    lidar_mount : tuple of (float, float, float), or array_like of shape (4, 4), optional
        x (m), y (m), yaw (rad) of the lidar in the base frame, or its place in space, m.
    camera : tuple of FisheyeModel and ndarray of shape (4, 4), optional
        Model of the camera, and its place ``T_base_camera``, m.

    Raises
    ------
    RecordingError
        If the folder exists or cannot be made, or a place of shape (4, 4) is no rigid motion.
    """

    def __init__(self, path: str | Path, *, lidar_mount: ArrayLike | None = None, camera: Camera | None = None) -> None:
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

        self.path = Path(path)
        self._places = _places(self.path, lidar_mount, camera)
        self._model = None if camera is None else camera[0]
        if self.path.exists():
            raise RecordingError(f"{self.path}: exists already; remove it or choose another name")
        # Version 8 of the metadata is the latest that ROS 2 Humble reads, too.
        self._writer = Writer(self.path, version=8, storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._encoder = Encoder()
        self._connections: dict[str, Any] = {}
        self._time = 0
        self._open = True
        try:
            self._writer.open()
        except OSError as error:
            raise self._give_up(error) from error

    def write(self, message: Message | Picture | BaseReading) -> None:
        """Append a message, a picture or a reading of the base.

        Raises
        ------
        RecordingError
            If no standard message can say it (uneven beams, a stamp that ROS cannot hold), or it cannot be written.
        """
        if not self._open:
            raise RecordingError(f"{self.path}: the recording is closed")
        try:
            if isinstance(message, LaserScan):
                last = message.stamp + float(message.offsets.max(initial=0.0))
                self._send("/scan", last, self._encoder.scan(message, _LASER))
            elif isinstance(message, Odometry):
                self._send("/odom", message.stamp, self._encoder.odometry(message.stamp, message.pose, _ODOM, _BASE))
                self._send("/tf", message.stamp, self._encoder.transform(message.stamp, message.pose, _ODOM, _BASE))
            elif isinstance(message, Picture):
                self._send("/camera/image/compressed", message.stamp, self._encoder.picture(message, _CAMERA))
                if self._model is not None:
                    info = self._encoder.camera_info(message.stamp, self._model, _CAMERA)
                    self._send("/camera/camera_info", message.stamp, info)
            elif isinstance(message, WheelReading):
                self._send("/joint_states", message.stamp, self._encoder.wheels(message, _BASE))
            elif isinstance(message, InertialReading):
                self._send("/imu/data", message.stamp, self._encoder.inertial(message, _BASE))
            else:
                pose = self._encoder.odometry(message.stamp, message.pose, _WORLD, _BASE)
                self._send("/ground_truth", message.stamp, pose)
        except OSError as error:
            raise self._give_up(error) from error
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from error

    def close(self) -> None:
        """Complete the recording.

        Raises
        ------
        RecordingError
            If nothing was written, or its end cannot be written.
        """
        if not self._open:
            return
        self._open = False
        try:
            if self._connections:
                self._writer.close()
                return
        except OSError as error:
            raise self._give_up(error) from error
        self._writer.abort()
        shutil.rmtree(self.path, ignore_errors=True)
        raise RecordingError(f"{self.path}: there was no message to record")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        else:
            with suppress(RecordingError):  # the first error is the one to show
                self.close()

    def _send(self, topic: str, stamp: float, message: Any) -> None:
        seconds, nanoseconds = split_stamp(stamp)
        self._time = max(self._time, seconds * 10**9 + nanoseconds)
        if not self._connections and self._places:
            places = self._encoder.transforms(stamp, _BASE, self._places)
            self._writer.write(self._connection("/tf_static", places), self._time, self._encoder.serialize(places))
        self._writer.write(self._connection(topic, message), self._time, self._encoder.serialize(message))

    def _connection(self, topic: str, message: Any) -> Any:
        if topic not in self._connections:
            self._connections[topic] = self._writer.add_connection(
                topic,
                message.__msgtype__,
                typestore=self._encoder.store,
                offered_qos_profiles=[_quality_of_service(latched=topic == "/tf_static")],
            )
        return self._connections[topic]

    def _give_up(self, error: OSError) -> RecordingError:
        """Stop writing, set aside what was written, and make the error."""
        self._open = False
        self._writer.abort()
        aside = self.path.with_name(f"{self.path.name}.partial")
        kept = ""
        if self.path.exists():
            with suppress(OSError):
                self.path.rename(aside)
            kept = f"; what was written so far is in {self.path if self.path.exists() else aside}"
        return RecordingError(f"{self.path}: cannot be written: {error.strerror or error}{kept}")


def _places(path: Path, lidar_mount: ArrayLike | None, camera: Camera | None) -> dict[str, NDArray[np.float64]]:
    """Places of the robot's parts in the base frame, by frame."""
    places = {}
    if lidar_mount is not None:
        mount = np.asarray(lidar_mount, dtype=np.float64)
        places[_LASER] = from_planar(mount) if mount.shape == (3,) else mount
    if camera is not None:
        places[_CAMERA] = np.asarray(camera[1], dtype=np.float64)
    for frame, place in places.items():
        if not is_rigid(place):
            raise RecordingError(f"{path}: the place of {frame} on the robot is no rigid motion")
    return places


def write_recording(
    path: str | Path,
    messages: Iterable[Message | Picture | BaseReading],
    *,
    lidar_mount: ArrayLike | None = None,
    camera: Camera | None = None,
) -> None:
    """Write messages as a recording, one by one as they come.

    Parameters
    ----------
    path : str or Path
        Folder to make; it must not exist.
    messages : iterable of LaserScan, Odometry, TruePose, Picture or BaseReading
        In the order of recording.
    lidar_mount, camera
        As :class:`RecordingWriter` takes them.

    Raises
    ------
    RecordingError
        As :class:`RecordingWriter`.
    """
    with RecordingWriter(path, lidar_mount=lidar_mount, camera=camera) as writer:
        for message in messages:
            writer.write(message)


def _quality_of_service(latched: bool) -> Any:
    """Reliable, as drivers and tools expect it; latched for what is sent once and must reach late listeners."""
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

    unlimited = QosTime(0, 0)
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=1 if latched else 10,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE,
        deadline=unlimited,
        lifespan=unlimited,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=unlimited,
        avoid_ros_namespace_conventions=False,
    )
