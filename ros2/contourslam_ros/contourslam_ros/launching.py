"""What the launch files of mapping and localisation start alike: a node in a map file, and RViz if wanted."""

from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

SHARE = FindPackageShare("contourslam_ros")
PARAMETERS = PathJoinSubstitution([SHARE, "config", "parameters.yaml"])
FLEET = DeclareLaunchArgument(
    "fleet", default_value="", description="Name under which the robot tells a fleet server what it maps."
)
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
    kinds = dict.fromkeys(("frame_prefix", "map_file", "view_host", *texts), str) | {"view_port": int}

    def node(context: LaunchContext) -> list[Node]:
        """Start the node; what is not given here is as the file has it."""
        given = {
            name: ParameterValue(LaunchConfiguration(name), value_type=kind)
            for name, kind in kinds.items()
            if LaunchConfiguration(name).perform(context)
        }
        return [
            Node(
                package="contourslam_ros",
                executable=executable,
                namespace=LaunchConfiguration("namespace"),
                output="screen",
                parameters=[LaunchConfiguration("params_file"), given | {"use_sim_time": simulated}],
                remappings=[("scan", LaunchConfiguration("scan")), ("odom", LaunchConfiguration("odom"))],
            )
        ]

    return LaunchDescription(
        [
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of this robot."),
            DeclareLaunchArgument(
                "frame_prefix", default_value="", description='Before its frames, such as "robot1/".'
            ),
            DeclareLaunchArgument("params_file", default_value=PARAMETERS, description="Its other parameters."),
            map_file,
            DeclareLaunchArgument("scan", default_value="scan", description="Topic of the scans."),
            DeclareLaunchArgument("odom", default_value="odom", description="Topic of the wheels' odometry."),
            DeclareLaunchArgument("use_sim_time", default_value="false", description="Time comes from /clock."),
            DeclareLaunchArgument("rviz", default_value="false", description="Start RViz too."),
            DeclareLaunchArgument("view_port", default_value="", description="Port of the live page; 0 for none."),
            DeclareLaunchArgument("view_host", default_value="", description="Address to serve it at."),
            *more,
            OpaqueFunction(function=node),  # after all that is declared
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
