"""What robots and the fleet server speak on, and with which quality of service."""

import re
from array import array

from contourslam_msgs.msg import FleetPacket
from rclpy.qos import QoSProfile, ReliabilityPolicy

REPORTS, ANSWERS = "/fleet/reports", "/fleet/answers"
# Best effort: what is lost is known by its number and told again, so acknowledgements of the middleware would only be
# told beside those of the fleet, and a server that is away fills no queue.
# Deep enough for what a robot tells after hours alone.
QUALITY = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)


def answers_to(robot: str) -> str:
    """Topic of the answers to one robot: on a topic of all, each would hear those to the others."""
    return f"{ANSWERS}/{in_topic(robot)}"


def in_topic(robot: str) -> str:
    """Give a robot's name as a part of a topic's, for messages allow names that ROS does not: ``robot-1``, ``1a``.

    Letters, digits and ``_`` stay, all else is a ``_``, and before a digit in front stands an ``r``. Two robots may
    come to one topic so; what is said there names the robot.
    """
    return re.sub(r"^(?=[0-9])", "r", re.sub(r"[^A-Za-z0-9_]", "_", robot))


def packet(data: bytes) -> FleetPacket:
    """Put bytes into a message."""
    return FleetPacket(data=array("B", data))
