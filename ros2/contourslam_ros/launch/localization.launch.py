"""Find the robot in a map that was kept: the node localization, and RViz if wanted.

ros2 launch contourslam_ros localization.launch.py map_file:=$HOME/house.cmap rviz:=true
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument

from contourslam_ros.launching import node_and_rviz


def generate_launch_description() -> LaunchDescription:
    """Say what is started."""
    map_file = DeclareLaunchArgument("map_file", description="The map, a file that slam saved.")
    return node_and_rviz("localization", map_file)
