"""``contourslam calibrate extrinsics``: where the camera sits beside the lidar."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from contourslam.cli.options import Json
from contourslam.errors import ConfigError


@dataclass(frozen=True)
class CalibrateExtrinsics:
    """Find where the camera sits beside the lidar, from a recording in which a checkerboard stands in several places.

    Example: contourslam calibrate extrinsics out/board --robot robot.yaml --board 9x6 --square 0.05
    """

    recording: tyro.conf.Positional[Path]
    """Recording with scans and pictures."""
    robot: Annotated[Path, tyro.conf.arg(metavar="FILE")]
    """The robot.yaml that holds the camera's lens; the camera's place is written into it."""
    board: str = "9x6"
    """Inner corners of the checkerboard, along and across."""
    square: float = 0.05
    """Side of one square, m."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Calibrate, and say how well it went."""
        raise ConfigError("not there yet")
