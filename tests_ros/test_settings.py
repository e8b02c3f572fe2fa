"""The parameters: all of the core's settings are among them, and what is wrong is refused by name."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter

from contourslam.errors import ConfigError
from contourslam.robot.config import RobotConfig, load_robot
from contourslam_ros.part_settings import BaseNodeConfig, CameraConfig, LidarConfig, robot_yaml
from contourslam_ros.settings import Settings, declare, declared, parameters_yaml

CONFIG = Path(__file__).parents[1] / "ros2" / "contourslam_ros" / "config"
FILE, ROBOT = CONFIG / "parameters.yaml", CONFIG / "robot.yaml"


@pytest.fixture
def node(ros: None) -> Iterator[Callable[..., Node]]:
    made: list[Node] = []

    def make(*arguments: str, **values: Any) -> Node:
        overrides = [Parameter(name.replace("__", "."), value=value) for name, value in values.items()]
        made.append(
            rclpy.create_node(
                "parameters",
                cli_args=["--ros-args", *arguments],
                parameter_overrides=overrides,
                use_global_arguments=False,
            )
        )
        return made[-1]

    yield make
    for one in made:
        one.destroy_node()


def test_the_file_of_parameters_is_as_the_configuration_is_now() -> None:
    assert FILE.read_text() == parameters_yaml(), "python3 -m contourslam_ros.settings > config/parameters.yaml"


def test_the_file_of_a_robot_is_as_its_configuration_is_now_and_is_read_as_the_defaults() -> None:
    assert ROBOT.read_text() == robot_yaml(), "python3 -m contourslam_ros.part_settings > config/robot.yaml"
    assert load_robot(ROBOT) == RobotConfig()


def test_ros_reads_the_file_and_finds_the_defaults(node: Callable[..., Node]) -> None:
    assert declared(node("--params-file", str(FILE))) == Settings()


def test_a_given_value_arrives_at_its_setting_and_whole_numbers_do_for_lengths(node: Callable[..., Node]) -> None:
    found = declared(node(slam__motion__clock_sigma=1, live__wait=0.5, detector="wu", map_frame="world"))
    defaults = Settings()
    motion = replace(defaults.core.slam.motion, clock_sigma=1.0)
    core = replace(defaults.core, detector="wu", slam=replace(defaults.core.slam, motion=motion))
    assert found.core == core
    assert found.live == replace(defaults.live, wait=0.5)
    assert found.node.map_frame == "world"


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"lidar__max_range": "far"}, "lidar.max_range must be a float"),
        ({"slam__walls": 1}, "slam.walls must be a bool"),
        ({"slam__sightings_to_birth": 2.5}, "slam.sightings_to_birth must be a int"),
        ({"lidar__sigma_range": -1.0}, "sigma_range must be a positive number"),
        ({"odometry": "wheels"}, "odometry must be"),
        ({"map_period": 0.0}, "map_period must be a positive number"),
        ({"view_port": 70000}, "view_port must lie between 0 and 65535"),
        ({"view_host": "0.0.0.0"}, "view_host says where the page is served that view_port asks for"),
    ],
)
def test_a_wrong_value_is_refused_by_name(node: Callable[..., Node], values: dict[str, Any], named: str) -> None:
    with pytest.raises(ConfigError, match=named):
        declared(node(**values))


def test_a_parameter_is_not_changed_under_a_running_map(node: Callable[..., Node]) -> None:
    made = node()
    declared(made)
    (result,) = made.set_parameters([Parameter("lidar.max_range", value=5.0)])
    assert not result.successful


@pytest.mark.parametrize("config", [LidarConfig(), BaseNodeConfig(), CameraConfig()])
def test_each_parameter_of_the_parts_says_what_it_means(node: Callable[..., Node], config: Any) -> None:
    made = node()
    assert declare(made, config) == config
    for name in config.__dataclass_fields__:
        assert made.describe_parameter(name).description


def test_a_wrong_value_of_a_part_is_refused_by_name(node: Callable[..., Node]) -> None:
    with pytest.raises(ConfigError, match="cmd_vel_timeout must be a positive number"):
        declare(node(cmd_vel_timeout=0), BaseNodeConfig())
    with pytest.raises(ConfigError, match="port must be a str"):
        declare(node(port=1), LidarConfig())
