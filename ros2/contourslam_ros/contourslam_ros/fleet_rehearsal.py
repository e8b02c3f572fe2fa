"""A robot and a fleet server rehearsed in one process, so that nothing is compiled while robots map or wait."""

import time
from collections.abc import Iterator, Sequence
from typing import cast

import numpy as np

from contourslam.config import Config
from contourslam.fleet.facts import Answer
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.server import FleetServer
from contourslam.fleet.wire import decode, encode
from contourslam.graph.slam import GraphSlam
from contourslam.live.warming import made_up_drive
from contourslam_ros.settings import Settings

ROUNDS = 1.2  # of the ring of corridors that is made up


def rehearse_robot(config: Config) -> None:
    """Let a robot tell of a made-up ring of corridors, and be answered as it drives.

    Parameters
    ----------
    config : Config
        Of its mapping.
    """
    robot = Reporter("one")
    for now in _mapped(config, [robot]):
        robot.due(now)
        said = Answer(robot.robot, robot.run or 0, 0, (0,), 1, (robot.robot,), 0, np.zeros(3), np.eye(3))
        _answer(robot, said)
        robot.placed()
    robot.flush(now)
    robot.due(now)


def rehearse(config: Config | None = None) -> None:
    """Let two robots tell a server of a made-up ring of corridors: joined, answered, solved and drawn up.

    Parameters
    ----------
    config : Config, optional
        Of the robots' mapping.
    """
    server, robots = FleetServer(), [Reporter("one"), Reporter("two")]
    *_, stamp = _mapped(config or Settings().core, robots)
    for robot in robots:
        robot.flush(stamp)
        for now in range(1000):  # it sends no faster than a radio may
            for data in robot.due(float(now)):
                server.push(data)
            for answer in server.answers():
                _answer(robot, answer)
            if robot.settled:
                break
    server.flush(time.monotonic())
    server.settle()
    server.common_maps()


def _mapped(config: Config, robots: Sequence[Reporter]) -> Iterator[float]:
    """Map a made-up drive, of which all robots tell; yields the stamp of each scan."""
    slam = GraphSlam(config)
    for odometry, scan, _ in made_up_drive(ROUNDS):
        slam.push_odometry(odometry)
        update = slam.push_scan(scan)
        for robot in robots:
            robot.push(slam, update, scan.stamp)
        yield scan.stamp


def _answer(robot: Reporter, answer: Answer) -> None:
    robot.answered(cast(Answer, decode(encode(answer))))
