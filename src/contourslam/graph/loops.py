"""Places seen again: tied where the pose is sure, searched for where it is not, believed when two looks agree."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.poses import between_one, compose_one, inverse
from contourslam.graph.constellations import constellation, recognise
from contourslam.graph.doubt import DoubtTree
from contourslam.graph.landmarks import Landmarks
from contourslam.graph.places import Places
from contourslam.graph.sightings import X, Y
from contourslam.matching.align import Alignment, align
from contourslam.matching.cell_map import CellMap
from contourslam.matching.odometry import LocalMap
from contourslam.matching.oriented import move
from contourslam.matching.search import search
from contourslam.matching.search_grid import build_search_grid
from contourslam.matching.small import invert, turned

APART = 3  # finished places that are passed over, for the robot has hardly left them
REACH = 4.0  # a place whose middle is this near may see what the robot sees, m
SHARP, SHARP_ANGLE = 0.15, math.radians(4.0)  # standard deviations up to which a scan is aligned without a search
LEAST_SIGMA = np.array([0.05, 0.05, math.radians(1.0)])  # what the doubt is never taken to be less than
GATE = 16.0  # squared Mahalanobis distance by which a tie may shift the pose
LEAST_OVERLAP = 0.65
# The search: window, points of the patch, how good the best must be, and how much better than the next.
WINDOW = np.array([15.0, 15.0, math.radians(35.0)])
PATCH_POINTS, PATCH_RADIUS = 250, 15.0  # m around the robot
LEAST_SCORE, MOST_RIVAL = 0.33, 0.85
LEAST_PATCH_OVERLAP = 0.6
MOST_PLACES = 2  # places looked at in one search
AGREE, AGREE_ANGLE = 0.3, math.radians(3.0)  # two looks that put the robot this close together agree,
BETWEEN_LOOKS = 2.5  # if they lie this far apart, m: a look from where the first was taken says nothing new
FORGET = 15.0  # m after which a first look is forgotten
PAUSE = 1.0  # m between two searches
REST = 4.0  # m for which a place that was searched in vain is let be
FREE = np.diag([1.0, 1.0, 1.0])  # information of a pose that is known to a metre and a radian


@dataclass(frozen=True, slots=True)
class Tie:
    """A keyframe found in an older place.

    Attributes
    ----------
    place : int
        Number of the place.
    alignment : Alignment
        Its pose is that of the keyframe seen from the place's anchor.
    shift : ndarray, shape (3,)
        From where it was thought to be, in the keyframe's frame.
    method : str
        "nearby", "constellation" or "search".
    runner_up : float
        Score of the best other pose as a part of this one's.
    """

    place: int
    alignment: Alignment
    shift: Floats
    method: str
    runner_up: float


@dataclass(frozen=True, slots=True)
class Candidates:
    """Old places that may see what the robot sees, nearest first, and the covariance of its pose as seen from each."""

    numbers: Ints
    doubts: Floats

    def where(self, chosen: NDArray[np.bool_]) -> "Candidates":
        """Those chosen by a mask."""
        return Candidates(self.numbers[chosen], self.doubts[chosen])


@dataclass(frozen=True, slots=True)
class _Look:
    """A first look, waiting for a second: the tie, and where the robot was in the contour odometry and in the world."""

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
    landmarks : Landmarks
    """

    def __init__(self, places: Places, doubt: DoubtTree, landmarks: Landmarks) -> None:
        self._places, self._doubt, self._landmarks = places, doubt, landmarks
        self._waiting: list[_Look] = []
        self._searched_at = -math.inf
        self._looked: deque[int] = deque(maxlen=2 * MOST_PLACES)
        self._in_vain: dict[int, float] = {}  # places, and how far the robot had driven when nothing was found there
        self.searches = 0

    def candidates(self, pose: Floats, node: int) -> tuple[Candidates, Candidates]:
        """Old places that may be near: those known sharply enough to align to, and the others.

        Parameters
        ----------
        pose : ndarray, shape (3,)
            Where the robot is thought to be in the world.
        node : int
            Number of the active local map in the tree of doubt.
        """
        numbers, distances = self._places.near(pose, self._places.left(APART), REACH + 2.0 * float(WINDOW[0]))
        doubts = self._doubt.between(node, self._places.nodes[numbers], pose)
        sigma = np.sqrt(doubts[:, 0, 0] + doubts[:, 1, 1])
        near = distances < REACH + 2.0 * sigma
        sharp = (sigma < SHARP) & (doubts[:, 2, 2] < SHARP_ANGLE**2)
        every = Candidates(numbers, doubts)
        return every.where(near & sharp), every.where(near & ~sharp)

    def tie(self, oriented: Floats, pose: Floats, sharp: Candidates) -> Tie | None:
        """Align a keyframe to the nearest old place that fits, of those whose relative pose is known sharply.

        Parameters
        ----------
        oriented : ndarray, shape (n, 4)
            Its contour points in its frame.
        pose : ndarray, shape (3,)
            Where it is thought to be in the world.
        sharp : Candidates

        Returns
        -------
        Tie or None
        """
        for number, doubt in zip(sharp.numbers, sharp.doubts, strict=True):
            guess = self._places.into(number, pose)
            prior = invert(turned(doubt, guess[2] - pose[2]) + np.diag(LEAST_SIGMA**2))
            aligned = align(oriented, self._places.cells(number), guess, prior)
            off = aligned.pose - guess
            off[2] = between_one(guess, aligned.pose)[2]
            if aligned.overlap >= LEAST_OVERLAP and off @ prior @ off < GATE:
                return Tie(int(number), aligned, between_one(guess, aligned.pose), "nearby", 0.0)
        return None

    def search(
        self, patch: LocalMap, local: Floats, pose: Floats, unsure: Candidates, keyframe: int, travelled: float
    ) -> list[tuple[int, Tie]]:
        """Look for what was seen of late in places that may be near.

        Parameters
        ----------
        patch : LocalMap
            The last metres.
        local, pose : ndarray, shape (3,)
            The robot in that frame, and where it is thought to be in the world.
        unsure : Candidates
            Places to look at.
        keyframe : int
            The newest.
        travelled : float
            Length of the drive so far, m.

        Returns
        -------
        list of (int, Tie)
            Keyframes and their ties, once two looks some way apart agree; else empty.
        """
        if not len(unsure.numbers) or travelled < self._searched_at + PAUSE:
            return []
        chosen = self._turn(unsure.numbers, travelled)
        if not chosen:
            return []
        self._searched_at = travelled
        self._waiting = [w for w in self._waiting if travelled - w.travelled < FORGET]
        since = patch.anchor
        points = move(patch.cells.points[:, :4], inverse(local))
        points = points[np.hypot(points[:, 0], points[:, 1]) < PATCH_RADIUS]
        for i in chosen:
            number = int(unsure.numbers[i])
            tie = self._find(number, points, pose, unsure.doubts[i], since)
            if tie is None:
                self._in_vain[number] = travelled
                continue
            world = self._places.out_of(tie.place, tie.alignment.pose)
            look = _Look(tie, keyframe, local, world, travelled)
            for other in self._waiting:
                off = between_one(compose_one(other.world, between_one(other.local, local)), world)
                apart = travelled - other.travelled >= BETWEEN_LOOKS
                if apart and math.hypot(off[0], off[1]) < AGREE and abs(off[2]) < AGREE_ANGLE:
                    self._waiting.clear()
                    return [(other.keyframe, other.tie), (keyframe, tie)]
            self._waiting.append(look)
            break  # another place would be looked at from the same spot: no second look
        return []

    def _turn(self, numbers: Ints, travelled: float) -> list[int]:
        """Which of the candidates are looked at now: those that were not of late, nearest first."""
        recent = set(self._looked)
        order = sorted(range(len(numbers)), key=lambda i: int(numbers[i]) in recent)
        chosen: list[int] = []
        for i in order:
            if travelled < self._in_vain.get(int(numbers[i]), -math.inf) + REST:
                continue
            # Neighbours are searched together.
            if len(chosen) < MOST_PLACES and all(abs(int(numbers[i] - numbers[j])) > 1 for j in chosen):
                chosen.append(i)
        self._looked.extend(int(numbers[i]) for i in chosen)
        return chosen

    def _find(self, number: int, points: Floats, pose: Floats, doubt: Floats, since: int) -> Tie | None:
        """Look for the patch in one place and its neighbours; None where nothing fits, or two poses do."""
        window = window_of(doubt)
        guess, known = self._places.into(number, pose), self._places.around(number)
        known = within(known, guess, window)
        if not len(known) or not len(points):
            return None
        for method, propose in (("constellation", self._by_landmarks), ("search", self._by_contours)):
            found = propose(number, points, known, pose, window, since)
            if found is not None:
                aligned = fitted(points, known, guess, window, found[0])
                if aligned is not None:
                    return Tie(number, aligned, between_one(guess, aligned.pose), method, found[1])
        return None

    def _by_landmarks(
        self, number: int, points: Floats, known: Floats, pose: Floats, window: Floats, since: int
    ) -> tuple[Floats, float] | None:
        """Pose seen from the place that corners and walls propose, and how good the next one is beside it."""
        table, old = self._landmarks.table, self._landmarks.not_seen(since=since)
        near = np.abs(table[old][:, [X, Y]] - pose[:2]).max(axis=1) < PATCH_RADIUS + window[0]
        local = constellation(table, self._landmarks.seen(since=since), pose)
        found = recognise(local, constellation(table, old[near], np.zeros(3)), pose, window)
        return None if found is None else (self._places.into(number, found[0].pose), found[1])

    def _by_contours(
        self, number: int, points: Floats, known: Floats, pose: Floats, window: Floats, since: int
    ) -> tuple[Floats, float] | None:
        """Pose seen from the place that a search over all poses finds, and how good the next one is beside it."""
        self.searches += 1
        return search_contours(points, known, self._places.into(number, pose), window)


