"""A common map as it is kept: the runs' drives one after the other; and its refinement as a whole."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats, Ints
from contourslam.detectors import make_detector
from contourslam.fleet.runs import Run
from contourslam.graph.keeping import keep, remember
from contourslam.graph.landmark_maps import to_maps
from contourslam.graph.landmark_set import find_landmark_set
from contourslam.graph.refine import refine
from contourslam.graph.sightings import Sightings
from contourslam.maps.saved_map import Contoured, Relations, SavedMap, Seen, Stretches

SPREAD = np.diag([1e-4, 1e-4, 1e-6])  # of a keyframe, where nobody has asked for it
START = np.diag([1e8, 1e8, 1e8])  # information of the pose at which the common map begins


@dataclass(frozen=True, slots=True)
class Bond:
    """A relation between two keyframes of the common map, whoever they belong to; see :class:`Relations`."""

    first: int
    second: int
    pose: Floats
    information: Floats
    robust: float | None
    tie: bool


def assemble(runs: Sequence[Run], poses: Floats, order: Sequence[int], bonds: Sequence[Bond]) -> SavedMap:
    """Put a map together from the runs' facts.

    Parameters
    ----------
    runs : sequence of Run
        Each becomes a drive, or several where the robot was lost in between.
    poses : ndarray, shape (k, 3)
        Of the keyframes in the frame of the map, by their numbers in the common map.
    order : sequence of int
        Those numbers, run by run.
    bonds : sequence of Bond

    Returns
    -------
    SavedMap
    """
    index = np.empty(len(order), np.int64)
    index[list(order)] = np.arange(len(order))
    facts = [run.keyframes[number] for run in runs for number in run.own]
    sightings = Sightings()
    for key, fact in enumerate(facts):
        sightings.append(key, fact.seen)
    laid = poses[list(order)]
    found = find_landmark_set(sightings, laid)
    names, missed = np.arange(len(found)), np.zeros(len(found), np.int64)
    n = sightings.count
    return SavedMap(
        *to_maps(found, names, missed, laid[found.first], np.tile(SPREAD, (len(found), 1, 1))),
        Contoured(
            np.array([fact.stamp for fact in facts], np.float64),
            laid,
            np.tile(SPREAD, (len(facts), 1, 1)),
            np.array([fact.blur for fact in facts], np.float64),
            np.cumsum([0, *(len(fact.points) for fact in facts)]),
            np.concatenate([np.empty((0, 4), np.float32), *(fact.points for fact in facts)]),
            _drives(runs),
        ),
        _relations(bonds, index, laid),
        Seen(sightings.keys[:n].copy(), found.labels.astype(np.int32), sightings.rows[:n].copy(), missed),
        _stretches(runs, index),
    )


def _drives(runs: Sequence[Run]) -> Ints:
    begun = [number == begin for run in runs for begin, end in run.pieces for number in range(begin, end)]
    return np.cumsum(begun, dtype=np.int64) - 1


def _relations(bonds: Sequence[Bond], index: Ints, laid: Floats) -> Relations:
    """Give all bonds as relations, after the one that holds the first keyframe where it is."""
    return Relations(
        np.array([-1, *(index[bond.first] for bond in bonds)], np.int64),
        np.array([0, *(index[bond.second] for bond in bonds)], np.int64),
        np.array([laid[0], *(bond.pose for bond in bonds)]),
        np.array([START, *(bond.information for bond in bonds)]),
        np.array([math.nan, *(math.nan if bond.robust is None else bond.robust for bond in bonds)]),
        np.array([False, *(bond.tie for bond in bonds)]),
    )


def _stretches(runs: Sequence[Run], index: Ints) -> Stretches:
    pieces = [(run, fact) for run in runs for fact in run.stretches if run.adds(fact)]
    return Stretches(
        np.array([index[run.keys[fact.anchor]] for run, fact in pieces], np.int64),
        np.cumsum([0, *(len(fact.members) for _, fact in pieces)]),
        np.array([index[run.keys[member]] for run, fact in pieces for member in fact.members], np.int64),
        np.concatenate([np.empty((0, 3)), *(fact.seen for _, fact in pieces)]),
    )


def refined(saved: SavedMap, config: Config) -> SavedMap:
    """Refine a whole map: every keyframe tied anew to the stretches around it and to all landmarks, and all solved.

    Parameters
    ----------
    saved : SavedMap
        From :func:`assemble`.
    config : Config

    Returns
    -------
    SavedMap
        With the covariances of its keyframes.
    """
    memory = remember(config, saved, make_detector(config.detector, adapted=config.adapted), np.zeros(3))
    settled = refine(memory.graph, memory.keyframes, memory.places, memory.landmarks.sightings)
    return replace(keep(memory, settled, {}), about=saved.about)
