"""``contourslam calibrate camera``: the lens of a fisheye camera, from pictures of a checkerboard."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from contourslam.cli.options import Json
from contourslam.errors import ConfigError


@dataclass(frozen=True)
class CalibrateCamera:
    """Calibrate the lens of a fisheye camera from pictures of a checkerboard.

    Example: contourslam calibrate camera out/pictures --board 9x6 --square 0.025 -o camera.yaml
    """

    pictures: tyro.conf.Positional[Path]
    """Folder of pictures, or a recording that holds them."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="FILE")]
    """File to write."""
    board: str = "9x6"
    """Inner corners of the checkerboard, along and across."""
    square: float = 0.025
    """Side of one square, m."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Calibrate, and say how well it went."""
        raise ConfigError("not there yet")
