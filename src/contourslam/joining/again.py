"""Overlaps that a merged map does not know yet: drives that come by the same place, out of reach of an alignment."""

import math
from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.poses import between_one, compose_one, inverse
from contourslam.graph.loops import (
    AGREE,
    AGREE_ANGLE,
    BETWEEN_LOOKS,
    FORGET,
    MOST_PLACES,
    PATCH_RADIUS,
    REACH,
    WINDOW,
    fitted,
    search_contours,
    window_of,
    within,
)
from contourslam.graph.memory import Memory
from contourslam.maps.saved_map import Contoured, Relations
from contourslam.matching.oriented import move

DOUBLED = 2.0  # a solution that does not know of an overlap is surer than it should be: so much, in standard deviations


@dataclass(frozen=True, slots=True)
class Again:
    """A keyframe found in a place of another drive.

    Attributes
    ----------
    place : int
        Number of the place.
    keyframe : int
    pose : ndarray, shape (3,)
        The keyframe seen from the place's anchor: m, m, rad.
    """

    place: int
    keyframe: int
    pose: Floats


def look_again(memory: Memory, keyframes: Contoured, relations: Relations) -> list[Again]:
    """Look for each place in those of other drives around it to which nothing ties it, as far off as it may well be.

    As while a drive goes on, one look is not believed: two must agree, some way apart.

    Parameters
    ----------
    memory : Memory
        Of the whole map, its places where the map has them.
    keyframes : Contoured
        As the map has them, with the covariances of its solution.
    relations : Relations
        What binds them already.

    Returns
    -------
    list of Again
    """
    places, poses = memory.places, keyframes.poses
    anchors = np.array([place.anchor for place in places.list])
    own, spreads = keyframes.drives[anchors], DOUBLED**2 * keyframes.covariances[anchors]
    known = _tied(memory, keyframes.drives, relations)
    looks: dict[tuple[int, int], list[tuple[Again, Floats]]] = defaultdict(list)
    for number, pose in enumerate(poses[anchors]):
        numbers, distances = places.near(places.centre(number), len(places), REACH + 2.0 * float(WINDOW[0]))
        doubts = spreads[number] + spreads[numbers]
        doubts[:, (0, 1), (0, 1)] += (distances**2 * spreads[numbers, 2, 2])[:, None]
        near = distances < REACH + 2.0 * np.sqrt(doubts[:, 0, 0] + doubts[:, 1, 1])
        for drive in np.unique(own[numbers[near]]).tolist():
            if drive == own[number] or (number, drive) in known:
                continue
            for i in _first(numbers, near & (own[numbers] == drive)):
                found = _find(memory, number, int(numbers[i]), pose, doubts[i])
                if found is not None:
                    world = places.out_of(found.place, found.pose)
                    looks[int(own[number]), drive].append((found, world))
    return [again for pair in looks.values() for again in _agreeing(pair, poses)]


def _tied(memory: Memory, drives: Ints, relations: Relations) -> set[tuple[int, int]]:
    """Places, and the drives to which one of their keyframes is tied."""
    tied = defaultdict(set)
    for first, second in zip(relations.first.tolist(), relations.second.tolist(), strict=True):
        if first >= 0 and drives[first] != drives[second]:
            tied[first].add(int(drives[second]))
            tied[second].add(int(drives[first]))
    return {
        (number, drive)
        for number, place in enumerate(memory.places.list)
        for member in place.members
        for drive in tied.get(member, ())
    }


def _first(numbers: Ints, chosen: np.ndarray) -> list[int]:
    """Rows of the nearest of the chosen places, neighbours being searched together."""
    rows: list[int] = []
    for i in np.flatnonzero(chosen).tolist():
        if len(rows) < MOST_PLACES and all(abs(int(numbers[i] - numbers[j])) > 1 for j in rows):
            rows.append(i)
    return rows


def _find(memory: Memory, number: int, other: int, pose: Floats, doubt: Floats) -> Again | None:
    places = memory.places
    middle = places.list[number].seen.mean(axis=0) * (1.0, 1.0, 0.0)
    points = move(places.cells(number).points[:, :4], inverse(middle))
    points = points[np.hypot(points[:, 0], points[:, 1]) < PATCH_RADIUS]
    guess, window = places.into(other, compose_one(pose, middle)), window_of(doubt)
    known = within(places.around(other), guess, window)
    if not len(known) or not len(points):
        return None
    found = search_contours(points, known, guess, window)
    aligned = None if found is None else fitted(points, known, guess, window, found[0])
    if aligned is None:
        return None
    return Again(other, places.list[number].anchor, compose_one(aligned.pose, inverse(middle)))


def _agreeing(looks: list[tuple[Again, Floats]], poses: Floats) -> list[Again]:
    """Looks that another one bears out, some way from it."""
    out = []
    for found, world in looks:
        for other, there in looks:
            way = between_one(poses[other.keyframe], poses[found.keyframe])
            off = between_one(compose_one(there, way), world)
            apart = BETWEEN_LOOKS <= math.hypot(way[0], way[1]) <= FORGET
            if apart and math.hypot(off[0], off[1]) < AGREE and abs(off[2]) < AGREE_ANGLE:
                out.append(found)
                break
    return out
