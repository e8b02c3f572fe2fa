"""A map made of several: its walls and corners, and the way of each map in a colour of its own."""

from collections.abc import Sequence

import numpy as np

from contourslam.geometry.poses import transform
from contourslam.maps.saved_map import Ints, SavedMap
from contourslam.report.svg.axes import Axes
from contourslam.report.svg.colours import BLUE, FAINT, GREEN, GREY, INK, ORANGE, PURPLE, SKY, VERMILION
from contourslam.report.svg.drawing import Drawing, drawing
from contourslam.report.svg.way import axes_around

_WAYS = (BLUE, ORANGE, GREEN, PURPLE, VERMILION, SKY)
_MOST_POINTS = 60_000  # of contours: the eye cannot tell more


def merged_drawing(
    saved: SavedMap, names: Sequence[str], keys: Sequence[Ints], colours: Sequence[int] | None = None
) -> Drawing:
    """Draw contours, walls and corners, and over them the ways, each a layer; a dot is where each drive begins.

    Parameters
    ----------
    saved : SavedMap
        With keyframes.
    names : sequence of str
        Of the maps that it was made of.
    keys : sequence of ndarray of int
        Keyframes of each.
    colours : sequence of int, optional
        Which colour each gets, so that it has the same one in other drawings; in their order by default.
    """
    keyframes = saved.keyframes
    assert keyframes is not None
    every = [transform(pose, keyframes.contour(i)[:, :2].astype(np.float64)) for i, pose in enumerate(keyframes.poses)]
    points = np.concatenate(every)
    points = points[:: 1 + len(points) // _MOST_POINTS]
    axes = axes_around(np.concatenate([points, saved.walls.end_points.reshape(-1, 2), keyframes.poses[:, :2]]))
    with axes.layer("contours"):
        axes.cloud(points, FAINT, 1.4, 1.0)
    with axes.layer("landmarks"):
        axes.segments(saved.walls.end_points, GREY, 1.6)
        if len(saved.corners.ids):
            axes.squares(saved.corners.positions, GREY, GREY, 3.4)
    legend = [("contour", FAINT, "contours", True), ("wall, corner", GREY, "landmarks", True)]
    for number, name, own in zip(range(len(names)) if colours is None else colours, names, keys, strict=True):
        colour, layer = _WAYS[number % len(_WAYS)], f"way{number}"
        with axes.layer(layer):
            _ways(axes, saved, own, colour)
        legend.append((name, colour, layer, True))
    axes.legend(legend)
    return drawing([axes])


def _ways(axes: Axes, saved: SavedMap, own: Ints, colour: str) -> None:
    keyframes = saved.keyframes
    assert keyframes is not None
    for drive in np.unique(keyframes.drives[own]).tolist():
        way = keyframes.poses[own[keyframes.drives[own] == drive]]
        axes.trace(way, colour, 1.6)
        axes.dots(way[:1, :2], INK, 6.0)
