"""A process that rehearses a robot's part of a fleet; prints the kernels that its drive needs all the same."""

import json
import sys

import numpy as np

from contourslam.fleet.facts import Answer
from contourslam.fleet.rehearsal import rehearse_robot
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.wire import decode, encode
from contourslam.graph.slam import GraphSlam
from contourslam.live.warming import warm_up
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.long_drive import building_drive
from contourslam_ros.settings import Settings


def kernels() -> set[str]:
    """Name what is compiled, or has come from the cache, with its types."""
    found = set()
    for name in [name for name in sys.modules if name.startswith("contourslam.")]:
        for value in vars(sys.modules[name]).values():
            if hasattr(value, "py_func"):
                found |= {f"{value.py_func.__module__}.{value.py_func.__name__}{types}" for types in value.signatures}
    return found


config, drive = Settings().core, building_drive(40.0, seed=3)
warm_up(config, GraphSlam(config))
rehearse_robot(config)
before = kernels()
slam, robot = GraphSlam(config, lidar_mount=drive.lidar_mount), Reporter("robot")
told = 0
for message in drive.messages():
    if isinstance(message, Odometry):
        slam.push_odometry(message)
    elif isinstance(message, LaserScan):
        robot.push(slam, slam.push_scan(message), message.stamp)
        told += len(robot.due(message.stamp))
        answer = Answer("robot", robot.run or 0, told // 2, (), 1, ("robot", "other"), told // 4, np.ones(3), np.eye(3))
        heard = decode(encode(answer))
        assert isinstance(heard, Answer)
        robot.answered(heard)
robot.flush(message.stamp)
assert robot.placed() is not None
NOT_ON_A_ROBOT = "contourslam.simulation."
late = sorted(name for name in kernels() - before if not name.startswith(NOT_ON_A_ROBOT))
sys.stdout.write(json.dumps(late))
