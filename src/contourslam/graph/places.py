"""Stretches of the drive that are over: the places of the graph, each moving with the keyframe that is its anchor."""

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.poses import between, between_one, compose, compose_one
from contourslam.matching.align import align
from contourslam.matching.cell_map import CellMap
from contourslam.matching.certainty import Hold, hold, match_covariance
from contourslam.matching.odometry import LocalMap
from contourslam.matching.oriented import move

ROBUST_TIES = 3.0  # width of the Cauchy kernel of a tie to a place seen before, in standard deviations
# What is taken to be known of where a keyframe lies in a place, and how far a tie may contradict it: m, m, rad.
SIGMA, FARTHEST = np.array([0.1, 0.1, 0.05]), np.array([0.3, 0.3, 0.1])
PRIOR = np.diag(1.0 / SIGMA**2)
KEPT = 48  # places whose contours are held ready; those of others are put together again from their keyframes


@dataclass(frozen=True, slots=True)
class Keyframe:
    """A scan that stands for those around it.

    Attributes
    ----------
    stamp : float
        s.
    local : ndarray, shape (3,)
        Base in the frame of the contour odometry.
    oriented : ndarray of float32, shape (n, 4)
        Contour points and normals in the frame of the base.
    blur : float
        Variance of its heading from turns during the scan that are not known, rad^2.
    drive : int
        Number of its drive: the contour odometry knows nothing of what lies between two drives.
    """

    stamp: float
    local: Floats
    oriented: np.ndarray
    blur: float = 0.0
    drive: int = 0


@dataclass(frozen=True, slots=True)
class Place:
    """A finished local map.

    Attributes
    ----------
    anchor : int
        Keyframe that it moves with.
    members : tuple of int
        Keyframes whose contours it holds.
    seen : ndarray, shape (n, 3)
        Their poses seen from the anchor.
    node : int
        Its number in the tree of doubt.
    """

    anchor: int
    members: tuple[int, ...]
    seen: Floats
    node: int


