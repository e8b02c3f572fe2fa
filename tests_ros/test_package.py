"""The package as colcon installs it, and its launch files over a stand-in of the launch system, which no wheel has."""

import os
import subprocess
import sys
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest
from ruamel.yaml import YAML

from contourslam_ros.fleet_settings import FleetConfig
from contourslam_ros.part_settings import BaseNodeConfig, CameraConfig, LidarConfig
from contourslam_ros.settings import NodeConfig

PACKAGE = Path(__file__).parents[1] / "ros2" / "contourslam_ros"
MESSAGES = PACKAGE.with_name("contourslam_msgs")
LAUNCHES = {"mapping": "slam", "localization": "localization", "replay": "replay"}
PARTS = {"lidar": LidarConfig, "base": BaseNodeConfig, "camera": CameraConfig}
NAMES = {
    "launch": ["LaunchContext", "LaunchDescription"],
    "launch.actions": ["DeclareLaunchArgument", "OpaqueFunction"],
    "launch.conditions": ["IfCondition"],
    "launch.substitutions": ["LaunchConfiguration", "PathJoinSubstitution"],
    "launch_ros": [],
    "launch_ros.actions": ["Node"],
    "launch_ros.parameter_descriptions": ["ParameterValue"],
    "launch_ros.substitutions": ["FindPackageShare"],
}


def stand_in(name: str) -> Callable[..., Any]:
    """A class that remembers what it was made with."""
    return lambda *values, **named: SimpleNamespace(
        kind=name, values=values, named=named, perform=lambda context: context.get(values[0], "1")
    )


