"""Pictures from a camera that the system knows as a video device, and from films."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from contourslam.errors import RecordingError
from contourslam.nearest import unreadable
from contourslam.recordings.picture import Picture
from contourslam.robot.camera.opencv import encode_jpeg, opencv
from contourslam.robot.camera.source import PictureSource, never, paced
from contourslam.robot.device_errors import (
    DeviceBusyError,
    DeviceError,
    DeviceNotFoundError,
    DevicePermissionError,
    DeviceSilentError,
    DeviceUnpluggedError,
)
from contourslam.robot.serial_port import join_group

_LATEST = 1.0  # s: a driver's own stamp older than this is of another clock
_EARLY = 0.9  # of the time between two pictures; many cameras have but one rate, and come too soon for another
_LONGEST_PAUSE = 2.0  # s between two tries to open a camera that has gone


class VideoCamera(PictureSource):
    """A camera that the system knows as a video device (V4L2 on Linux), read by OpenCV.

    Where the camera gives JPEG, its own bytes are passed on: nothing is decoded or compressed anew.

    Parameters
    ----------
    device : int or str
        Number of the device, or its path, such as ``/dev/video0``.
    width, height : int
        Wanted size, pixels; the camera takes the nearest that it has.
    rate : float
        Wanted pictures a second; of a camera that gives more, those between are left out.
    timeout : float
        Time without a picture after which something is wrong, s.
    patience : float
        How long a camera that has gone is waited for, s; 0 gives up at once.
    clock : callable
        Host time, s.
    capture : callable, optional
        Opens a device as ``cv2.VideoCapture`` does.

    Raises
    ------
    DeviceNotFoundError, DevicePermissionError, DeviceBusyError
        With what to try.
    MissingExtraError
        If OpenCV is not installed.
    """

    def __init__(
        self,
        device: int | str = 0,
        *,
        width: int = 1280,
        height: int = 960,
        rate: float = 15.0,
        timeout: float = 3.0,
        patience: float = 30.0,
        clock: Callable[[], float] = time.time,
        capture: Callable[[int | str], Any] | None = None,
    ) -> None:
        self._path = Path(f"/dev/video{device}" if isinstance(device, int) else device)
        super().__init__(str(self._path))
        self._device, self._size, self._rate = device, (width, height), rate
        self._timeout, self._patience, self._clock = timeout, patience, clock
        self._new_capture = capture or _open_device
        self._capture: Any = None
        self._open()

    def frames(self, stopped: Callable[[], bool] = never) -> Iterator[Picture]:
        """See :meth:`PictureSource.frames`; a camera that goes away is opened again once it is back."""
        heard, last = time.monotonic(), -math.inf
        while not stopped():
            picture = self._read()
            if picture is not None:
                heard = time.monotonic()
                if not 0.0 <= picture.stamp - last < _EARLY / self._rate:  # not where the clock was set back
                    last = picture.stamp
                    yield picture
                continue
            if self._gone():
                if not self._reconnect(stopped):
                    return
                heard = time.monotonic()
            elif time.monotonic() - heard > self._timeout:
                raise DeviceSilentError(
                    f"{self.name}: no picture came for {self._timeout:g} s; try a smaller --width and --height, "
                    "another USB socket without a hub, or end another program that uses the camera"
                )
            else:
                time.sleep(0.02)

    def close(self) -> None:
        """See :meth:`PictureSource.close`."""
        if self._capture is not None:
            with suppress(Exception):  # a device that has gone fails in the library's own ways
                self._capture.release()
        self._capture = None

    def _open(self) -> None:
        cv2 = opencv()
        self._refuse()
        capture = self._new_capture(self._device)
        if not capture.isOpened():
            capture.release()
            self._refuse()
            raise DeviceBusyError(
                f"{self.name}: gives no pictures; another program may hold it (`fuser {self.name}` names it), or it is "
                f"no camera; {video_devices()}"
            )
        capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG"))
        for what, value in zip(
            (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT, cv2.CAP_PROP_FPS), (*self._size, self._rate),
            strict=True,
        ):  # fmt: skip
            capture.set(what, value)
        capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)  # the camera's own JPEG, where it makes one
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 2)
        self._capture = capture

    def _refuse(self) -> None:
        """Raise what the device's file tells."""
        if not self._path.exists():
            raise DeviceNotFoundError(f"{self.name}: there is no such camera; {video_devices()}")
        try:
            with self._path.open("rb"):
                pass
        except PermissionError as error:
            raise DevicePermissionError(f"{self.name}: {join_group(self.name)}") from error
        except OSError:
            pass  # busy, or a device that cannot be opened so: the library will tell

    def _read(self) -> Picture | None:
        """Take a picture; None where none came or it is damaged."""
        cv2 = opencv()
        try:
            good, pixels = self._capture.read()
        except cv2.error:
            return None
        read = self._clock()
        if not good or pixels is None or not pixels.size:
            return None
        stamp = self._stamp(read)
        self.exposure = self._told_exposure()
        if pixels.ndim < 3 or 1 in pixels.shape[:2]:
            data = pixels.tobytes()
            if data.startswith(b"\xff\xd8\xff"):
                data = data.rstrip(b"\x00")
                with suppress(RecordingError):
                    return Picture(stamp, data, "jpeg")
                return None
            # Neither JPEG nor colours: raw pixels of a camera without JPEG, which OpenCV is to convert.
            self._capture.set(cv2.CAP_PROP_CONVERT_RGB, 1)
            return None
        if pixels.shape[2] == 2:
            pixels = cv2.cvtColor(pixels, cv2.COLOR_YUV2BGR_YUYV)
        return Picture(stamp, encode_jpeg(pixels), "jpeg")

    def _stamp(self, read: float) -> float:
        """Time of the exposure: the driver's own where it is of the steady clock, else that of the reading."""
        with suppress(Exception):
            late = time.monotonic() - 1e-3 * float(self._capture.get(opencv().CAP_PROP_POS_MSEC))
            if 0.0 <= late < _LATEST:
                return read - late
        return read

    def _told_exposure(self) -> float | None:
        """Exposure that the driver tells, which V4L2 counts in 0.1 ms."""
        with suppress(Exception):
            value = float(self._capture.get(opencv().CAP_PROP_EXPOSURE))
            return 1e-4 * value if math.isfinite(value) and value > 0.0 else None
        return None

    def _gone(self) -> bool:
        return not self._path.exists()

    def _reconnect(self, stopped: Callable[[], bool]) -> bool:
        """Open the camera again once it is back; False where that is no longer wanted."""
        self.close()
        pause, until = 0.1, time.monotonic() + self._patience
        while not stopped():
            try:
                self._open()
                self.reconnections += 1
                return True
            except DeviceError as error:  # the rights to a new device come a moment after it
                if time.monotonic() > until:
                    raise DeviceUnpluggedError(
                        f"{self.name}: the camera was unplugged and has not come back within {self._patience:g} s "
                        f"({error})"
                    ) from error
            time.sleep(pause)
            pause = min(2.0 * pause, _LONGEST_PAUSE)
        return False


