"""The robot in the loop: the map it made over the true room, and the way it took itself to drive over the true one."""

import numpy as np
from numpy.typing import NDArray

from contourslam.report.svg.colours import BLUE, FAINT, INK, ORANGE, SHEET, VERMILION
from contourslam.report.svg.drawing import Drawing, drawing
from contourslam.report.svg.way import axes_around, corner_order, sampled
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
    poses = known_then(result)
    axes = axes_around(np.concatenate([outline.reshape(-1, 2), truth[:, :2], poses[:, :2]]))
    with axes.layer("room"):
        axes.segments(outline, FAINT, 5.0)
    with axes.layer("walls"):
        axes.segments(result.wall_map.end_points, BLUE, 1.6)
    with axes.layer("corners"):
        axes.squares(result.corner_map.positions[corner_order(result)], SHEET, VERMILION)
    with axes.layer("truth"):
        axes.trace(truth[:: max(1, len(truth) // 2000)], ORANGE, 3.0)
    with axes.layer("way"):
        axes.trace(poses[sampled(len(poses))], INK, 0.9)
    axes.legend(
        [("the room", FAINT, "room", True), ("wall mapped", BLUE, "walls", True),
         ("corner mapped", VERMILION, "corners", True), ("true way", ORANGE, "truth", True),
         ("way by the robot's own poses", INK, "way", True)]
    )  # fmt: skip
    return drawing([axes])


def known_then(result: RunResult) -> Floats:
    """Poses as they were known at the time, shape (t, 3)."""
    return result.poses if result.online_poses is None else result.online_poses