class Places:
    """All places and where they are thought to be; changed in place.

    Parameters
    ----------
    keyframes : list of Keyframe
        All keyframes; grows elsewhere.
    half_width : float
        Contours farther than this from an anchor are left out, along x or y, m.

    Attributes
    ----------
    list : list of Place
    anchors : ndarray, shape (n, 3)
        Poses of their anchors in the world.
    of_before : int
        How many there were when this drive began.
    """

    def __init__(self, keyframes: list[Keyframe], half_width: float) -> None:
        self.list: list[Place] = []
        self.of_before = 0
        self._keyframes, self._half_width = keyframes, half_width
        self._ready: OrderedDict[int, CellMap] = OrderedDict()
        self._holds: dict[int, Hold] = {}
        self._anchors: Floats = np.empty((16, 3))
        self._offsets: Floats = np.zeros((16, 3))
        self._centres: Floats = np.empty((16, 3))
        self.nodes: Ints = np.empty(16, np.int64)

    def __len__(self) -> int:
        return len(self.list)

    def left(self, apart: int) -> int:
        """How many places the robot has left behind: those of this drive but the newest, and all of earlier drives."""
        return max(len(self.list) - apart, self.of_before)

    @property
    def anchors(self) -> Floats:
        """Poses of the anchors in the world, shape (n, 3)."""
        return self._anchors[: len(self.list)]

    def add(self, local: LocalMap, node: int, anchor_pose: Floats) -> None:
        """Take in a local map that is finished, whose anchor lies at `anchor_pose` in the world."""
        way = np.array([self._keyframes[m].local for m in local.members])
        self.put(Place(local.anchor, tuple(local.members), between(local.pose, way), node), anchor_pose)

    def put(self, place: Place, anchor_pose: Floats) -> None:
        """Take in a place, whose anchor lies at `anchor_pose` in the world."""
        n = len(self.list)
        if n == len(self._anchors):
            for name in ("_anchors", "_offsets", "_centres", "nodes"):
                old = getattr(self, name)
                setattr(self, name, np.concatenate([old, np.zeros_like(old)]))
        self.list.append(place)
        self._offsets[n, :2] = place.seen[:, :2].mean(axis=0)
        self._anchors[n], self._centres[n] = anchor_pose, compose(anchor_pose, self._offsets[n])
        self.nodes[n] = place.node

    def move(self, anchors: Floats) -> None:
        """Say anew where all anchors lie."""
        n = len(self.list)
        self._anchors[:n], self._centres[:n] = anchors, compose(anchors, self._offsets[:n])

    def near(self, pose: Floats, until: int, reach: float) -> tuple[Ints, Floats]:
        """Places before number `until` whose middle lies within `reach` (m), nearest first, and how far it is."""
        centres = self._centres[: max(until, 0)]
        distance = np.hypot(centres[:, 0] - pose[0], centres[:, 1] - pose[1])
        inside = np.flatnonzero(distance < reach)
        order = inside[np.argsort(distance[inside], kind="stable")]
        return order, distance[order]

    def cells(self, number: int) -> CellMap:
        """Contours of a place, in the frame of its anchor."""
        if number in self._ready:
            self._ready.move_to_end(number)
            return self._ready[number]
        place = self.list[number]
        cells = CellMap(np.zeros(2), self._half_width)
        for member, seen in zip(place.members, place.seen, strict=True):
            cells.insert(self._keyframes[member].oriented, seen)
        self._ready[number] = cells
        if len(self._ready) > KEPT:
            self._ready.popitem(last=False)
        return cells

    def tie(self, number: int, key: int, guess: Floats, least: float) -> tuple[Floats, Floats] | None:
        """Align a keyframe to a place in which it is thought to lie.

        Parameters
        ----------
        number, key : int
            Of the place, and of the keyframe.
        guess : ndarray, shape (3,)
            The keyframe's pose as seen from the place's anchor.
        least : float
            Part of the keyframe's points that must touch the place.

        Returns
        -------
        (ndarray, ndarray) or None
            The keyframe's pose as seen from the anchor, and its covariance in the keyframe's frame; None where it does
            not fit, or only far from the guess.
        """
        found = align(self._keyframes[key].oriented, self.cells(number), guess, PRIOR)
        off = np.abs(between_one(guess, found.pose))
        if found.overlap < least or not (off < FARTHEST).all():
            return None
        return found.pose, self.match_covariance(number, key, found.pose)

    def match_covariance(self, number: int, key: int, seen: Floats) -> Floats:
        """Covariance of a keyframe's pose as seen from a place's anchor, in the keyframe's frame.

        Parameters
        ----------
        number, key : int
            Of the place, and of the keyframe that was aligned to it.
        seen : ndarray, shape (3,)
            The keyframe's pose as seen from the anchor.
        """
        cells, keyframe, anchor = self.cells(number), self._keyframes[key], np.zeros(3)
        if number not in self._holds:
            first = self._keyframes[self.list[number].anchor]
            self._holds[number] = hold(first.oriented, cells, anchor, inside=True)
        return match_covariance(hold(keyframe.oriented, cells, seen), seen, self._holds[number], anchor, keyframe.blur)

    def around(self, number: int) -> Floats:
        """Contour points of a place, the one before and the one after, in the frame of its anchor: x, y, nx, ny."""
        own = self._keyframes[self.list[number].anchor]
        rows = []
        for n in range(max(number - 1, 0), min(number + 2, len(self.list))):
            other = self._keyframes[self.list[n].anchor]
            if other.drive == own.drive:
                rows.append(move(self.cells(n).points[:, :4], between_one(own.local, other.local)))
        return np.concatenate(rows)

    def into(self, number: int, pose: Floats) -> Floats:
        """Pose in the world, as seen from a place's anchor."""
        return between_one(self._anchors[number], pose)

    def out_of(self, number: int, seen: Floats) -> Floats:
        """Pose seen from a place's anchor, in the world."""
        return compose_one(self._anchors[number], seen)

    def centre(self, number: int) -> Floats:
        """Middle of the robot's way through a place, in the world: x, y, heading of the anchor."""
        centre: Floats = self._centres[number]
        return centre