def entities(name: str, monkeypatch: pytest.MonkeyPatch, **arguments: str) -> list[Any]:
    """What a launch file starts and declares, all arguments given unless they are named here as empty."""
    for module, names in NAMES.items():
        made: Any = ModuleType(module)
        for one in names:
            setattr(made, one, stand_in(one))
        monkeypatch.setitem(sys.modules, module, made)
    spec = spec_from_file_location(f"{name}_launch", PACKAGE / "launch" / f"{name}.launch.py")
    assert spec is not None
    assert spec.loader is not None
    found = module_from_spec(spec)
    spec.loader.exec_module(found)
    (listed,) = found.generate_launch_description().values
    known = [item.named["function"](arguments) if item.kind == "OpaqueFunction" else [item] for item in listed]
    return [item for some in known for item in some]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package, installed as colcon does it, from a copy, for setuptools writes beside what it installs."""
    folder = tmp_path_factory.mktemp("workspace")
    subprocess.run(["cp", "-r", str(PACKAGE), str(folder / "source")], check=True)
    prefix = folder / "install"
    words = [sys.executable, "-W", "ignore", "setup.py", "--quiet", "install", "--prefix", str(prefix)]
    words += ["--single-version-externally-managed", "--record", str(folder / "record")]
    (prefix / "lib").mkdir(parents=True)
    subprocess.run(words, cwd=folder / "source", check=True, env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"})
    return prefix


def test_nodes_and_what_they_need_are_where_ros_looks_for_them(installed: Path) -> None:
    share = installed / "share" / "contourslam_ros"
    assert (installed / "share/ament_index/resource_index/packages/contourslam_ros").exists()
    assert (share / "package.xml").read_text() == (PACKAGE / "package.xml").read_text()
    for folder in ("launch", "config", "rviz"):
        names = {path.name for path in (PACKAGE / folder).iterdir() if path.is_file()}
        assert names == {path.name for path in (share / folder).iterdir()}
    programs = {path.name for path in (installed / "lib" / "contourslam_ros").iterdir()}
    assert programs == {*LAUNCHES.values(), *PARTS, "fleet_server"}


@pytest.mark.parametrize("name", LAUNCHES)
def test_a_launch_file_names_what_is_there(name: str, installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = entities(name, monkeypatch)
    declared = [item.values[0] for item in found if item.kind == "DeclareLaunchArgument"]
    assert len(set(declared)) == len(declared)
    nodes = {item.named["package"]: item for item in found if item.kind == "Node"}
    node = nodes["contourslam_ros"].named
    assert node["executable"] == LAUNCHES[name]
    file, given = node["parameters"]
    assert file.values == ("params_file",)
    own = set(NodeConfig.__dataclass_fields__) | {"use_sim_time"}
    own |= {"bag", "output", "scan_topic", "odometry_topic", "overwrite", "grid"} if name == "replay" else set()
    assert set(given) <= own
    used = [part.values[0].values[0] for part in given.values()] + [
        to.values[0] for _, to in node.get("remappings", [])
    ]
    assert set(used) <= set(declared)
    assert {wanted for wanted, _ in node.get("remappings", [])} <= {"scan", "odom"}
    (default,) = (
        i.named["default_value"] for i in found if i.kind == "DeclareLaunchArgument" and i.values[0] == "params_file"
    )
    ((share, *parts),) = default.values
    assert installed.joinpath("share", *share.values, *parts).is_file()
    if "rviz2" in nodes:
        ((share, *parts),) = nodes["rviz2"].named["arguments"][1].values
        assert installed.joinpath("share", *share.values, *parts).is_file()


@pytest.mark.parametrize("name", ["mapping", "localization", "robot"])
def test_what_is_not_given_is_as_the_file_of_parameters_has_it(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    found = entities(name, monkeypatch, view_port="", view_host="", frame_prefix="")
    (_, given) = next(item.named["parameters"] for item in found if len(item.named.get("parameters", ())) == 2)
    assert "map_file" in given and not {"view_port", "view_host", "frame_prefix"} & set(given)
    # An argument that is left out is empty, and so not given.
    defaults = {i.values[0]: i.named.get("default_value") for i in found if i.kind == "DeclareLaunchArgument"}
    assert {defaults[argument] for argument in ("view_port", "view_host", "frame_prefix")} == {""}


def test_the_whole_robot_is_started_with_parameters_that_its_nodes_have(monkeypatch: pytest.MonkeyPatch) -> None:
    found = entities("robot", monkeypatch)
    declared = [item.values[0] for item in found if item.kind == "DeclareLaunchArgument"]
    assert len(set(declared)) == len(declared)
    nodes = {item.named["executable"]: item.named for item in found if item.kind == "Node"}
    assert set(nodes) == {"slam", "rviz2", *PARTS}
    for name, config in PARTS.items():
        (given,) = nodes[name]["parameters"]
        assert set(given) <= set(config.__dataclass_fields__)
        used = [part.values[0].values[0] for part in given.values()]
        assert nodes[name]["namespace"].values == nodes["slam"]["namespace"].values
        assert set(used) <= set(declared)
    file, given = nodes["slam"]["parameters"]
    assert file.values == ("params_file",)
    assert given["robot"].values[0].values == nodes["lidar"]["parameters"][0]["robot"].values[0].values
    # Where slam listens, the parts publish.
    said = {name: to.values for part in PARTS for name, to in nodes[part].get("remappings", [])}
    assert said == {name: to.values for name, to in nodes["slam"]["remappings"]}
    assert nodes["camera"]["condition"].values[0].values == ("camera",)


def test_the_fleet_s_launch_file_names_what_is_there(installed: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = entities("fleet", monkeypatch)
    nodes = {item.named["executable"]: item.named for item in found if item.kind == "Node"}
    (given,) = nodes["fleet_server"]["parameters"]
    assert set(given) <= set(FleetConfig.__dataclass_fields__) | {"use_sim_time"}
    declared = [item.values[0] for item in found if item.kind == "DeclareLaunchArgument"]
    assert {part.values[0].values[0] for part in given.values()} <= set(declared)
    ((share, *parts),) = nodes["rviz2"]["arguments"][1].values
    assert installed.joinpath("share", *share.values, *parts).is_file()


def test_rviz_shows_topics_that_the_nodes_publish_with_the_quality_of_service_they_have() -> None:
    content = YAML(typ="safe").load(PACKAGE / "rviz" / "contourslam.rviz")
    shown = {d["Topic"]["Value"]: d["Topic"] for d in content["Visualization Manager"]["Displays"] if "Topic" in d}
    assert set(shown) == {"map", "markers", "scan", "pose"}
    assert {name for name, topic in shown.items() if topic["Durability Policy"] == "Transient Local"} == {
        "map",
        "markers",
    }
    assert shown["scan"]["Reliability Policy"] == "Best Effort"


@pytest.mark.parametrize("folder", [PACKAGE, MESSAGES])
def test_a_package_declares_what_its_files_import(folder: Path) -> None:
    root = ElementTree.parse(folder / "package.xml").getroot()
    declared = {element.text for element in root if element.tag.endswith("depend")}
    sources = "\n".join(path.read_text() for path in folder.rglob("*") if path.suffix in (".py", ".msg", ".srv"))
    known = ["rclpy", "launch", "launch_ros", "ament_index_python", "rcl_interfaces", "builtin_interfaces", "tf2_msgs"]
    known += [
        f"{name}_msgs" for name in ("std", "sensor", "nav", "geometry", "visualization", "diagnostic", "contourslam")
    ]
    known += ["std_srvs"]
    imported = {n for n in known if f"from {n}" in sources or f"import {n}" in sources or f"\n{n}/" in f"\n{sources}"}
    assert imported - {root.findtext("name")} <= declared
