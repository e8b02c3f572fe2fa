"""The whole robot: its lidar, its base, its camera where it has one, the node slam, and RViz if wanted.

ros2 launch contourslam_ros robot.launch.py robot:=$HOME/robot.yaml map_file:=$HOME/house.cmap
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from contourslam_ros.launching import FLEET, node_and_rviz


def generate_launch_description() -> LaunchDescription:
    """Say what is started."""
    map_file = DeclareLaunchArgument(
        "map_file", default_value="", description="Where the map is kept, and continued from."
    )
    return node_and_rviz(
        "slam",
        map_file,
        FLEET,
        DeclareLaunchArgument("robot", description="The file that says how the robot is built: robot.yaml."),
        DeclareLaunchArgument("camera", default_value="true", description="false: its pictures are left out."),
        part("lidar", remappings=[("scan", LaunchConfiguration("scan"))]),
        part("base", remappings=[("odom", LaunchConfiguration("odom"))]),
        part("camera", condition=IfCondition(LaunchConfiguration("camera"))),
        texts=("robot", "fleet"),
    )


def part(executable: str, **more: object) -> Node:
    """Start the node of one of the robot's parts."""
    given = {name: ParameterValue(LaunchConfiguration(name), value_type=str) for name in ("robot", "frame_prefix")}
    return Node(
        package="contourslam_ros",
        executable=executable,
        namespace=LaunchConfiguration("namespace"),
        output="screen",
        parameters=[given],
        **more,
    )
