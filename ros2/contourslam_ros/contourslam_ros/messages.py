"""Poses, maps and diagnostics as ROS messages."""

import math
from array import array
from collections.abc import Iterable

import numpy as np
from builtin_interfaces.msg import Time
from contourslam_msgs.msg import Corner, LandmarkMap, Wall
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, PoseWithCovarianceStamped, Quaternion, TransformStamped
from nav_msgs.msg import OccupancyGrid as GridMessage
from numpy.typing import NDArray
from std_msgs.msg import Header

from contourslam.live.diagnostics import Diagnostic
from contourslam.report.occupancy import OccupancyGrid
from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]


def header(stamp: Time, frame: str) -> Header:
    """Make a header."""
    return Header(stamp=stamp, frame_id=frame)


def quaternion(heading: float) -> Quaternion:
    """Turn a heading, rad, into a quaternion about the z axis."""
    return Quaternion(z=math.sin(heading / 2.0), w=math.cos(heading / 2.0))


def pose_message(head: Header, pose: Floats, covariance: Floats) -> PoseWithCovarianceStamped:
    """Make the pose of the base with its covariance: x, y and the turn about z; the rest of the 6 by 6 matrix is zero.

    Parameters
    ----------
    head : Header
    pose : ndarray, shape (3,)
        m, m, rad.
    covariance : ndarray, shape (3, 3)
    """
    message = PoseWithCovarianceStamped(header=head)
    message.pose.pose.position.x, message.pose.pose.position.y = float(pose[0]), float(pose[1])
    message.pose.pose.orientation = quaternion(float(pose[2]))
    full = np.zeros((6, 6))
    full[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
    message.pose.covariance = full.ravel()
    return message


def transform_message(head: Header, child: str, pose: Floats) -> TransformStamped:
    """Make the transform to a child frame that stands at `pose` (m, m, rad) in the header's frame."""
    message = TransformStamped(header=head, child_frame_id=child)
    message.transform.translation.x, message.transform.translation.y = float(pose[0]), float(pose[1])
    message.transform.rotation = quaternion(float(pose[2]))
    return message


def landmark_message(head: Header, corners: CornerMap, walls: WallMap) -> LandmarkMap:
    """Make the map of corners and walls."""
    message = LandmarkMap(header=head)
    for i in range(len(corners.ids)):
        message.corners.append(
            Corner(
                id=int(corners.ids[i]),
                x=float(corners.positions[i, 0]),
                y=float(corners.positions[i, 1]),
                covariance=corners.covariances[i].ravel(),
                direction=float(corners.directions[i]),
                opening=float(corners.openings[i]),
                convex=bool(corners.convex[i]),
                observed=int(corners.observed[i]),
                failed=int(corners.failed[i]),
            )
        )
    for i in range(len(walls.ids)):
        message.walls.append(
            Wall(
                id=int(walls.ids[i]),
                ends=[Point(x=float(x), y=float(y)) for x, y in walls.end_points[i]],
                normal=float(walls.normals[i]),
                covariance=walls.line_covariances[i].ravel(),
                observed=int(walls.observed[i]),
                failed=int(walls.failed[i]),
            )
        )
    return message


def grid_message(head: Header, grid: OccupancyGrid) -> GridMessage:
    """Make the occupancy grid: 0 free, 100 occupied, -1 unknown."""
    cells, (x, y) = grid.cells()
    message = GridMessage(header=head)
    message.info.map_load_time = head.stamp
    message.info.resolution = grid.resolution
    message.info.height, message.info.width = cells.shape
    message.info.origin.position.x, message.info.origin.position.y = x, y
    message.data = array("b", cells.tobytes())
    return message


def diagnostic_message(head: Header, node: str, diagnostics: Iterable[Diagnostic]) -> DiagnosticArray:
    """Make the diagnostics of a node, each under the node's name."""
    return DiagnosticArray(
        header=head,
        status=[
            DiagnosticStatus(
                level=bytes([int(one.level)]),
                name=f"{node}: {one.name}",
                message=one.message,
                hardware_id=node,
                values=[KeyValue(key=key, value=value) for key, value in one.values.items()],
            )
            for one in diagnostics
        ],
    )
