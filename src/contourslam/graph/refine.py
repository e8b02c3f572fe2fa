"""The whole map at the end of a drive: every keyframe held against the places around it once more, and all solved."""

import gtsam
import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.graph.landmark_factors import relations
from contourslam.graph.landmark_set import find_landmark_set
from contourslam.graph.memory import Settled
from contourslam.graph.places import ROBUST_TIES, Keyframe, Places
from contourslam.graph.pose_graph import PoseGraph, joined, keyframes_of, poses_of, relation, solve, spreads
from contourslam.graph.sightings import Sightings
from contourslam.matching.small import invert

REACH = 5.0  # a place whose middle is this near is held against the keyframe, m
MOST_TIES = 3  # places a keyframe is held against
APART = 3  # places before and after a keyframe's own that are not: their contours made its pose in the first place
STILL = 0.1  # m that no keyframe moves farther than in a round after which no other is needed
LEAST_OVERLAP = 0.6


def refine(
    graph: PoseGraph, keyframes: list[Keyframe], places: Places | None, sightings: Sightings, rounds: int = 1
) -> Settled:
    """Solve the graph at once, tie every keyframe anew to the places around it and to all landmarks, and solve again.

    Parameters
    ----------
    graph : PoseGraph
        Stays as it is.
    keyframes : list of Keyframe
    places : Places or None
        Are moved to where they come to lie; None to tie no keyframe to a place seen before.
    sightings : Sightings
        Of corners and walls.
    rounds : int
        Of tying and solving, at most: several where parts lie farther off each other than a tie may contradict.

    Returns
    -------
    Settled
        Its factors are those of all that was solved at last, but of landmarks: its covariances change little by these
        and would take ten times as long.
    """
    count = len(keyframes)
    factors = joined(graph.factors, graph.ties)
    values = solve(factors, graph.estimate(count))
    for _ in range(rounds):
        poses = poses_of(values, count)
        seen, landmarks = relations(find_landmark_set(sightings, poses), sightings, poses)
        landmarks.insert(values)
        factors = joined(graph.factors) if places is None else joined(graph.factors, _ties(keyframes, poses, places))
        values = keyframes_of(solve(joined(factors, seen), landmarks), count)
        if np.abs((poses_of(values, count) - poses)[:, :2]).max() < STILL:
            break
    return Settled(poses_of(values, count), spreads(factors, values, np.arange(count)), factors)


def _ties(keyframes: list[Keyframe], poses: Floats, places: Places) -> gtsam.NonlinearFactorGraph:
    """Ties of all keyframes to the nearest places of other passes, place by place: each one's table is made once."""
    places.move(poses[[place.anchor for place in places.list]].reshape(-1, 3))
    ties = gtsam.NonlinearFactorGraph()
    chosen = _pairs(poses, np.array([keyframe.drive for keyframe in keyframes]), places)
    for number in np.unique(chosen[:, 1]).tolist():
        anchor = places.list[number].anchor
        for key in chosen[chosen[:, 1] == number, 0].tolist():
            found = places.tie(number, key, places.into(number, poses[key]), LEAST_OVERLAP)
            if found is not None:
                ties.push_back(relation(anchor, key, found[0], invert(found[1]), ROBUST_TIES))
    return ties


def _pairs(poses: Floats, drives: Ints, places: Places) -> Ints:
    """Keyframe and place of each tie to be tried, shape (n, 2)."""
    own = np.zeros(len(poses), np.int64)
    for number, place in enumerate(places.list):
        own[place.anchor :] = number
    rows = []
    for number in range(len(places)):
        distance = np.hypot(*(poses[:, :2] - places.centre(number)[:2]).T)
        other = (np.abs(own - number) > APART) | (drives != drives[places.list[number].anchor])
        keys = np.flatnonzero((distance < REACH) & other)
        rows.append(np.column_stack([keys, np.full(len(keys), number), distance[keys]]))
    if not rows:
        return np.empty((0, 2), np.int64)
    every = np.concatenate(rows)
    every = every[np.lexsort((every[:, 2], every[:, 0]))]
    first = np.searchsorted(every[:, 0], every[:, 0])
    return every[np.arange(len(every)) - first < MOST_TIES, :2].astype(np.int64)
