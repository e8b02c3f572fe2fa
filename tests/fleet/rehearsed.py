"""A process that rehearses a fleet and then plays one; prints the kernels that are compiled all the same."""

import json
import sys

from contourslam.config import Config
from contourslam.fleet.play import play
from contourslam.fleet.play_robot import Player
from contourslam.fleet.rehearsal import rehearse
from contourslam.graph.slam import GraphSlam
from contourslam.live.warming import warm_up
from contourslam.simulation.long_drive import building_drive


def kernels() -> set[str]:
    """Name what is compiled, or has come from the cache, with its types: in memory both are the same."""
    found = set()
    for name in [name for name in sys.modules if name.startswith("contourslam.")]:
        for value in vars(sys.modules[name]).values():
            if hasattr(value, "py_func"):
                found |= {f"{value.py_func.__module__}.{value.py_func.__name__}{types}" for types in value.signatures}
    return found


config, drive = Config(back_end="graph"), building_drive(30.0, seed=3)
warm_up(config, GraphSlam(config))
rehearse(config)
before = kernels()
fleet = play([Player(name, drive.messages(), drive.lidar_mount) for name in ("one", "two")], config)
assert len(fleet.maps) == len(fleet.joined) == 1
late = sorted(name for name in kernels() - before if not name.startswith("contourslam.simulation."))
sys.stdout.write(json.dumps(late))
