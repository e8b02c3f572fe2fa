"""Places seen again: tied where the pose is sure, searched for where it is not, believed when two looks agree."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one, compose_one, inverse
from contourslam.graph.doubt import DoubtTree
from contourslam.graph.places import Places
from contourslam.matching.align import Alignment, align
from contourslam.matching.cell_map import CellMap
from contourslam.matching.oriented import move
from contourslam.matching.search import search
from contourslam.matching.search_grid import build_search_grid
from contourslam.matching.small import invert, turned

APART = 3  # finished places that are passed over, for the robot has hardly left them
REACH = 4.0  # a place whose middle is this near may see what the robot sees, m
MOST_TIES = 2  # places tied to one keyframe
SHARP, SHARP_ANGLE = 0.15, math.radians(4.0)  # standard deviations up to which a scan is aligned without a search
LEAST_SIGMA = np.array([0.05, 0.05, math.radians(1.0)])  # what the doubt is never taken to be less than
LEAST_OVERLAP = 0.55
# The search: window, points of the patch, how good the best must be, and how much better than the next.
WINDOW = np.array([8.0, 8.0, math.radians(25.0)])
PATCH_POINTS = 250
LEAST_SCORE, MOST_RIVAL = 0.5, 0.85
AGREE, AGREE_ANGLE = 0.3, math.radians(3.0)  # two looks that put the robot this close together agree
FORGET = 12.0  # m after which a first look is forgotten
PAUSE = 1.0  # m between two searches


@dataclass(frozen=True, slots=True)
class Tie:
    """A keyframe found in an older place.

    Attributes
    ----------
    place : int
        Number of the place.
    pose : ndarray, shape (3,)
        The keyframe in the frame of the place's cells.
    alignment : Alignment
    shift : ndarray, shape (3,)
        From where it was thought to be, in the keyframe's frame.
    method : str
        "nearby" or "search".
    runner_up : float
        Score of the best other pose as a part of this one's.
    """

    place: int
    pose: Floats
    alignment: Alignment
    shift: Floats
    method: str
    runner_up: float


@dataclass(frozen=True, slots=True)
class _Look:
    """A first look: ties that wait for a second, and the robot's pose in the contour odometry then."""

    tie: Tie
    keyframe: int
    local: Floats
    world: Floats
    travelled: float


class LoopFinder:
    """Looks for older places around each new keyframe; changed in place.

    Parameters
    ----------
    places : Places
    doubt : DoubtTree
    """

    def __init__(self, places: Places, doubt: DoubtTree) -> None:
        self._places, self._doubt = places, doubt
        self._waiting: list[_Look] = []
        self._searched_at = -math.inf
        self.searches = 0

    def ties(self, oriented: Floats, pose: Floats, node: int) -> tuple[list[Tie], list[int]]:
        """Align a keyframe to the old places around it, where their relative pose is known sharply.

        Parameters
        ----------
        oriented : ndarray, shape (n, 4)
            Its contour points in its frame.
        pose : ndarray, shape (3,)
            Where it is thought to be in the world.
        node : int
            Number of the active local map in the tree of doubt.

        Returns
        -------
        list of Tie
        list of int
            Places that may be near but are not known sharply enough.
        """
        found: list[Tie] = []
        unsure: list[int] = []
        until = len(self._places) - APART
        for number in self._places.near(pose, until, REACH + WINDOW[0]):
            doubt = self._doubt.between(node, self._places.list[number].node, pose)
            sigma = math.sqrt(doubt[0, 0] + doubt[1, 1])
            centre = self._places.centre(number)
            distance = math.hypot(centre[0] - pose[0], centre[1] - pose[1])
            if distance > REACH + 2.0 * sigma:
                continue
            if sigma > SHARP or doubt[2, 2] > SHARP_ANGLE**2:
                unsure.append(int(number))
            elif len(found) < MOST_TIES:
                tie = self._tie(int(number), oriented, pose, doubt)
                if tie is not None:
                    found.append(tie)
        return found, unsure

    def _tie(self, number: int, oriented: Floats, pose: Floats, doubt: Floats) -> Tie | None:
        place = self._places.list[number]
        guess = self._places.into(number, pose)
        prior = invert(turned(doubt, guess[2] - pose[2]) + np.diag(LEAST_SIGMA**2))
        found = align(oriented, place.cells, guess, prior)
        off = found.pose - guess
        off[2] = between_one(guess, found.pose)[2]
        if found.overlap < LEAST_OVERLAP or off @ prior @ off > 16.0:
            return None
        return Tie(number, found.pose, found, between_one(guess, found.pose), "nearby", 0.0)

    def search(
        self, patch: CellMap, local: Floats, pose: Floats, unsure: list[int], node: int, keyframe: int,
        travelled: float,
    ) -> list[tuple[int, Tie]]:  # fmt: skip
        """Look for what was seen of late in places that may be near; ties that two looks agree on.

        Parameters
        ----------
        patch : CellMap
            Contours of the last metres, in the frame of the contour odometry.
        local, pose : ndarray, shape (3,)
            The robot in that frame, and where it is thought to be in the world.
        unsure : list of int
            Places to look at.
        node : int
            Number of the active local map in the tree of doubt.
        keyframe : int
            The newest.
        travelled : float
            Length of the drive so far, m.

        Returns
        -------
        list of (int, Tie)
            Keyframes and their ties; empty as long as nothing is certain.
        """
        if not unsure or travelled < self._searched_at + PAUSE:
            return []
        self._searched_at = travelled
        self._waiting = [w for w in self._waiting if travelled - w.travelled < FORGET]
        points = move(patch.points[:, :4], inverse(local))
        for number in unsure[:2]:
            doubt = self._doubt.between(node, self._places.list[number].node, pose)
            tie = self._find(number, points, pose, doubt)
            if tie is None:
                continue
            world = compose_one(self._places.anchors[number], self._places.from_anchor(number, tie.pose))
            look = _Look(tie, keyframe, local, world, travelled)
            for other in self._waiting:
                expected = compose_one(other.world, between_one(other.local, local))
                off = between_one(expected, world)
                if math.hypot(off[0], off[1]) < AGREE and abs(off[2]) < AGREE_ANGLE:
                    self._waiting.clear()
                    return [(other.keyframe, other.tie), (keyframe, tie)]
            self._waiting.append(look)
        return []

    def _find(self, number: int, points: Floats, pose: Floats, doubt: Floats) -> Tie | None:
        self.searches += 1
        window = np.minimum(3.0 * np.sqrt(np.diag(doubt)) + (0.3, 0.3, 0.05), WINDOW)
        window[:2] = window[:2].max()
        guess = self._places.into(number, pose)
        chain = [self._places.list[i].cells.points for i in self._places.chain(number)]
        known = np.concatenate(chain)
        grid = build_search_grid(known[:, :2], known[:, 2:4])
        some = points[:: max(len(points) // PATCH_POINTS, 1)]
        results = search(grid, some[:, :2], guess, window, normals=some[:, 2:4], min_score=LEAST_SCORE, keep=2)
        if not results:
            return None
        rival = results[1].score / results[0].score if len(results) > 1 else 0.0
        if rival > MOST_RIVAL:
            return None
        cells = CellMap(guess, 60.0)
        cells.insert(known[:, :4].copy(), np.zeros(3))
        found = align(points, cells, results[0].pose, np.zeros((3, 3)) + np.diag([1.0, 1.0, 1.0]))
        if found.overlap < LEAST_OVERLAP:
            return None
        return Tie(number, found.pose, found, between_one(guess, found.pose), "search", rival)
