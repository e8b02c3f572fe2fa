"""The parameters of the nodes of the robot's parts; how the robot itself is built stands in its robot.yaml.

``python3 -m contourslam_ros.part_settings`` writes a robot.yaml of the defaults, with what each value means.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path

from contourslam.errors import ConfigError
from contourslam.robot.config import RobotConfig, load_robot
from contourslam_ros.settings import yaml_lines


@dataclass(frozen=True, slots=True)
class PartConfig:
    """What all of them have."""

    robot: str = ""
    """The robot's file, robot.yaml; where empty, a robot of the defaults."""
    base_frame: str = "base_link"
    """Frame of the robot's base."""
    frame_prefix: str = ""
    """Put before all frames, such as "robot1/", where several robots share one /tf."""

    def named(self, frame: str) -> str:
        """Put the prefix before a frame's name."""
        return self.frame_prefix + frame

    def load(self) -> RobotConfig:
        """Read the robot's file.

        Raises
        ------
        ConfigError
            If it cannot be read.
        """
        return load_robot(Path(self.robot).expanduser()) if self.robot else RobotConfig()


@dataclass(frozen=True, slots=True)
class SensorConfig(PartConfig):
    """What those of a sensor have."""

    place_from_file: bool = True
    """Say on /tf_static where it sits, as the robot's file has it; off where a robot_state_publisher does."""


@dataclass(frozen=True, slots=True)
class LidarConfig(SensorConfig):
    """Parameters of the node ``lidar``."""

    port: str = ""
    """Serial port; where empty, the file's, and where that names none, found by itself."""
    baud: int = 0
    """Bits a second; 0 for the file's."""
    frame: str = "laser"
    """Frame of the scans."""


@dataclass(frozen=True, slots=True)
class BaseNodeConfig(PartConfig):
    """Parameters of the node ``base``."""

    port: str = ""
    """Serial port; where empty, the file's, and where that names none, found by itself."""
    odom_frame: str = "odom"
    """Frame in which the wheels' odometry drifts."""
    publish_tf: bool = True
    """Publish the transform from odom_frame to base_frame; off where a filter such as robot_localization does."""
    stamped_cmd_vel: bool = False
    """Commands come as TwistStamped; one whose stamp is older than cmd_vel_timeout is not obeyed."""
    cmd_vel_timeout: float = 0.5
    """The base is stopped when no command has come for so long, s."""

    def __post_init__(self) -> None:
        if not 0.0 < self.cmd_vel_timeout < math.inf:
            raise ConfigError(f"parameter cmd_vel_timeout must be a positive number, got {self.cmd_vel_timeout!r}")


@dataclass(frozen=True, slots=True)
class CameraConfig(SensorConfig):
    """Parameters of the node ``camera``."""

    source: str = ""
    """picamera2, a video device, a film, a folder of pictures or a recording; where empty, the file's."""
    rate: float = 5.0
    """Pictures a second, wanted of a camera."""
    frame: str = "camera_optical"
    """Frame of the pictures: x right, y down, z out of the lens."""

    def __post_init__(self) -> None:
        if not 0.0 < self.rate < math.inf:
            raise ConfigError(f"parameter rate must be a positive number, got {self.rate!r}")


def robot_yaml() -> str:
    """Give a robot of the defaults as the file that says how it is built, with what each value means."""
    robot = RobotConfig()
    lines = [
        "# How the robot is built, in SI units; what is left out keeps its default.",
        "# Copy it, and change what differs; docs/robot.md tells how. Calibrations write into it.",
        "base:",
        *yaml_lines(robot.base, "  "),
        "lidar:",
        *yaml_lines(robot.lidar, "  "),
        "# Written by `contourslam calibrate camera` and `contourslam calibrate extrinsics`.",
        "camera: null",
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(robot_yaml())
