"""Plays a recording into ROS as a robot would: python player.py PLAN.json, in a process of its own.

It begins when a node listens that has found all that is played.
Stamps are those of the wall clock at which a message belongs, or with `clock` those of the recording, with /clock.
"""

import faulthandler
import json
import math
import sys
import time
from array import array
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Quaternion, TransformStamped
from nav_msgs.msg import Odometry as OdometryMessage
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from rclpy.task import Future
from rclpy.topic_endpoint_info import TopicEndpointInfo
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan as ScanMessage
from tf2_msgs.msg import TFMessage

from contourslam.recordings import open_recording
from contourslam.scan import LaserScan, Odometry
from contourslam_ros.messages import quaternion


@dataclass
class Plan:
    """What is played.

    Attributes
    ----------
    report : str
        File for what was added to the recording's stamps in the first piece (`shift`, s), and how many scans were sent
        (`scans`); written at the end.
    pieces : list of [float, float]
        Which seconds of the recording, one after another.
    silent : list of [str, float, float]
        "scan" or "odom", and the seconds of the playing during which it says nothing.
    yaw, upside_down : float, bool
        How the lidar is turned on the robot, rad; the same drive comes with other angles then.
    mounted : bool
        A transform says where the lidar is.
    standing : bool
        Odometry comes before anybody listens, of a robot that stands.
    begun : str
        File that is waited for as well, for several to begin at once.
    """

    recording: str
    report: str
    namespace: str = ""
    prefix: str = ""
    pieces: list[list[float]] = field(default_factory=lambda: [[0.0, 1e9]])
    silent: list[list[Any]] = field(default_factory=list)
    odometry: str = "topic"
    yaw: float = 0.0
    upside_down: bool = False
    mounted: bool = True
    standing: bool = False
    begun: str = ""
    clock: bool = False
    rate: float = 1.0

    def text(self) -> str:
        """The plan as a file holds it."""
        return json.dumps(asdict(self))

    def played(self) -> dict[str, float]:
        """What was reported."""
        report: dict[str, float] = json.loads(Path(self.report).read_text())
        return report

    @property
    def turn(self) -> Quaternion:
        """Orientation of the lidar on the base: turned about z, after it was turned over about x."""
        upright = quaternion(self.yaw)
        return Quaternion(x=upright.w, y=upright.z, z=0.0, w=0.0) if self.upside_down else upright


def stamp(seconds: float) -> Time:
    whole, nanoseconds = divmod(round(seconds * 1e9), 1_000_000_000)
    return Time(sec=whole, nanosec=nanoseconds)


def scan_message(scan: LaserScan, at: float, frame: str, plan: Plan) -> ScanMessage:
    count = len(scan.ranges)
    message = ScanMessage()
    message.header.stamp, message.header.frame_id = stamp(at), frame
    seen = plan.yaw - scan.angles if plan.upside_down else scan.angles - plan.yaw
    message.angle_min, message.angle_max = float(seen[0]), float(seen[-1])
    message.angle_increment = float(seen[-1] - seen[0]) / (count - 1)
    message.time_increment = float(scan.offsets[-1]) / (count - 1)
    message.scan_time = message.time_increment * count
    message.range_min, message.range_max = scan.range_min, scan.range_max
    message.ranges = array("f", scan.ranges.tolist())
    return message


def transform(at: float, parent: str, child: str, x: float, y: float, turn: Quaternion, z: float = 0.0) -> TFMessage:
    stamped = TransformStamped(child_frame_id=child)
    stamped.header.stamp, stamped.header.frame_id = stamp(at), parent
    place = stamped.transform.translation
    place.x, place.y, place.z = x, y, z
    stamped.transform.rotation = turn
    return TFMessage(transforms=[stamped])


def odometry_message(reading: Odometry, at: float, prefix: str) -> OdometryMessage:
    message = OdometryMessage(child_frame_id=prefix + "base_link")
    message.header.stamp, message.header.frame_id = stamp(at), prefix + "odom"
    message.pose.pose.position.x, message.pose.pose.position.y = reading.pose[:2].tolist()
    message.pose.pose.orientation = quaternion(float(reading.pose[2]))
    return message


