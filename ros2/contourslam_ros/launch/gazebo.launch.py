"""A room in Gazebo with the robot in it: writes the world, opens it, and bridges its topics.

ros2 launch contourslam_ros gazebo.launch.py room:=office_corridor
"""

import sys
import tempfile
from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    ExecuteProcess,
    IncludeLaunchDescription,
    LogInfo,
    RegisterEventHandler,
)
from launch.conditions import IfCondition, UnlessCondition
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from contourslam.simulation.config import LIDARS
from contourslam.simulation.gazebo.robot import BASE, LIDAR


def generate_launch_description():
    """Write the world first; Gazebo and the bridge start once it is there."""
    room, lidar = LaunchConfiguration("room"), LaunchConfiguration("lidar")
    world = Path(tempfile.mkdtemp(prefix="contourslam_")) / "world.sdf"
    # The interpreter that ROS 2 runs on has contourslam installed: the nodes import it too.
    command = [sys.executable, "-m", "contourslam", "world", "--room", room, "--lidar", lidar, "-o", str(world)]
    write = ExecuteProcess(cmd=command, output="screen")

    def after(event, context):
        if event.returncode:
            why = f"the world was not written: contourslam world ended with {event.returncode}"
            return [LogInfo(msg=why), EmitEvent(event=Shutdown(reason=why))]
        return [*gazebo(world), bridge(), mount()]

    return LaunchDescription(
        [
            DeclareLaunchArgument("room", default_value="furnished_room", description="As of `contourslam world`."),
            DeclareLaunchArgument("lidar", default_value="ydlidar_x4", choices=list(LIDARS)),
            DeclareLaunchArgument("gui", default_value="true", description="false: Gazebo runs without a window."),
            RegisterEventHandler(OnProcessExit(target_action=write, on_exit=after)),
            write,
        ]
    )


def gazebo(world):
    """Open the world in Gazebo and let it run, with a window or without."""
    launch = str(Path(get_package_share_directory("ros_gz_sim")) / "launch" / "gz_sim.launch.py")
    gui = LaunchConfiguration("gui")
    return [
        IncludeLaunchDescription(
            PythonLaunchDescriptionSource(launch),
            launch_arguments={"gz_args": f"-r {options}{world}", "on_exit_shutdown": "true"}.items(),
            condition=condition(gui),
        )
        for condition, options in ((IfCondition, ""), (UnlessCondition, "-s --headless-rendering "))
    ]


def bridge():
    """Pass on scans, odometry, transforms, clock and commands."""
    share = Path(get_package_share_directory("contourslam_ros"))
    config = str(share / "config" / "gazebo_bridge.yaml")
    return Node(package="ros_gz_bridge", executable="parameter_bridge", parameters=[{"config_file": config}])


def mount():
    """Say where the lidar sits on the robot; the same place in every preset."""
    (x, z), *others = {(lidar.mount_x, lidar.mount_height) for lidar in LIDARS.values()}
    assert not others
    place = ["--x", str(x), "--z", str(z), "--frame-id", BASE, "--child-frame-id", LIDAR]
    return Node(package="tf2_ros", executable="static_transform_publisher", arguments=place)
