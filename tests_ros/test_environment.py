"""What the other tests stand on: rclpy, the built messages, and two processes that hear each other."""

import subprocess
import sys
import time

import rclpy
from contourslam_msgs.msg import LandmarkMap
from contourslam_msgs.srv import LoadMap, SaveMap
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

SPEAKER = """
import time, rclpy
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage
rclpy.init()
node = rclpy.create_node("speaker")
publisher = node.create_publisher(TFMessage, "/tf", 10)
while True:
    publisher.publish(TFMessage(transforms=[TransformStamped(child_frame_id="spoken")]))
    time.sleep(0.02)
"""


def test_the_built_messages_hold_what_they_say() -> None:
    assert LandmarkMap().corners == []
    assert SaveMap.Request(path="a").path == LoadMap.Request(path="a").path


def test_a_transform_crosses_between_two_processes(ros: None) -> None:
    node = rclpy.create_node("listener")
    heard: list[TransformStamped] = []
    node.create_subscription(TFMessage, "/tf", lambda message: heard.extend(message.transforms), 10)
    speaker = subprocess.Popen([sys.executable, "-c", SPEAKER])
    try:
        end = time.monotonic() + 20.0
        while not heard and time.monotonic() < end:
            rclpy.spin_once(node, timeout_sec=0.1)
    finally:
        speaker.kill()
        speaker.wait()
        node.destroy_node()
    assert heard and heard[0].child_frame_id == "spoken"
