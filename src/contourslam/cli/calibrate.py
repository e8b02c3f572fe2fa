"""``contourslam calibrate``: the group of commands that find out how a robot is built."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from contourslam.cli.calibrate_base import CalibrateBase
from contourslam.cli.calibrate_camera import CalibrateCamera
from contourslam.cli.calibrate_extrinsics import CalibrateExtrinsics

# Each says in its own module what it does.
_Base = Annotated[CalibrateBase, tyro.conf.subcommand(name="base", prefix_name=False)]
_Camera = Annotated[CalibrateCamera, tyro.conf.subcommand(name="camera", prefix_name=False)]
_Extrinsics = Annotated[CalibrateExtrinsics, tyro.conf.subcommand(name="extrinsics", prefix_name=False)]


@dataclass(frozen=True)
class Calibrate:
    """Find out how a robot is built: its wheels, the lens of its camera, and where the camera sits beside the lidar.

    `contourslam calibrate camera --help` and the others explain each.

    Example: contourslam calibrate camera out/pictures --board 9x6 --square 0.025 -o camera.yaml
    """

    what: _Base | _Camera | _Extrinsics

    def execute(self, command: str) -> int:
        """Do the chosen calibration."""
        return self.what.execute(command)