class Film(PictureSource):
    """A film, played as fast as it was taken or as fast as it is asked for.

    Parameters
    ----------
    path : Path
    pace : bool
        As fast as it was taken.

    Raises
    ------
    RecordingError
        If it cannot be read.
    """

    def __init__(self, path: Path, *, pace: bool = True) -> None:
        super().__init__(str(path))
        self._path, self._pace = path, pace
        self._capture: Any = None
        try:
            with path.open("rb") as file:
                file.read(1)
        except OSError as error:
            raise RecordingError(unreadable(path, error)) from error
        self._open()

    def _open(self) -> None:
        self._capture = opencv().VideoCapture(str(self._path))
        if not self._capture.isOpened():
            raise RecordingError(f"{self._path}: is no film that OpenCV can read, nor pictures or a recording of them")

    def frames(self, stopped: Callable[[], bool] = never) -> Iterator[Picture]:
        """See :meth:`PictureSource.frames`; stamps count from the film's beginning, s."""
        pictures = self._frames(stopped)
        return paced(pictures, stopped) if self._pace else pictures

    def _frames(self, stopped: Callable[[], bool]) -> Iterator[Picture]:
        cv2 = opencv()
        if self._capture is None:
            self._open()
        rate = float(self._capture.get(cv2.CAP_PROP_FPS)) or 25.0
        count = 0
        while not stopped():
            good, pixels = self._capture.read()
            if not good:
                break
            yield Picture(count / rate, encode_jpeg(np.asarray(pixels)), "jpeg")
            count += 1
        self.close()

    def close(self) -> None:
        """See :meth:`PictureSource.close`."""
        if self._capture is not None:
            self._capture.release()
        self._capture = None


def video_devices() -> str:
    """Say which cameras there are."""
    found = sorted(Path("/dev").glob("video[0-9]*"), key=lambda path: (len(path.name), path.name))
    if not found:
        return "there is no video device at all: plug the camera in; one on a Pi's ribbon cable is `picamera2`"
    return f"the video devices there are: {', '.join(_described(path) for path in found)}"


def _described(path: Path) -> str:
    with suppress(OSError):
        name = Path(f"/sys/class/video4linux/{path.name}/name").read_text(encoding="utf-8", errors="replace").strip()
        return f"{path} ({name})"
    return str(path)


def _open_device(device: int | str) -> Any:
    import sys

    cv2 = opencv()
    return cv2.VideoCapture(device, cv2.CAP_V4L2 if sys.platform == "linux" else cv2.CAP_ANY)
