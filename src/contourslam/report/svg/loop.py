"""The robot in the loop: the map it made over the true room, and the way it took itself to drive over the true one."""

import numpy as np
from numpy.typing import NDArray

from contourslam.report.svg.axes import BLUE, FAINT, INK, ORANGE, VERMILION
from contourslam.report.svg.drawing import Drawing, drawing
from contourslam.report.svg.way import axes_around
from contourslam.slam.result import RunResult

Floats = NDArray[np.float64]


def loop_drawing(result: RunResult, outline: Floats, truth: Floats) -> Drawing:
    """Draw the room as it is, the walls and corners as mapped, and both ways.

    Parameters
    ----------
    result : RunResult
        With one scan or more.
    outline : ndarray, shape (s, 2, 2)
        Straight sides of all matter at the lidar's height, m.
    truth : ndarray, shape (n, 3)
        True poses, close together.
    """
    poses = result.poses if result.online_poses is None else result.online_poses
    axes = axes_around(np.concatenate([outline.reshape(-1, 2), truth[:, :2], poses[:, :2]]))
    axes.segments(outline, FAINT, 5.0)
    axes.segments(result.wall_map.end_points, BLUE, 1.6)
    axes.squares(result.corner_map.positions, "white", VERMILION)
    way = truth[:: max(1, len(truth) // 2000)]
    axes.line(way[:, 0], way[:, 1], ORANGE, 3.0)
    axes.line(poses[:, 0], poses[:, 1], INK, 0.9)
    axes.legend(
        [("the room", FAINT), ("wall mapped", BLUE), ("corner mapped", VERMILION), ("true way", ORANGE),
         ("way by the robot's own poses", INK)]
    )  # fmt: skip
    return drawing([axes])
