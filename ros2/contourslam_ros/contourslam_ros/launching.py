"""What the launch files of mapping and localisation start alike: a node in a map file, and RViz if wanted."""

from typing import Any

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


def node_and_rviz(
    executable: str, map_file: DeclareLaunchArgument, *more: Any, texts: tuple[str, ...] = ()
) -> LaunchDescription:
    """Say what is started.

    Parameters
    ----------
    executable : str
        The node: ``slam`` or ``localization``.
    map_file : DeclareLaunchArgument
        What the map file is to it, and whether it must be given.
    *more
        What else is declared and started.
    texts : tuple of str
        Names of further arguments that are parameters of the node.
    """
    simulated = ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)
    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of this robot."),
            DeclareLaunchArgument(
                "frame_prefix", default_value="", description='Before its frames, such as "robot1/".'
            ),
            DeclareLaunchArgument("params_file", default_value=PARAMETERS, description="Parameters of the node."),
            map_file,
            DeclareLaunchArgument("scan", default_value="scan", description="Topic of the scans."),
            DeclareLaunchArgument("odom", default_value="odom", description="Topic of the wheels' odometry."),
            DeclareLaunchArgument("use_sim_time", default_value="false", description="Time comes from /clock."),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz too."),
            DeclareLaunchArgument("view_port", default_value="0", description="Port of the live page; 0 for none."),
            DeclareLaunchArgument("view_host", default_value="127.0.0.1", description="Address to serve it at."),
            Node(
                package="contourslam_ros",
                executable=executable,
                namespace=LaunchConfiguration("namespace"),
                output="screen",
                parameters=[
                    LaunchConfiguration("params_file"),
                    {
                        name: ParameterValue(LaunchConfiguration(name), value_type=str)
                        for name in ("frame_prefix", "map_file", "view_host", *texts)
                    }
                    | {
                        "use_sim_time": simulated,
                        "view_port": ParameterValue(LaunchConfiguration("view_port"), value_type=int),
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
            *more,
        ]
    )
