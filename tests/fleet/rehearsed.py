"""A process that rehearses a fleet, or a robot of one, and then plays it; prints what is compiled all the same."""

import json
import sys

import numpy as np

from contourslam.config import Config
from contourslam.fleet.facts import Answer
from contourslam.fleet.play import play
from contourslam.fleet.play_robot import Player
from contourslam.fleet.rehearsal import rehearse, rehearse_robot
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.wire import decode, encode
from contourslam.graph.slam import GraphSlam
from contourslam.live.warming import warm_up
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.long_drive import building_drive


def kernels() -> set[str]:
    """Name what is compiled, or has come from the cache, with its types: in memory both are the same."""
    found = set()
    for name in [name for name in sys.modules if name.startswith("contourslam.")]:
        for value in vars(sys.modules[name]).values():
            if hasattr(value, "py_func"):
                found |= {f"{value.py_func.__module__}.{value.py_func.__name__}{types}" for types in value.signatures}
    return found


def play_fleet(config: Config) -> None:
    drive = building_drive(30.0, seed=3)
    fleet = play([Player(name, drive.messages(), drive.lidar_mount) for name in ("one", "two")], config)
    assert len(fleet.maps) == len(fleet.joined) == 1


def play_robot(config: Config) -> None:
    """Tell of a drive, and hear what a server elsewhere would answer."""
    drive = building_drive(40.0, seed=3)
    slam, robot = GraphSlam(config, lidar_mount=drive.lidar_mount), Reporter("robot")
    told = 0
    for message in drive.messages():
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            now = message.stamp
            robot.push(slam, slam.push_scan(message), now)
            told += len(robot.due(now))
            received, last = told // 2, told // 4
            said = Answer("robot", robot.run or 0, received, (), 1, ("robot", "other"), last, np.ones(3), np.eye(3))
            heard = decode(encode(said))
            assert isinstance(heard, Answer)
            robot.answered(heard)
    robot.flush(now)
    assert robot.placed() is not None


config = Config(back_end="graph")
rehearsal, work = {"fleet": (rehearse, play_fleet), "robot": (rehearse_robot, play_robot)}[sys.argv[1]]
warm_up(config, GraphSlam(config))
rehearsal(config)
before = kernels()
work(config)
late = sorted(name for name in kernels() - before if not name.startswith("contourslam.simulation."))
sys.stdout.write(json.dumps(late))
