"""Node ``camera``: the pictures of a fisheye camera, its model and its place."""

import sys
import time
from collections import deque
from collections.abc import Callable, Sequence

from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, CompressedImage

from contourslam.errors import ConfigError
from contourslam.live.diagnostics import Diagnostic, Level
from contourslam.recordings.picture import Picture
from contourslam.robot.camera.sources import open_source
from contourslam_ros.device_messages import camera_info_message, picture_message, place_message
from contourslam_ros.device_node import DeviceNode
from contourslam_ros.part_settings import CameraConfig
from contourslam_ros.picture_size import picture_size
from contourslam_ros.running import run
from contourslam_ros.settings import declare

LATE = 3.0  # s without a picture that are worth a word


class Camera(DeviceNode):
    """Publishes ``camera/image/compressed``, and ``camera/camera_info`` with each picture.

    Raises
    ------
    ConfigError
        If a parameter or the robot's file is wrong, or the robot has no camera.
    """

    def __init__(self) -> None:
        super().__init__("camera", "camera")
        self._config = declare(self, CameraConfig())
        part = self._config.load().camera
        if part is None:
            raise ConfigError(
                f"{self._config.robot or 'parameter robot'}: tells of no camera; calibrate one and put it there "
                "(docs/camera.md), or start the robot with camera:=false"
            )
        self._part = part
        self._frame = self._config.named(self._config.frame)
        self._times: deque[float] = deque(maxlen=20)
        self._bytes, self._ended = 0, False
        self._refused = ""

    def start(self) -> None:
        """Publish, and begin."""
        self._pictures = self.create_publisher(CompressedImage, "camera/image/compressed", QoSProfile(depth=2))
        self._infos = self.create_publisher(CameraInfo, "camera/camera_info", QoSProfile(depth=2))
        super().start()
        if self._config.place_from_file:
            base = self._config.named(self._config.base_frame)
            self.place(place_message(base, self._frame, self._part.T_base_camera))

    def work(self, stopped: Callable[[], bool]) -> None:
        """Publish pictures as they come."""
        model = self._part.model
        # No patience: the node itself opens the camera again, and says meanwhile that it has gone.
        with open_source(
            self._config.source or self._part.source,
            width=model.width,
            height=model.height,
            rate=self._config.rate,
            patience=0.0,
        ) as source:
            for picture in source.frames(stopped):
                self._send(picture)
                self.well()
        self._ended = True
        while not stopped():  # a film or a folder has come to its end
            time.sleep(0.1)

    def _send(self, picture: Picture) -> None:
        model, size = self._part.model, picture_size(picture)
        self._times.append(time.monotonic())
        self._bytes = len(picture.data)
        if size is not None and size != (model.width, model.height):
            self._refused = (
                f"the pictures have {size[0]} by {size[1]} pixels, and the lens was calibrated with {model.width} by "
                f"{model.height}: choose a camera that gives these, or calibrate it anew"
            )
            return
        self._refused = ""
        self._pictures.publish(picture_message(picture, self._frame))
        self._infos.publish(camera_info_message(picture.stamp, model, self._frame))

    def diagnostics(self) -> Sequence[Diagnostic]:
        """Say how the pictures come."""
        times = list(self._times)
        if self._ended:
            return (Diagnostic(Level.OK, "camera", "the pictures have come to their end"),)
        rate = (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0
        values = {"pictures (1/s)": f"{rate:.2f}", "latest (kB)": f"{1e-3 * self._bytes:.0f}"}
        silent = time.monotonic() - times[-1] if times else 0.0
        if self._refused:
            return (Diagnostic(Level.ERROR, "camera", self._refused, values),)
        if silent > LATE:
            return (Diagnostic(Level.WARN, "camera", f"no picture for {silent:.1f} s", values),)
        return (Diagnostic(Level.OK, "camera", f"{rate:.1f} pictures/s", values),)


def main() -> int:
    """Run the node until it is told to stop."""
    return run(Camera)


if __name__ == "__main__":
    sys.exit(main())
