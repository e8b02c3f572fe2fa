"""A process that rehearses and then drives; prints the kernels that the drives had to have compiled all the same."""

import json
import sys
import tempfile
from collections.abc import Iterable
from dataclasses import replace
from itertools import islice
from pathlib import Path

from contourslam.cli.run import DEFAULTS
from contourslam.config import Config
from contourslam.live.rehearsal import stages
from contourslam.recordings import open_recording
from contourslam.replay import Message, replay
from contourslam.simulation.config import YDLIDAR_X4
from contourslam.simulation.long_drive import WheelErrors, building_drive

NOT_ON_A_ROBOT = ("contourslam.simulation.", "contourslam.recordings.")


def types() -> dict[str, set[object]]:
    """The types for which each kernel is there, compiled or from the cache: in memory both are the same."""
    found = {}
    for name in [name for name in sys.modules if name.startswith("contourslam.")]:
        for value in vars(sys.modules[name]).values():
            if hasattr(value, "py_func"):
                found[f"{value.py_func.__module__}.{value.py_func.__name__}"] = set(value.signatures)
    return found


def drives(logs: list[str]) -> Iterable[tuple[list[Message], object]]:
    """Wheels that are good and bad, a lidar that turns clockwise, and beginnings of real logs."""
    for errors, lidar in ((WheelErrors(), YDLIDAR_X4), (WheelErrors(0.15, 0.15, 0.03), YDLIDAR_X4)):
        drive = building_drive(40.0, seed=3, lidar=lidar, wheels=errors)
        yield list(drive.messages()), drive.lidar_mount
    for log in logs:
        recording = open_recording(Path(log))
        yield list(islice(recording.messages(), 1600)), recording.lidar_mount


with tempfile.TemporaryDirectory() as folder:
    for _, stage in stages(Path(folder)):
        stage()
before = types()
for messages, mount in drives(sys.argv[1:]):
    for config in (replace(DEFAULTS, back_end="graph"), replace(DEFAULTS, back_end="ekf"), Config()):
        replay(messages, config, lidar_mount=mount)
late = {name: now - before.get(name, set()) for name, now in types().items()}
late = {name: [str(kind) for kind in kinds] for name, kinds in late.items() if kinds}
robots = {name: kinds for name, kinds in late.items() if not name.startswith(NOT_ON_A_ROBOT)}
sys.stdout.write(json.dumps(robots))
