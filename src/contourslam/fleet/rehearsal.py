"""A robot and a fleet server rehearsed in one process, so that nothing is compiled while robots map or wait."""

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

ROUNDS = 1.2  # of the ring of corridors that is made up


def rehearse_robot(config: Config) -> None:
    """Let a robot tell of a made-up ring of corridors, and be answered as it drives.

    Parameters
    ----------
    config : Config
        Of its mapping, with the graph.
    """
    robot = Reporter("one")
    for now in _mapped(config, [robot]):
        robot.due(now)
        said = Answer(robot.robot, robot.run or 0, 0, (0,), 1, (robot.robot,), 0, np.zeros(3), np.eye(3))
        _answer(robot, said)
        robot.placed()
    robot.flush(now)
    robot.due(now)


def rehearse(config: Config) -> None:
    """Let two robots tell a server of a made-up ring of corridors: joined, answered, solved and drawn up.

    Parameters
    ----------
    config : Config
        Of the robots' mapping, with the graph.
    """
    server, robots = FleetServer(), [Reporter("one"), Reporter("two")]
    *_, now = _mapped(config, robots)
    for robot in robots:
        robot.flush(now)
    while not all(robot.settled for robot in robots):
        now += 1.0  # no robot sends faster than a radio may
        for robot in robots:
            for data in robot.due(now):
                server.push(data)
        for answer in server.answers():
            for robot in robots:
                _answer(robot, answer)
    server.flush(now)
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
