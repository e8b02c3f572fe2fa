"""The nodes' parameters: what the nodes need themselves, and every setting of the core under its own name.

``python3 -m contourslam_ros.settings`` writes the default parameters as YAML, with what each means.
"""

import ast
import dataclasses
import inspect
import json
import math
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

from contourslam.cli.run import DEFAULTS
from contourslam.cli.serving import HOST
from contourslam.config import Config, LiveConfig
from contourslam.errors import ConfigError

if TYPE_CHECKING:
    from rclpy.node import Node

T = TypeVar("T")


def is_name(text: str) -> bool:
    """Whether a text can be a part of a topic's name."""
    return re.fullmatch(r"[A-Za-z]([A-Za-z0-9]|_(?!_))*", text) is not None and not text.endswith("_")


@dataclass(frozen=True, slots=True)
class NodeConfig:
    """What the nodes need beside the settings of the core."""

    map_frame: str = "map"
    """Frame of the map."""
    odom_frame: str = "odom"
    """Frame in which the wheels' odometry drifts."""
    base_frame: str = "base_link"
    """Frame of the robot's base."""
    frame_prefix: str = ""
    """Put before the three frames, such as "robot1/", where several robots share one /tf."""
    odometry: str = "topic"
    """Where the odometry comes from: "topic" (odom), "tf" (the transform from odom_frame to base_frame) or "none"."""
    mount_from_tf: bool = True
    """The lidar's place comes from the transforms; off, from lidar.mount_x, mount_y, mount_yaw and upside_down."""
    upside_down: bool = False
    """The lidar hangs upside down; used where mount_from_tf is off."""
    publish_tf: bool = True
    """Publish the transform from map_frame to odom_frame, or to base_frame where odometry is "none"."""
    tf_period: float = 0.05
    """Time between two of these transforms, s."""
    tf_ahead: float = 0.1
    """The transform is stamped this far ahead, s, so that it is there for whoever asks for now."""
    map_period: float = 1.0
    """Corners and walls are published this often while they change, s."""
    grid_period: float = 5.0
    """The occupancy grid is published this often while it changes, s; 0 for never."""
    grid_resolution: float = 0.05
    """Side of its cells, m."""
    ellipse_sigmas: float = 3.0
    """Half axes of the drawn ellipses, in standard deviations."""
    map_file: str = ""
    """slam keeps its map here, saved by itself, and continues it where it is there; localization needs it."""
    robot: str = ""
    """The robot's file, robot.yaml: its lidar's range and its wheels' noise are then used, unless given here."""
    fleet: str = ""
    """slam tells a fleet server what it maps, under this name of the robot: several_robots.md; empty for not at all."""
    common_frame: str = "common_map"
    """Frame of a map that robots share; its number is put after it."""
    view_port: int = 0
    """Port at which the node serves the live page, for a browser (docs/view.md); 0 for no page."""
    view_host: str = HOST
    """Address to serve it at; 0.0.0.0 for the whole network: the link, which the node logs, then has a secret in it."""

    def __post_init__(self) -> None:
        if self.odometry not in ("topic", "tf", "none"):
            raise ConfigError(f'parameter odometry must be "topic", "tf" or "none", got {self.odometry!r}')
        for name in ("tf_period", "map_period", "grid_resolution", "ellipse_sigmas"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ConfigError(f"parameter {name} must be a positive number, got {getattr(self, name)!r}")
        if not 0 <= self.view_port < 65536:
            raise ConfigError(f"parameter view_port must lie between 0 and 65535, got {self.view_port!r}")
        if not self.view_port and self.view_host != HOST:
            raise ConfigError("parameter view_host says where the page is served that view_port asks for; give both")
        if self.fleet and not is_name(self.fleet):
            raise ConfigError(
                f"parameter fleet names the robot by letters, digits and _, first no digit, got {self.fleet!r}"
            )

    def frame(self, name: str) -> str:
        """Put the prefix before one of the frames' names."""
        return self.frame_prefix + name


@dataclass(frozen=True, slots=True)
class Settings:
    """All parameters of a node."""

    node: NodeConfig = field(default_factory=NodeConfig)
    core: Config = field(default_factory=lambda: dataclasses.replace(DEFAULTS, back_end="graph"))
    live: LiveConfig = field(default_factory=LiveConfig)


# What stands at the top level, and what has a name of its own before it.
_PREFIXES = {"node": "", "core": "", "live": "live."}


def declared(node: "Node") -> Settings:
    """Declare all parameters at a node, and read them.

    Raises
    ------
    ConfigError
        If a value is of the wrong type or out of range; the message names it.
    """
    defaults = Settings()
    return Settings(**{
        name: declare(node, getattr(defaults, name), prefix) for name, prefix in _PREFIXES.items()
    })  # fmt: skip


def declare(node: "Node", default: T, prefix: str = "") -> T:
    """Declare the fields of a configuration as parameters of a node, and read them.

    Parameters
    ----------
    node : Node
    default : dataclass
        Its values are the defaults, and the strings after its fields what they mean.
    prefix : str
        Before each name.

    Raises
    ------
    ConfigError
        If a value is of the wrong type or out of range; the message names it.
    """
    from rcl_interfaces.msg import ParameterDescriptor

    values: dict[str, Any] = {}
    for name, value, meaning in _fields(default):
        if dataclasses.is_dataclass(value):
            values[name] = declare(node, value, f"{prefix}{name}.")
            continue
        # Numbers are read by hand, for ROS takes 1 for no float; and nothing can be changed while a map is being made.
        descriptor = ParameterDescriptor(description=meaning, read_only=True, dynamic_typing=True)
        given = node.declare_parameter(prefix + name, value, descriptor).value
        if isinstance(value, float) and isinstance(given, int) and not isinstance(given, bool):
            given = float(given)
        if type(given) is not type(value):
            raise ConfigError(f"parameter {prefix}{name} must be a {type(value).__name__}, got {given!r}")
        values[name] = given
    return type(default)(**values)


def _fields(config: object) -> Iterator[tuple[str, Any, str]]:
    """Yield name, value and meaning of each field; plain ones first, as YAML reads best."""
    meanings = {}
    for kind in filter(dataclasses.is_dataclass, type(config).__mro__):
        (body,) = (n for n in ast.parse(inspect.getsource(kind)).body if isinstance(n, ast.ClassDef))
        for statement, following in zip(body.body, body.body[1:], strict=False):
            if isinstance(statement, ast.AnnAssign) and isinstance(following, ast.Expr):
                meanings[ast.unparse(statement.target)] = str(ast.literal_eval(following.value))
    rows = [(f.name, getattr(config, f.name), meanings.get(f.name, "")) for f in dataclasses.fields(config)]  # type: ignore[arg-type]  # any dataclass
    yield from sorted(rows, key=lambda row: dataclasses.is_dataclass(row[1]))


def parameters_yaml() -> str:
    """Give the default parameters as the YAML file that ROS reads, with what each means."""
    lines = [
        "# All parameters of slam and localization with their defaults, in SI units unless a name says otherwise.",
        "# Written by `python3 -m contourslam_ros.settings`.",
        "/**:",
        "  ros__parameters:",
        "    use_sim_time: false",
    ]
    defaults = Settings()
    lines += yaml_lines(defaults.node, "    ") + yaml_lines(defaults.core, "    ")
    lines += ["    live:", *yaml_lines(defaults.live, "      ")]
    return "\n".join(lines) + "\n"


def yaml_lines(config: object, indent: str) -> list[str]:
    """Give the fields of a configuration as lines of YAML, each below what it means."""
    lines = []
    for name, value, meaning in _fields(config):
        if dataclasses.is_dataclass(value):
            lines += [f"{indent}{name}:", *yaml_lines(value, indent + "  ")]
        else:
            lines += [f"{indent}# {meaning}", f"{indent}{name}: {_yaml(value)}"]
    return lines


def _yaml(value: object) -> str:
    if isinstance(value, float):
        return repr(value) if math.isfinite(value) else ".inf"
    return json.dumps(value)


if __name__ == "__main__":
    sys.stdout.write(parameters_yaml())
