"""The life of a node: warm, running, stopped in order, and one line where it cannot go on."""

import gc
import signal
import sys
import threading
from collections.abc import Callable
from typing import Any, Protocol

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions

from contourslam.errors import ContourslamError


class Living(Protocol):
    """A node that can be run.

    Attributes
    ----------
    failure : BaseException or None
        Why it cannot go on.
    """

    failure: BaseException | None

    def warm_up(self) -> None:
        """Do what takes long and needs no message."""

    def start(self) -> None:
        """Publish and subscribe."""

    def stop(self) -> None:
        """End what was begun."""

    def destroy_node(self) -> Any:
        """Leave ROS."""


def run(make: Callable[[], Living]) -> int:
    """Run a node; give the exit code: 0 where it was told to stop, 1 where it could not go on."""
    # No exception in the midst of anything: what is being done is done, the map is saved, then the node ends.
    told = threading.Event()
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda number, frame: told.set())
    rclpy.init(args=sys.argv, signal_handler_options=SignalHandlerOptions.NO)
    node = None
    try:
        node = make()
        node.warm_up()
        gc.freeze()  # what stays is not looked through again: that would hold up a scan for a tenth of a second
        node.start()
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        while not told.is_set() and node.failure is None:
            executor.spin_once(timeout_sec=0.2)
        if node.failure is not None:
            raise node.failure
    except ContourslamError as error:
        get_logger("contourslam").fatal(str(error))
        return 1
    finally:
        if node is not None:
            node.stop()
            node.destroy_node()
        rclpy.shutdown()
    return 0
