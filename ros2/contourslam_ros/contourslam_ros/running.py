"""The life of a node: warm, running, stopped in order, and one line where it cannot go on."""

import gc
import sys
from collections.abc import Callable

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.logging import get_logger

from contourslam.errors import ContourslamError
from contourslam_ros.live_node import LiveNode


def run(make: Callable[[], LiveNode]) -> int:
    """Run a node; give the exit code: 0 where it was told to stop, 1 where it could not go on."""
    rclpy.init(args=sys.argv)
    node = None
    try:
        node = make()
        node.get_logger().info("warming up, which takes a minute when it is the first time on this machine")
        node.warm_up()
        gc.freeze()  # what stays is not looked through again: that would hold up a scan for a tenth of a second
        node.start()
        node.get_logger().info(f"ready: waiting for {' and '.join(node.topics.values())}")
        while rclpy.ok() and node.failure is None:
            rclpy.spin_once(node, timeout_sec=0.5)
        if node.failure is not None:
            raise node.failure
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except ContourslamError as error:
        get_logger("contourslam").fatal(str(error))
        return 1
    finally:
        if node is not None:
            node.stop()
            node.destroy_node()
        rclpy.try_shutdown()
    return 0
