"""What robots and the fleet server speak on, and with which quality of service."""

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
    return f"{ANSWERS}/{robot}"


def packet(data: bytes) -> FleetPacket:
    """Put bytes into a message."""
    return FleetPacket(data=array("B", data))
