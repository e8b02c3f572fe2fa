"""Map a building: the node slam, and RViz if wanted.

ros2 launch contourslam_ros mapping.launch.py map_file:=$HOME/house.cmap rviz:=true
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument

from contourslam_ros.launching import FLEET, node_and_rviz


def generate_launch_description() -> LaunchDescription:
    """Say what is started."""
    map_file = DeclareLaunchArgument(
        "map_file", default_value="", description="Where the map is kept, and continued from."
    )
    return node_and_rviz("slam", map_file, FLEET, texts=("fleet",))