def window_of(doubt: Floats) -> Floats:
    """Half widths in which a pose of this covariance is searched for, shape (3,): m, m, rad."""
    window: Floats = np.minimum(3.0 * np.sqrt(np.diag(doubt)) + (0.3, 0.3, 0.05), WINDOW)
    window[:2] = window[:2].max()
    return window


def within(known: Floats, guess: Floats, window: Floats) -> Floats:
    """Those contour points that a patch may touch whose pose lies within the window around a guess."""
    near: Floats = known[(np.abs(known[:, :2] - guess[:2]) < PATCH_RADIUS + window[0]).all(axis=1)]
    return near


def search_contours(points: Floats, known: Floats, guess: Floats, window: Floats) -> tuple[Floats, float] | None:
    """Look for a patch over all poses within a window.

    Parameters
    ----------
    points, known : ndarray, shape (n, 4)
        Contour points of the patch in its frame, and those in which it is looked for: x, y, nx, ny.
    guess, window : ndarray, shape (3,)
        Pose of the patch in the frame of `known` as far as it is known, and the half widths about it: m, m, rad.

    Returns
    -------
    (ndarray, float) or None
        Its pose, and the score of the best other one as a part of this one's; None where none stands out.
    """
    grid = build_search_grid(known[:, :2], known[:, 2:])
    some = points[:: max(len(points) // PATCH_POINTS, 1)]
    results = search(grid, some[:, :2], guess, window, normals=some[:, 2:], min_score=LEAST_SCORE, keep=2)
    rival = results[1].score / results[0].score if len(results) > 1 else 0.0
    return None if not results or rival > MOST_RIVAL else (results[0].pose, rival)


def fitted(points: Floats, known: Floats, guess: Floats, window: Floats, proposed: Floats) -> Alignment | None:
    """Align a patch where it was proposed to lie; None where too little of it fits."""
    cells = CellMap(guess, PATCH_RADIUS + float(window[0]))
    cells.insert(known, np.zeros(3))
    aligned = align(points, cells, proposed, FREE)
    return aligned if aligned.overlap >= LEAST_PATCH_OVERLAP else None
