"""Node ``localization``: tells the robot where it is in a map that is kept as it is."""

import sys
import time
from pathlib import Path

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped

from contourslam.errors import ConfigError, ContourslamError
from contourslam.live.session import Session
from contourslam.live.start import localization
from contourslam.recordings.ros_messages import POSE_COVARIANCE, odometry_from
from contourslam_ros.live_node import LiveNode
from contourslam_ros.running import run


class Localization(LiveNode):
    """The robot's pose in a known map, looked for everywhere until it is found."""

    rehearsed = "mapping, graph", "localising"  # the latter needs the map of the former
    back_end = "localization"

    def __init__(self) -> None:
        super().__init__("localization")
        if not self.config.map_file:
            raise ConfigError("localization needs a map: give its file as the parameter map_file")
        if self.config.fleet:
            raise ConfigError("localization maps nothing that a fleet could be told; give the parameter fleet to slam")

    def begin(self, mount: np.ndarray) -> Session:
        """Localise in the map."""
        return localization(
            self.settings.core,
            self.settings.live,
            Path(self.config.map_file).expanduser().absolute(),
            lidar_mount=mount,
            clock=time.monotonic,
            topics=self.topics,
            expects_odometry=self.config.odometry != "none",
        )

    def start(self) -> None:
        """Publish and subscribe; RViz's "2D Pose Estimate" gives a first guess."""
        super().start()
        self.create_subscription(PoseWithCovarianceStamped, "initialpose", self._on_guess, 1)

    def _on_guess(self, message: PoseWithCovarianceStamped) -> None:
        try:
            self.running().lost(odometry_from(message, POSE_COVARIANCE).pose)
        except ContourslamError as error:
            self.get_logger().error(f"initialpose: {error}")


def main() -> int:
    """Run the node until it is told to stop."""
    return run(Localization)


if __name__ == "__main__":
    sys.exit(main())