def answered(node: Node, topic: str) -> Iterator[None]:
    """Ask a node that listens to a topic; ends when it answers.

    What is made last is found last, and what is sent last comes last: who answers has found all that this node made
    before it asked, without which it would hear nothing of it, and all that was sent before has come.
    """
    listeners: list[TopicEndpointInfo] = []
    while not listeners:
        listeners = [i for i in node.get_subscriptions_info_by_topic(topic) if "UNKNOWN" not in i.node_name]
        yield
    name = f"{listeners[0].node_namespace.rstrip('/')}/{listeners[0].node_name}"
    client = node.create_client(GetParameters, f"{name}/get_parameters")
    answers: list[Future] = []
    asked = -math.inf
    while not any(answer.done() for answer in answers):
        if time.monotonic() > asked + 0.2:  # what was asked before the two had found each other came to nobody
            answers.append(client.call_async(GetParameters.Request()))
            asked = time.monotonic()
        rclpy.spin_once(node, timeout_sec=0.0)
        yield


def play(plan: Plan) -> None:
    messages = [m for m in open_recording(Path(plan.recording)).messages() if isinstance(m, LaserScan | Odometry)]
    # A scan is sent when it is complete, in the order of the recording: when its last beam's odometry is.
    times: list[float] = []
    for message in messages:
        ended = message.stamp + (float(message.offsets[-1]) if isinstance(message, LaserScan) else 0.0)
        times.append(max(ended, times[-1] if times else ended))
    zero = times[0]

    rclpy.init()
    node = rclpy.create_node("player", namespace=plan.namespace)
    clock = node.create_publisher(Clock, "/clock", 10)
    scans = node.create_publisher(ScanMessage, "scan", qos_profile_sensor_data)
    wheels = node.create_publisher(OdometryMessage, "odom", 100)
    moving = node.create_publisher(TFMessage, "/tf", 100)
    still = node.create_publisher(
        TFMessage, "/tf_static", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    )
    if plan.mounted:
        still.publish(transform(0.0, plan.prefix + "base_link", plan.prefix + "laser", 0.1, 0.0, plan.turn, 0.2))
    at_rest = next(message for message in messages if isinstance(message, Odometry))

    def stand() -> None:
        if plan.standing:
            wheels.publish(odometry_message(at_rest, time.time(), plan.prefix))
        time.sleep(0.02)

    for _ in answered(node, scans.topic_name):
        stand()
    while not (
        scans.get_subscription_count()
        and (wheels.get_subscription_count() or plan.odometry != "topic")
        and (not plan.begun or Path(plan.begun).exists())
    ):
        stand()

    began, passed = time.monotonic(), 0.0
    wall = time.time()
    sent = 0
    for first, last in plan.pieces:
        piece = [(t - zero, m) for t, m in zip(times, messages, strict=True) if first <= t - zero < last]
        for since_zero, message in piece:
            playing = passed + since_zero - first
            time.sleep(max(0.0, began + playing / plan.rate - time.monotonic()))
            # With a clock of its own, time runs back where a piece begins before the end of the one before.
            shift = 0.0 if plan.clock else wall - zero - first + passed
            at = message.stamp + shift
            if plan.clock:
                clock.publish(Clock(clock=stamp(since_zero + zero)))
            kind = "scan" if isinstance(message, LaserScan) else "odom"
            if any(name == kind and a <= playing < b for name, a, b in plan.silent):
                continue
            if isinstance(message, LaserScan):
                sent += 1
                scans.publish(scan_message(message, at, plan.prefix + "laser", plan))
            elif plan.odometry == "topic":
                wheels.publish(odometry_message(message, at, plan.prefix))
            elif plan.odometry == "tf":
                px, py, heading = message.pose.tolist()
                moving.publish(
                    transform(at, plan.prefix + "odom", plan.prefix + "base_link", px, py, quaternion(heading))
                )
        passed += min(last, times[-1] - zero) - first
    for _ in answered(node, scans.topic_name):
        time.sleep(0.02)
    Path(plan.report).write_text(
        json.dumps({"shift": 0.0 if plan.clock else wall - zero - plan.pieces[0][0], "scans": sent})
    )
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    faulthandler.dump_traceback_later(200.0, exit=True)  # no plan takes so long
    play(Plan(**json.loads(Path(sys.argv[1]).read_text())))
