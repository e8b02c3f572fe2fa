"""Map a building: the node slam, and RViz if wanted.

ros2 launch contourslam_ros mapping.launch.py map_file:=$HOME/house.map rviz:=true
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

SHARE = FindPackageShare("contourslam_ros")
PARAMETERS = PathJoinSubstitution([SHARE, "config", "parameters.yaml"])
PICTURE = PathJoinSubstitution([SHARE, "rviz", "contourslam.rviz"])


def generate_launch_description() -> LaunchDescription:
    """Say what is started."""
    simulated = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of this robot."),
            DeclareLaunchArgument(
                "frame_prefix", default_value="", description='Before its frames, such as "robot1/".'
            ),
            DeclareLaunchArgument("params_file", default_value=PARAMETERS, description="Parameters of the node."),
            DeclareLaunchArgument(
                "map_file", default_value="", description="Where the map is kept, and continued from."
            ),
            DeclareLaunchArgument("scan", default_value="scan", description="Topic of the scans."),
            DeclareLaunchArgument("odom", default_value="odom", description="Topic of the wheels' odometry."),
            DeclareLaunchArgument("use_sim_time", default_value="false", description="Time comes from /clock."),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz too."),
            Node(
                package="contourslam_ros",
                executable="slam",
                namespace=LaunchConfiguration("namespace"),
                output="screen",
                parameters=[
                    LaunchConfiguration("params_file"),
                    {
                        "frame_prefix": ParameterValue(LaunchConfiguration("frame_prefix"), value_type=str),
                        "map_file": ParameterValue(LaunchConfiguration("map_file"), value_type=str),
                        "use_sim_time": simulated,
                    },
                ],
                remappings=[("scan", LaunchConfiguration("scan")), ("odom", LaunchConfiguration("odom"))],
            ),
            Node(
                package="rviz2",
                executable="rviz2",
                namespace=LaunchConfiguration("namespace"),
                arguments=["-d", PICTURE],
                parameters=[{"use_sim_time": simulated}],
                condition=IfCondition(LaunchConfiguration("rviz")),
            ),
        ]
    )
