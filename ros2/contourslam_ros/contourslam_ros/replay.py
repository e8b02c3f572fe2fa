"""Node ``replay``: maps a bag at full speed, without playing it, and writes what ``contourslam run`` writes."""

import sys
import tempfile
from pathlib import Path

import rclpy
from rclpy.node import Node

from contourslam.cli import main as contourslam
from contourslam.errors import ContourslamError
from contourslam.settings_file import write_settings
from contourslam_ros.settings import declared


def _arguments(node: Node) -> list[str]:
    """Say with which options of ``contourslam run`` the parameters are met."""
    bag, output = (str(node.declare_parameter(name, "").value) for name in ("bag", "output"))
    if not (bag and output):
        raise ContourslamError("replay needs the parameters bag (what to map) and output (the folder to write)")
    arguments = ["run", bag, "--output", output]
    for name in ("scan_topic", "odometry_topic"):
        if topic := str(node.declare_parameter(name, "").value):
            arguments += [f"--{name.replace('_', '-')}", topic]
    return arguments + [f"--{name}" for name in ("overwrite", "grid") if node.declare_parameter(name, False).value]


def main() -> int:
    """Map the bag, and give the exit code of ``contourslam run``."""
    rclpy.init(args=sys.argv)
    node = rclpy.create_node("replay")
    try:
        arguments, settings = _arguments(node), declared(node)
    except ContourslamError as error:
        node.get_logger().fatal(str(error))
        return 2
    finally:
        node.destroy_node()
        rclpy.try_shutdown()  # nothing is heard or said while the bag is mapped, and Ctrl-C is the command's own
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "config.yaml"
        write_settings(config, settings.core)
        return contourslam([*arguments, "--config", str(config)])


if __name__ == "__main__":
    sys.exit(main())
