"""A robot and a fleet server rehearsed in one process, so that nothing is compiled while robots wait."""

import time
from typing import cast

from contourslam.config import Config
from contourslam.fleet.facts import Answer
from contourslam.fleet.reporter import Reporter
from contourslam.fleet.server import FleetServer
from contourslam.fleet.wire import decode, encode
from contourslam.graph.slam import GraphSlam
from contourslam.live.warming import made_up_drive
from contourslam_ros.settings import Settings

ROUNDS = 1.2  # of the ring of corridors that is made up


def rehearse(config: Config | None = None) -> None:
    """Let two robots tell a server of a made-up ring of corridors: joined, answered, solved and drawn up.

    Parameters
    ----------
    config : Config, optional
        Of the robots' mapping.
    """
    server, robots = FleetServer(), [Reporter("one"), Reporter("two")]
    slam = GraphSlam(config or Settings().core)
    for odometry, scan, _ in made_up_drive(ROUNDS):
        slam.push_odometry(odometry)
        update = slam.push_scan(scan)
        for robot in robots:
            robot.push(slam, update, scan.stamp)
    for robot in robots:
        robot.flush(scan.stamp)
        for now in range(1000):  # it sends no faster than a radio may
            for data in robot.due(float(now)):
                server.push(data)
            for answer in server.answers():
                robot.answered(cast(Answer, decode(encode(answer))))
            if robot.settled:
                break
    server.flush(time.monotonic())
    server.settle()
    server.common_maps()
