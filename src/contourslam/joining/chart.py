"""A map made ready to be laid on others: tables to search, and views of it, each from one stretch of the drive."""

import math
from collections import OrderedDict
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.errors import MapError
from contourslam.geometry.poses import between, compose, inverse, transform
from contourslam.joining.overlay import Surfaces, surfaces_of
from contourslam.localization.known_map import KnownMap, landmarks_of
from contourslam.localization.view import View, view_of
from contourslam.maps.saved_map import Contoured, SavedMap
from contourslam.matching.cell_map import CellMap
from contourslam.matching.certainty import Hold, hold
from contourslam.matching.constellation import Constellation
from contourslam.matching.oriented import move
from contourslam.matching.squares import numbered, squares_of

WAY = 8.0  # m of the drive that one view is from
SEEN_FROM = 15.0  # m; landmarks and contours farther from the middle of a view are left to other views
MERGED = 0.05  # m; of the points in one cell of this size that look the same way, one is kept
TOUCH = 0.3  # m; a landmark this near to a contour point of a view was seen in it
KEPT = 48  # stretches whose contours are held ready


@dataclass(frozen=True, slots=True)
class StretchView:
    """What was seen on one stretch of the drive.

    Attributes
    ----------
    anchor : int
        Keyframe in the middle of the stretch, in whose frame all is given.
    view : View
        Contour points, and where each was seen from.
    landmarks : Constellation
        Corners and walls that were seen.
    """

    anchor: int
    view: View
    landmarks: Constellation


