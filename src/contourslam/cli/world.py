"""``contourslam world``: a room as a world of Gazebo."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from contourslam.cli.console import chosen, make_way, note
from contourslam.cli.options import Flag, Overwrite


@dataclass(frozen=True)
class World:
    """Write a simulated room as an SDF world for Gazebo, with the robot at the start of its way.

    The robot takes `cmd_vel` and gives `scan`, `odom`, `tf` and its true pose `ground_truth`; docs/gazebo.md tells how
    to drive it from ROS 2. The same room and options give the same file.

    Example: contourslam world --room office_corridor -o office.sdf
    """

    output: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="FILE")]
    """File to write."""
    overwrite: Overwrite = False
    room: str = "furnished_room"
    """Room to write: furnished_room, office_corridor, large_hall or office_building."""
    lidar: str = "ydlidar_x4"
    """Lidar of the robot: ydlidar_x4 (714 beams at 7 Hz, 10 m) or paper (500 beams at 10 Hz, 30 m)."""
    empty: Flag = False
    """Leave the robot out, for one of your own."""

    def execute(self, command: str) -> int:
        """Write the file and say what is in it."""
        from contourslam.atomic import write_text
        from contourslam.simulation.config import LIDARS, RobotModel
        from contourslam.simulation.gazebo.world import gazebo_world
        from contourslam.simulation.rooms import ROOMS

        room = chosen("room", self.room, ROOMS)
        lidar = chosen("lidar", self.lidar, LIDARS)
        make_way(self.output, overwrite=self.overwrite)
        write_text(self.output, gazebo_world(room, lidar, None if self.empty else RobotModel()))
        print(f"{self.output}: {room.name}, {len(room.outline)} walls, {len(room.pieces)} pieces of furniture")
        note(f"open it with: gz sim {self.output}")
        return 0
