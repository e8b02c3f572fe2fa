"""Map a bag at full speed, and write what `contourslam run` writes.

ros2 launch contourslam_ros replay.launch.py bag:=$HOME/drive output:=$HOME/drive_map
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

PARAMETERS = PathJoinSubstitution([FindPackageShare("contourslam_ros"), "config", "parameters.yaml"])


def generate_launch_description() -> LaunchDescription:
    """Say what is started."""
    texts = ("bag", "output", "scan_topic", "odometry_topic")
    flags = ("overwrite", "grid")
    given = {name: ParameterValue(LaunchConfiguration(name), value_type=str) for name in texts}
    given |= {name: ParameterValue(LaunchConfiguration(name), value_type=bool) for name in flags}
    return LaunchDescription(
        [
            DeclareLaunchArgument("bag", description="The bag: a folder of ROS 2, or a file of ROS 1."),
            DeclareLaunchArgument("output", description="Folder to write."),
            DeclareLaunchArgument("params_file", default_value=PARAMETERS, description="Parameters of the node."),
            DeclareLaunchArgument("scan_topic", default_value="", description="Found by itself if there is only one."),
            DeclareLaunchArgument("odometry_topic", default_value="", description="Found by itself likewise."),
            DeclareLaunchArgument("overwrite", default_value="false", description="Replace what the folder holds."),
            DeclareLaunchArgument("grid", default_value="false", description="Write an occupancy grid for Nav2 too."),
            Node(
                package="contourslam_ros",
                executable="replay",
                output="screen",
                parameters=[LaunchConfiguration("params_file"), given],
            ),
        ]
    )