class Chart:
    """A map made ready. It does not change; what is costly is made when first asked for.

    Attributes
    ----------
    saved : SavedMap
    frames : Contoured
        Its keyframes.
    stretches : tuple of ndarray of int
        Keyframes of each view. A drive that goes on leaves all views but its last as they are.
    way : ndarray, shape (k,)
        Length of the drive up to each keyframe, m; all drives one after the other.

    Parameters
    ----------
    saved : SavedMap

    Raises
    ------
    MapError
        If the map holds no keyframes with contours.
    """

    def __init__(self, saved: SavedMap) -> None:
        frames = saved.keyframes
        if frames is None or not len(frames.points):
            raise MapError(
                "a map without the contours of keyframes cannot be joined to others: map anew with --back-end graph"
            )
        self.saved, self.frames = saved, frames
        steps = np.hypot(*np.diff(frames.poses[:, :2], axis=0).T) * (np.diff(frames.drives) == 0)
        self.way: Floats = np.concatenate([[0.0], np.cumsum(steps)])
        self.stretches = _stretches(frames, self.way)
        self._views: dict[int, StretchView] = {}
        self._places: OrderedDict[int, CellMap] = OrderedDict()
        self._holds: dict[int, Hold] = {}

    @cached_property
    def known(self) -> KnownMap:
        """The map to be localised in."""
        return KnownMap(self.saved)

    @cached_property
    def landmarks(self) -> Constellation:
        """All its corners and walls."""
        return landmarks_of(self.saved)

    @cached_property
    def surfaces(self) -> Surfaces:
        """Its surfaces and where it is empty."""
        return surfaces_of(self.frames, np.arange(len(self.frames)), self.frames.poses)

    def contour(self, keyframe: int) -> Floats:
        """Contour points and normals of a keyframe in its frame, shape (n, 4)."""
        return np.asarray(self.frames.contour(keyframe), np.float64)

    def view(self, number: int) -> StretchView:
        """Give what was seen on one of the stretches."""
        if number not in self._views:
            self._views[number] = self._look_back(self.stretches[number])
        return self._views[number]

    def _look_back(self, members: Ints) -> StretchView:
        anchor = int(members[len(members) // 2])
        back = inverse(self.frames.poses[anchor])
        poses = between(self.frames.poses[anchor], self.frames.poses[members])
        contours = [move(self.contour(int(k)), pose) for k, pose in zip(members, poses, strict=True)]
        points = np.concatenate(contours)
        origins = np.repeat(poses[:, :2], [len(c) for c in contours], axis=0)
        near = np.isfinite(points).all(axis=1) & (np.hypot(points[:, 0], points[:, 1]) < SEEN_FROM)
        points, origins = points[near], origins[near]
        first = np.sort(np.unique(squares_of(points, MERGED), return_index=True)[1])
        view = view_of(points[first], origins[first])
        return StretchView(anchor, view, _among(self.landmarks, back, view.points))

    @cached_property
    def _anchors(self) -> Ints:
        """Keyframes that the places move with."""
        stretches = self.saved.stretches
        if stretches is not None and len(stretches.anchors):
            return stretches.anchors
        return np.array([members[len(members) // 2] for members in self.stretches], np.int64)

    def place_near(self, pose: Floats) -> int:
        """Anchor of the place whose middle is nearest to a pose in the map."""
        return int(self._anchors[np.argmin(np.hypot(*(self._middles - np.asarray(pose)[:2]).T))])

    @cached_property
    def _middles(self) -> Floats:
        return np.array([self._members(int(a))[1][:, :2].mean(axis=0) for a in self._anchors])

    def _members(self, anchor: int) -> tuple[Ints, Floats]:
        """Keyframes of a place, and their poses in the map as they were aligned together."""
        stretches, at = self.saved.stretches, int(np.flatnonzero(self._anchors == anchor)[0])
        if stretches is not None and len(stretches.anchors):
            part = slice(stretches.starts[at], stretches.starts[at + 1])
            return stretches.members[part], compose(self.frames.poses[anchor], stretches.seen[part])
        return self.stretches[at], self.frames.poses[self.stretches[at]]

    def place(self, anchor: int) -> tuple[CellMap, Hold]:
        """Contours of a place in the frame of its anchor, and what they know of the anchor's own scan."""
        if anchor not in self._places:
            members, poses = self._members(anchor)
            seen = between(self.frames.poses[anchor], poses)
            points = [self.contour(int(k)) for k in members]
            reach = max((float(np.abs(p[:, :2]).max(initial=1.0)) for p in points), default=1.0)
            cells = CellMap(np.zeros(2), reach + float(np.abs(seen[:, :2]).max(initial=0.0)) + 1.0)
            for contour, pose in zip(points, seen, strict=True):
                cells.insert(contour, pose)
            self._places[anchor] = cells
            if len(self._places) > KEPT:
                self._places.popitem(last=False)
        self._places.move_to_end(anchor)
        if anchor not in self._holds:
            self._holds[anchor] = hold(self.contour(anchor), self._places[anchor], np.zeros(3), inside=True)
        return self._places[anchor], self._holds[anchor]


def _stretches(frames: Contoured, way: Floats) -> tuple[Ints, ...]:
    """Keyframes of each view: stretches of the drive of `WAY` each, that begin where the one before is half over."""
    found: list[Ints] = []
    for drive in np.unique(frames.drives).tolist():
        own = np.flatnonzero(frames.drives == drive)
        along = way[own] - way[own[0]]
        for k in range(max(math.floor((along[-1] - WAY) / (0.5 * WAY)) + 1, 0) + 1):
            inside = own[(along >= 0.5 * k * WAY) & (along < (0.5 * k + 1.0) * WAY)]
            if len(inside) and (k == 0 or along[-1] > (0.5 * k + 0.5) * WAY):
                found.append(inside)
    return tuple(found)


def _among(known: Constellation, back: Floats, points: Floats) -> Constellation:
    """Landmarks near the points of a view, in its frame; `back` is the map seen from there."""
    corners, ends = transform(back, known.corners), transform(back, known.end_points)
    seen = np.unique(numbered(np.floor(points[:, :2] / TOUCH)))
    around = np.array([(dx, dy) for dx in (-1.0, 0.0, 1.0) for dy in (-1.0, 0.0, 1.0)])

    def touched(spots: Floats) -> NDArray[np.bool_]:
        near = numbered(np.floor(spots / TOUCH)[:, None] + around)
        return np.asarray(np.isin(near, seen).any(axis=1))

    own = touched(corners)
    walls = touched(ends.mean(axis=1)) if len(ends) else np.empty(0, np.bool_)
    return Constellation(
        corners[own],
        known.directions[own] + back[2],
        known.openings[own],
        known.convex[own],
        known.normals[walls] + back[2],
        ends[walls],
    )
