"""The parameters of the nodes of the robot's parts; how the robot itself is built stands in its robot.yaml."""

from dataclasses import dataclass
from pathlib import Path

from contourslam.robot.config import RobotConfig, load_robot


@dataclass(frozen=True, slots=True)
class PartConfig:
    """What all of them have."""

    robot: str = ""
    """The robot's file, robot.yaml; where empty, a robot of the defaults."""
    base_frame: str = "base_link"
    """Frame of the robot's base."""
    frame_prefix: str = ""
    """Put before all frames, such as "robot1/", where several robots share one /tf."""
    place_from_file: bool = True
    """Say on /tf_static where the part sits, as the robot's file has it; off where a robot_state_publisher does."""

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
class LidarConfig(PartConfig):
    """Parameters of the node ``lidar``."""

    port: str = ""
    """Serial port; where empty, the file's, and where that names none, found by itself."""
    baud: int = 0
    """Bits a second; 0 for the file's."""
    frame: str = "laser"
    """Frame of the scans."""
