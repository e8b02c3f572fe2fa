"""Finding the source of pictures behind a name."""

import importlib.util
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from contourslam.nearest import near_file
from contourslam.recordings.picture import Picture
from contourslam.recordings.text import first_bytes
from contourslam.robot.camera.pi import PiCamera
from contourslam.robot.camera.source import PictureSource, never, paced
from contourslam.robot.camera.stored import kept_pictures
from contourslam.robot.camera.video import Film, VideoCamera, video_devices
from contourslam.robot.device_errors import DeviceNotFoundError

_BAGS = (b"#ROSBAG V", b"\x89MCAP0", b"SQLite format 3\x00")


class KeptPictures(PictureSource):
    """Pictures of a folder or of a recording.

    Parameters
    ----------
    path : Path
    pace : bool
        As fast as they were taken.
    """

    def __init__(self, path: Path, *, pace: bool = True) -> None:
        super().__init__(str(path))
        self._path, self._pace = path, pace

    def frames(self, stopped: Callable[[], bool] = never) -> Iterator[Picture]:
        """See :meth:`PictureSource.frames`."""
        pictures = (picture for _, picture in kept_pictures(self._path))
        if self._pace:
            yield from paced(pictures, stopped)
            return
        for picture in pictures:
            if stopped():
                return
            yield picture


def open_source(
    name: str = "auto",
    *,
    width: int = 1280,
    height: int = 960,
    rate: float = 15.0,
    patience: float = 30.0,
    pace: bool = True,
    clock: Callable[[], float] = time.time,
) -> PictureSource:
    """Open a source of pictures.

    Parameters
    ----------
    name : str
        ``picamera2``; the number or the path of a video device; a film; a folder of pictures; a recording.
        ``auto`` is picamera2 where it is installed, else the video device 0.
    width, height : int
        Wanted of a camera, pixels.
    rate : float
        Wanted of a camera, pictures a second.
    patience : float
        How long a camera that has gone is waited for, s.
    pace : bool
        What is kept comes as fast as it was taken, else as fast as it is asked for.
    clock : callable
        Host time, s.

    Returns
    -------
    PictureSource

    Raises
    ------
    DeviceError
        One of its kinds, with what to try.
    RecordingError
        If what is kept cannot be read.
    MissingExtraError
        If the library for it is not installed.
    """
    if name == "auto":
        name = "picamera2" if importlib.util.find_spec("picamera2") is not None else "0"
    if name == "picamera2":
        return PiCamera(width=width, height=height, rate=rate, clock=clock)
    if name.isdecimal() or name.startswith("/dev/"):
        device = int(name) if name.isdecimal() else name
        return VideoCamera(device, width=width, height=height, rate=rate, patience=patience, clock=clock)
    path = Path(name)
    if not path.exists():
        raise DeviceNotFoundError(
            f"{name}: there is no such file, folder or camera{near_file(path)}; {video_devices()}"
        )
    if path.is_dir() or first_bytes(path, 16).startswith(_BAGS):
        return KeptPictures(path, pace=pace)
    return Film(path, pace=pace)
