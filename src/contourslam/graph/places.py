"""Local maps that are finished: the places of the graph, each moving with the keyframe that is its anchor."""

from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.poses import between_one, compose, compose_one
from contourslam.matching.cell_map import CellMap


@dataclass(frozen=True, slots=True)
class Place:
    """A finished local map.

    Attributes
    ----------
    anchor : int
        Keyframe that it moves with.
    pose : ndarray, shape (3,)
        The anchor in the frame of `cells`, which is that of the contour odometry.
    cells : CellMap
    node : int
        Its number in the tree of doubt.
    centre : ndarray, shape (3,)
        Middle of the robot's way through it, seen from the anchor.
    """

    anchor: int
    pose: Floats
    cells: CellMap
    node: int
    centre: Floats


class Places:
    """All finished local maps and where they are thought to be; changed in place.

    Attributes
    ----------
    list : list of Place
    anchors : ndarray, shape (n, 3)
        Poses of their anchors in the world.
    """

    def __init__(self) -> None:
        self.list: list[Place] = []
        self.anchors: Floats = np.empty((0, 3))
        self._offsets: Floats = np.empty((0, 3))
        self._centres: Floats = np.empty((0, 3))

    def __len__(self) -> int:
        return len(self.list)

    def add(self, place: Place, anchor_pose: Floats) -> None:
        """Take in a place whose anchor lies at `anchor_pose` in the world."""
        self.list.append(place)
        self._offsets = np.vstack([self._offsets, place.centre])
        self.move(np.vstack([self.anchors, anchor_pose]))

    def move(self, anchors: Floats) -> None:
        """Say anew where all anchors lie."""
        self.anchors, self._centres = anchors, compose(anchors, self._offsets)

    def near(self, pose: Floats, until: int, reach: float) -> Ints:
        """Numbers of the places before number `until` whose middle lies within `reach` (m), nearest first."""
        centres = self._centres[: max(until, 0)]
        squared = (centres[:, 0] - pose[0]) ** 2 + (centres[:, 1] - pose[1]) ** 2
        inside = np.flatnonzero(squared < reach * reach)
        return inside[np.argsort(squared[inside], kind="stable")]

    def into(self, number: int, pose: Floats) -> Floats:
        """Pose in the world as a pose in the frame of the place's cells."""
        return compose_one(self.list[number].pose, between_one(self.anchors[number], pose))

    def from_anchor(self, number: int, pose: Floats) -> Floats:
        """Pose in the frame of the place's cells, as seen from its anchor."""
        return between_one(self.list[number].pose, pose)

    def centre(self, number: int) -> Floats:
        """Middle of the robot's way through a place, in the world."""
        centre: Floats = self._centres[number]
        return centre

    def chain(self, number: int) -> range:
        """The place, the one before and the one after: they share the frame of their cells."""
        return range(max(number - 1, 0), min(number + 2, len(self.list)))
