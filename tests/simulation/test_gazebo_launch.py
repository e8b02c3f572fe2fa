"""The launch file and the bridge beside the world that they are for; ROS 2's launch system is stood in for."""

import sys
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest
from ruamel.yaml import YAML

from contourslam.cli.entry import parse
from contourslam.cli.world import World
from contourslam.simulation.config import YDLIDAR_X4, RobotModel
from contourslam.simulation.gazebo.world import gazebo_world
from contourslam.simulation.rooms import ROOMS

PACKAGE = Path(__file__).parents[2] / "ros2" / "contourslam_ros"
NAMES = {
    "ament_index_python.packages": ["get_package_share_directory"],
    "launch": ["LaunchDescription"],
    "launch.actions": [
        *("DeclareLaunchArgument", "EmitEvent", "ExecuteProcess", "IncludeLaunchDescription", "LogInfo"),
        "RegisterEventHandler",
    ],
    "launch.conditions": ["IfCondition", "UnlessCondition"],
    "launch.event_handlers": ["OnProcessExit"],
    "launch.events": ["Shutdown"],
    "launch.launch_description_sources": ["PythonLaunchDescriptionSource"],
    "launch.substitutions": ["LaunchConfiguration"],
    "launch_ros.actions": ["Node"],
}


def stand_in(name: str) -> Callable[..., Any]:
    """A class that remembers what it was made with."""

    def make(*values: Any, **named: Any) -> Any:
        return SimpleNamespace(kind=name, values=values, **named)

    return make


@pytest.fixture
def launch(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    for module, names in NAMES.items():
        made: Any = ModuleType(module)
        for name in names:
            setattr(made, name, stand_in(name))
        monkeypatch.setitem(sys.modules, module, made)
    share: Any = sys.modules["ament_index_python.packages"]
    share.get_package_share_directory = lambda name: str(PACKAGE)
    monkeypatch.setattr("tempfile.mkdtemp", lambda prefix: str(tmp_path))
    spec = spec_from_file_location("gazebo_launch", PACKAGE / "launch" / "gazebo.launch.py")
    assert spec is not None
    assert spec.loader is not None
    found = module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def entities(launch: ModuleType) -> dict[str, list[Any]]:
    (items,) = launch.generate_launch_description().values
    return {kind: [item for item in items if item.kind == kind] for kind in {item.kind for item in items}}


def test_the_command_that_writes_the_world_is_one_that_the_command_line_takes(
    launch: ModuleType, tmp_path: Path
) -> None:
    found = entities(launch)
    defaults = {item.values[0]: item.default_value for item in found["DeclareLaunchArgument"]}
    (process,) = found["ExecuteProcess"]
    words = [word if isinstance(word, str) else defaults[word.values[0]] for word in process.cmd]
    assert words[:3] == [sys.executable, "-m", "contourslam"]
    command = parse(words[3:])
    assert isinstance(command, World)
    assert command.output == tmp_path / "world.sdf"
    assert command.room in ROOMS


def test_gazebo_opens_the_world_once_it_is_written_and_not_if_it_failed(launch: ModuleType, tmp_path: Path) -> None:
    (handler,) = entities(launch)["RegisterEventHandler"]
    started = handler.values[0].on_exit(SimpleNamespace(returncode=0), None)
    opened = [dict(item.launch_arguments)["gz_args"] for item in started if item.kind == "IncludeLaunchDescription"]
    assert opened == [f"-r {tmp_path}/world.sdf", f"-r -s --headless-rendering {tmp_path}/world.sdf"]
    assert [item.executable for item in started if item.kind == "Node"] == [
        "parameter_bridge",
        "static_transform_publisher",
    ]
    stopped = handler.values[0].on_exit(SimpleNamespace(returncode=1), None)
    assert [item.kind for item in stopped] == ["LogInfo", "EmitEvent"]


def test_the_transform_of_the_lidar_is_where_the_world_has_it(launch: ModuleType) -> None:
    words = launch.mount().arguments
    said = dict(zip(words[::2], words[1::2], strict=True))
    root = ElementTree.fromstring(gazebo_world(ROOMS["large_hall"], YDLIDAR_X4, RobotModel()))
    pose = (root.findtext("world/model[@name='robot']/link[@name='lidar_link']/pose") or "").split()
    assert [float(said["--x"]), 0.0, float(said["--z"]), 0.0, 0.0, 0.0] == [float(word) for word in pose]
    assert (said["--frame-id"], said["--child-frame-id"]) == ("base_link", "lidar_link")


def test_the_bridge_passes_on_the_topics_that_the_world_has(launch: ModuleType) -> None:
    file = launch.bridge().parameters[0]["config_file"]
    rows = {row["gz_topic_name"]: row for row in YAML(typ="safe").load(Path(file))}
    root = ElementTree.fromstring(gazebo_world(ROOMS["large_hall"], YDLIDAR_X4, RobotModel()))
    tags = ("topic", "odom_topic", "tf_topic")
    topics = {f"/{element.text}" for tag in tags for element in root.iter(tag)}
    # The second tree of transforms, of the true pose, stays in Gazebo.
    assert set(rows) == (topics - {"/ground_truth/tf"}) | {"/clock"}
    towards = {topic: row["direction"] for topic, row in rows.items()}
    assert towards.pop("/cmd_vel") == "ROS_TO_GZ"
    assert set(towards.values()) == {"GZ_TO_ROS"}
