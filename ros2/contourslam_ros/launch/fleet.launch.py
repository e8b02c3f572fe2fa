"""Join what several robots map: the node fleet_server, and RViz if wanted.

ros2 launch contourslam_ros fleet.launch.py folder:=$HOME/fleet rviz:=true

On each robot, or for each robot in a namespace of its own:

ros2 launch contourslam_ros mapping.launch.py fleet:=robot1 namespace:=robot1 frame_prefix:=robot1/
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from contourslam_ros.launching import SHARE


def generate_launch_description() -> LaunchDescription:
    """Say what is started."""
    simulated = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    folder, sites = (ParameterValue(LaunchConfiguration(name), value_type=str) for name in ("folder", "sites"))
    picture = PathJoinSubstitution([SHARE, "rviz", "fleet.rviz"])
    return LaunchDescription(
        [
            DeclareLaunchArgument("folder", description="Where what the robots told is kept, and taken up again."),
            DeclareLaunchArgument(
                "sites",
                default_value="",
                description="Where robots drive that cannot meet: robot1:ground,robot2:first.",
            ),
            DeclareLaunchArgument("use_sim_time", default_value="false", description="Time comes from /clock."),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz too."),
            Node(
                package="contourslam_ros",
                executable="fleet_server",
                output="screen",
                parameters=[{"folder": folder, "sites": sites, "use_sim_time": simulated}],
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                arguments=["-d", picture],
                parameters=[{"use_sim_time": simulated}],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
