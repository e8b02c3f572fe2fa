"""Common maps as messages: corners and walls, the robots' ways, and all of them for RViz."""

from collections.abc import Callable, Sequence

import numpy as np
from geometry_msgs.msg import Point, PoseStamped
from nav_msgs.msg import Path
from numpy.typing import NDArray
from rclpy.time import Time
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from contourslam.fleet.shared import Shared
from contourslam_ros.markers import WALL, Colour, map_markers, marker
from contourslam_ros.messages import header, quaternion

Floats = NDArray[np.float64]
# Of the robots in turn; all can be told apart by those who see red and green alike.
COLOURS: tuple[Colour, ...] = (WALL, (0.90, 0.62, 0.0), (0.0, 0.62, 0.45), (0.80, 0.47, 0.65), (0.34, 0.71, 0.91))
NAMED = 0.35  # m, height of a robot's name


def fleet_markers(
    maps: Sequence[Shared], head_of: Callable[[int], Header], sigmas: float, robots: Sequence[str]
) -> MarkerArray:
    """Draw all common maps, each in its frame, in place of all that was drawn before.

    Parameters
    ----------
    maps : sequence of Shared
    head_of : callable
        Gives the header of a common map, by its number.
    sigmas : float
        Half axes of the ellipses in standard deviations.
    robots : sequence of str
        All there are, in the order of their colours.
    """
    drawn = [Marker(action=Marker.DELETEALL)]
    for shared in maps:
        head, within = head_of(shared.number), f"map {shared.number}: "
        saved = shared.saved
        drawn += map_markers(head, saved.corners, saved.walls, sigmas, within).markers
        for number, ((robot, _), _, poses) in enumerate(shared.frames()):
            colour = COLOURS[robots.index(robot) % len(COLOURS)]
            points = [Point(x=x, y=y, z=0.02) for x, y, _ in poses.tolist()]
            if len(points) > 1:
                way = marker(head, f"{within}way of {robot}", Marker.LINE_STRIP, points, 0.03, colour)
                way.id = number
                drawn.append(way)
            if points:
                drawn.append(_name(head, f"{within}names", number, robot, points[-1], colour))
    return MarkerArray(markers=drawn)


def way_message(head: Header, stamps: Floats, poses: Floats) -> Path:
    """Make the way of a robot.

    Parameters
    ----------
    head : Header
    stamps : ndarray, shape (k,)
        s.
    poses : ndarray, shape (k, 3)
        m, m, rad.
    """
    message = Path(header=head)
    for stamp, (x, y, heading) in zip(stamps.tolist(), poses.tolist(), strict=True):
        pose = PoseStamped(header=header(Time(nanoseconds=round(stamp * 1e9)).to_msg(), head.frame_id))
        pose.pose.position.x, pose.pose.position.y = x, y
        pose.pose.orientation = quaternion(heading)
        message.poses.append(pose)
    return message


def _name(head: Header, name: str, number: int, text: str, at: Point, colour: Colour) -> Marker:
    red, green, blue = colour
    made = Marker(header=head, ns=name, id=number, type=Marker.TEXT_VIEW_FACING, text=text)
    made.pose.position = Point(x=at.x, y=at.y + NAMED, z=0.1)
    made.pose.orientation.w = 1.0
    made.scale.z = NAMED
    made.color = ColorRGBA(r=red, g=green, b=blue, a=1.0)
    return made
