"""Where a robot was found: the map, what it saw laid into it, its pose, and where else it may be."""

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.poses import transform
from contourslam.localization.known_map import KnownMap
from contourslam.localization.posterior import Located
from contourslam.localization.view import View
from contourslam.report.svg.axes import Axes
from contourslam.report.svg.colours import BLUE, GREY, INK, ORANGE, PURPLE, VERMILION
from contourslam.report.svg.drawing import Drawing, drawing
from contourslam.report.svg.way import axes_around

Floats = NDArray[np.float64]

_ROBOT = np.array([[0.3, 0.0], [-0.2, 0.18], [-0.2, -0.18], [0.3, 0.0]])  # m, in the frame of the base: an arrow head


def place_drawing(known: KnownMap, located: Located, view: View) -> Drawing:
    """Draw the map and the robot in it; the map alone where it was not found.

    Parameters
    ----------
    known : KnownMap
    located : Located
        Within the map.
    view : View
        What the robot saw.
    """
    walls = known.landmarks.end_points
    found = bool(np.isfinite(located.pose).all())
    seen = transform(located.pose, view.points[:, :2]) if found else np.empty((0, 2))
    axes = axes_around(np.concatenate([known.points[:, :2], walls.reshape(-1, 2), seen]))
    axes.dots(known.points[:, :2], GREY, 1.4)
    axes.segments(walls, BLUE, 1.2)
    legend = [("contours of the map", GREY), ("wall", BLUE)]
    if found:
        axes.dots(seen, VERMILION, 2.4)
        for other in located.runners_up:
            _robot(axes, other.pose, PURPLE)
        _robot(axes, located.pose, INK)
        legend += [("scan", VERMILION), (f"robot ({located.probability:.0%})", INK)]
        legend += [("runners-up", PURPLE)] if located.runners_up else []
    else:
        legend.append(("the robot was not found", ORANGE))
    axes.legend(legend)
    return drawing([axes])


def _robot(axes: Axes, pose: Floats, colour: str) -> None:
    outline = transform(pose, _ROBOT)
    axes.line(outline[:, 0], outline[:, 1], colour, 2.0)
    axes.dots(outline[:1], colour, 5.0)
