"""Pictures from the camera on a Raspberry Pi's ribbon cable."""

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

from contourslam.errors import MissingExtraError
from contourslam.recordings.picture import Picture
from contourslam.robot.camera.opencv import encode_jpeg
from contourslam.robot.camera.source import PictureSource, never
from contourslam.robot.device_errors import DeviceBusyError, DeviceError, DeviceNotFoundError, DeviceSilentError


class PiCamera(PictureSource):
    """A camera that picamera2 knows.

    Parameters
    ----------
    width, height : int
        Pixels.
    rate : float
        Pictures a second.
    timeout : float
        Time without a picture after which something is wrong, s.
    clock : callable
        Host time, s.

    Raises
    ------
    MissingExtraError
        If picamera2 is not installed; it comes with Raspberry Pi OS.
    DeviceNotFoundError, DeviceBusyError
        With what to try.
    """

    def __init__(
        self,
        *,
        width: int = 1280,
        height: int = 960,
        rate: float = 15.0,
        timeout: float = 3.0,
        clock: Callable[[], float] = time.time,
    ) -> None:
        super().__init__("picamera2")
        self._timeout, self._clock = timeout, clock
        kind = _picamera2()
        if not kind.global_camera_info():
            raise DeviceNotFoundError(
                "picamera2: no camera is found; turn the Pi off and seat the ribbon cable anew at both ends, "
                "`rpicam-hello --list-cameras` must list it"
            )
        self._camera: Any = None
        try:
            self._camera = kind()
            main = {"size": (width, height), "format": "RGB888"}  # which in memory is blue, green, red
            self._camera.configure(
                self._camera.create_video_configuration(main=main, controls={"FrameRate": rate}, buffer_count=4)
            )
            self._camera.start()
        except RuntimeError as error:
            self.close()
            if "busy" in str(error).lower() or "acquire" in str(error).lower():
                raise DeviceBusyError("picamera2: another program holds the camera; end it") from error
            raise DeviceError(f"picamera2: the camera does not start ({' '.join(str(error).split())})") from error

    def frames(self, stopped: Callable[[], bool] = never) -> Iterator[Picture]:
        """See :meth:`PictureSource.frames`."""
        while not stopped():
            try:
                request = self._camera.wait(self._camera.capture_request(wait=False), timeout=self._timeout)
            except (TimeoutError, RuntimeError) as error:
                raise DeviceSilentError(
                    f"picamera2: no picture came for {self._timeout:g} s; look at the ribbon cable, and at the supply "
                    "(`vcgencmd get_throttled` must say 0x0)"
                ) from error
            try:
                pixels, told = request.make_array("main"), request.get_metadata()
            finally:
                request.release()
            exposure = told.get("ExposureTime")
            self.exposure = None if exposure is None else 1e-6 * float(exposure)
            yield Picture(self._stamp(told), encode_jpeg(pixels), "jpeg")

    def _stamp(self, told: dict[str, Any]) -> float:
        """Host time in the middle of the exposure: the sensor tells when it began, by the clock since boot."""
        now, sensor = self._clock(), told.get("SensorTimestamp")
        if sensor is None:
            return now
        late = time.clock_gettime(time.CLOCK_BOOTTIME) - 1e-9 * float(sensor)
        return now - late + 0.5 * (self.exposure or 0.0) if 0.0 <= late < 2.0 else now

    def close(self) -> None:
        """See :meth:`PictureSource.close`."""
        if self._camera is not None:
            with suppress(Exception):  # a camera that has gone fails in the library's own ways
                self._camera.stop()
            with suppress(Exception):
                self._camera.close()
        self._camera = None


def _picamera2() -> Any:
    try:
        from picamera2 import Picamera2
    except ImportError as error:
        raise MissingExtraError(
            "picamera2 is not installed; on Raspberry Pi OS run: sudo apt install python3-picamera2, and make the "
            "environment with --system-site-packages; elsewhere use the number of a video device"
        ) from error
    return Picamera2
