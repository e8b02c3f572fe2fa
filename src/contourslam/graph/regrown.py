"""The tree of doubt of earlier drives, grown again from what binds their keyframes."""

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.graph.doubt import HEADING_PER_M, DoubtTree
from contourslam.maps.saved_map import Contoured, Relations
from contourslam.matching.odometry import FLOOR
from contourslam.matching.small import invert, turned

OPEN = 1e-6  # information that a direction has at least, so that it can be inverted


def regrow(
    doubt: DoubtTree, keyframes: Contoured, relations: Relations, anchors: Ints
) -> tuple[dict[int, int], list[int]]:
    """Give every place its node, known from the place before it, or from one to which a tie binds it more surely.

    Parameters
    ----------
    doubt : DoubtTree
        Empty; is filled.
    keyframes : Contoured
    relations : Relations
    anchors : ndarray of int, shape (p,)
        Of the places.

    Returns
    -------
    nodes : dict of int to int
        Node of each place, by its anchor.
    of_keyframes : list of int, shape (k,)
        Node of the place to which each keyframe was aligned.
    """
    nodes: dict[int, int] = {}
    of_keyframes: list[int] = []
    places = set(anchors.tolist())
    bound = _by_second(relations, len(keyframes))
    for key, pose in enumerate(keyframes.poses):
        plain = [i for i in bound[key] if not relations.ties[i] and 0 <= relations.first[i] < key]
        # Matches to the place that the robot was in have no kernel; where there is none, the wheels or the start bind.
        best = min(plain, key=lambda i: (not np.isnan(relations.robust[i]), -relations.first[i]), default=None)
        known_from = None if best is None else int(relations.first[best])
        node = 0 if known_from is None else nodes.get(known_from, of_keyframes[known_from])
        if key in places or known_from is None:
            if best is None:  # the first of a map that was merged into another hangs on ties alone
                covariance = FLOOR + keyframes.covariances[key] if key else FLOOR
            else:
                covariance = _covariance(relations, best, pose)
            nodes[key] = doubt.add(node, pose, covariance)
            first = known_from is None or keyframes.drives[known_from] < keyframes.drives[key]
            node = nodes[key] if first else node
        of_keyframes.append(node)
        for i in bound[key]:
            other = nodes.get(int(relations.first[i]), node)
            if relations.ties[i] and other < node:
                doubt.better(node, other, pose, _covariance(relations, i, pose))
    return nodes, of_keyframes


def _by_second(relations: Relations, count: int) -> list[list[int]]:
    """Relations that bind each keyframe to another or to the map."""
    bound: list[list[int]] = [[] for _ in range(count)]
    for i, key in enumerate(relations.second.tolist()):
        bound[key].append(i)
    return bound


def _covariance(relations: Relations, i: int, pose: Floats) -> Floats:
    """Covariance of a keyframe at `pose` as one relation has it, in the axes of the map."""
    covariance = turned(invert(relations.information[i] + OPEN * np.eye(3)), pose[2])
    if not relations.ties[i]:
        covariance[2, 2] += HEADING_PER_M**2 * np.hypot(relations.poses[i, 0], relations.poses[i, 1])
    return covariance
