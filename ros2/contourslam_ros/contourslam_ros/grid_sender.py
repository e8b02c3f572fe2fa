"""The occupancy grid, drawn beside the mapping and sent where it has changed and somebody listens."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node

from contourslam.errors import ResultError
from contourslam.live.outlines import Outlines
from contourslam.live.session import Session
from contourslam.report.outline_grid import outline_grid
from contourslam_ros.map_sender import LATCHED
from contourslam_ros.messages import grid_message, header
from contourslam_ros.settings import NodeConfig


class GridSender:
    """Publishes the grid; to draw that of a building takes some tenths of a second, in a thread of its own.

    Parameters
    ----------
    node : Node
    config : NodeConfig
    """

    def __init__(self, node: Node, config: NodeConfig) -> None:
        self._node, self._config = node, config
        self._grids = node.create_publisher(OccupancyGrid, "map", LATCHED)
        self._sent: Outlines | None = None
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="grid")
        self._busy = False

    def send(self, session: Session, mount: np.ndarray) -> None:
        """Begin to draw the grid, if somebody wants it and it has changed; returns at once."""
        if self._busy or not self._grids.get_subscription_count():
            return
        outlines = session.latest_outlines()
        if outlines is not None and outlines is not self._sent and len(outlines.poses):
            self._sent, self._busy = outlines, True
            self._thread.submit(self._draw, outlines, mount)

    def close(self) -> None:
        """End the thread."""
        self._thread.shutdown()

    def _draw(self, outlines: Outlines, mount: np.ndarray) -> None:
        try:
            resolution = self._config.grid_resolution
            grid = outline_grid(outlines.poses, outlines.points, lidar_mount=mount, resolution=resolution)
            now = self._node.get_clock().now().to_msg()
            self._grids.publish(grid_message(header(now, self._config.frame(self._config.map_frame)), grid))
        except ResultError as error:
            self._node.get_logger().error(f"map: {error}", throttle_duration_sec=60.0)
        finally:
            self._busy = False
