"""The set of landmarks as maps for its readers: identity, record of being seen, covariance in the world."""

import numpy as np
from numpy.typing import NDArray

from contourslam.config import SlamConfig
from contourslam.contour.contours import Floats, Ints
from contourslam.graph.landmark_set import LandmarkSet
from contourslam.graph.sightings import CONVEX, DIRECTION, END, KIND, OPENING, PTT, PXT, PXX, PXY, PYY, START, X, Y
from contourslam.slam.landmark_filter import END_POINT_SIGMA
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.measurement import CORNER


def records(found: LandmarkSet, ids: NDArray[np.int32], failures: list[int]) -> tuple[Ints, Ints]:
    """Identity of each landmark, and how often it should have been seen but was not.

    A landmark of the drive that lies in several of the set now counts for the one that has most of its sightings; of
    several in one, the oldest gives its id.

    Parameters
    ----------
    found : LandmarkSet
    ids : ndarray of int, shape (n,)
        What each sighting was taken for during the drive, -1 for none.
    failures : list of int
        Misses counted during the drive, by id.

    Returns
    -------
    ids, failed : ndarray of int, shape (m,)
    """
    both = (found.labels >= 0) & (ids >= 0)
    pairs, counts = np.unique(np.stack([ids[both], found.labels[both]]), axis=1, return_counts=True)
    numbers, failed = np.full(len(found), -1), np.zeros(len(found), np.int64)
    settled: set[int] = set()
    for k in np.argsort(-counts, kind="stable"):
        number, label = int(pairs[0, k]), int(pairs[1, k])
        if number in settled:
            continue
        settled.add(number)
        failed[label] += failures[number]
        if numbers[label] < 0 or number < numbers[label]:
            numbers[label] = number
    new = numbers < 0
    numbers[new] = len(failures) + np.arange(new.sum())
    return numbers, failed


def judge(found: LandmarkSet, failed: Ints, config: SlamConfig) -> NDArray[np.bool_]:
    """Which landmarks are worth their place in the map: the rule of f / (f + o), shape (m,)."""
    chances = found.observed + failed
    return (chances < config.min_chances) | (failed <= config.max_false_negative_rate * chances)


def _world_covariances(table: Floats, poses: Floats, spreads: Floats) -> Floats:
    """Covariance of each landmark's x, y and direction in the world: its keyframe's and its fit's, shape (m, 3, 3)."""
    m = len(table)
    lever = np.tile(np.eye(3), (m, 1, 1))
    lever[:, 0, 2], lever[:, 1, 2] = poses[:, 1] - table[:, Y], table[:, X] - poses[:, 0]
    own = np.zeros((m, 3, 3))
    own[:, 0, 0], own[:, 0, 1], own[:, 1, 1] = table[:, PXX], table[:, PXY], table[:, PYY]
    own[:, 0, 2], own[:, 2, 2] = table[:, PXT], table[:, PTT]
    own[:, 1, 0], own[:, 2, 0] = own[:, 0, 1], own[:, 0, 2]
    turn = np.tile(np.eye(3), (m, 1, 1))
    c, s = np.cos(table[:, DIRECTION]), np.sin(table[:, DIRECTION])
    turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = c, -s, s, c
    return np.asarray(lever @ spreads @ lever.transpose(0, 2, 1) + turn @ own @ turn.transpose(0, 2, 1))


def to_maps(found: LandmarkSet, ids: Ints, failed: Ints, poses: Floats, spreads: Floats) -> tuple[CornerMap, WallMap]:
    """Corners and walls of a set.

    Parameters
    ----------
    found : LandmarkSet
    ids, failed : ndarray of int, shape (m,)
    poses : ndarray, shape (m, 3)
        Keyframe in the world that saw each landmark first.
    spreads : ndarray, shape (m, 3, 3)
        Its covariance, world axes; a landmark is no better known in the world than the keyframes that saw it.

    Returns
    -------
    CornerMap
    WallMap
    """
    p = _world_covariances(found.table, poses, spreads)
    c = np.flatnonzero(found.table[:, KIND] == CORNER)
    t = found.table[c]
    corners = CornerMap(
        ids[c], t[:, X : Y + 1], p[c, :2, :2], t[:, DIRECTION], t[:, OPENING], t[:, CONVEX] > 0.5, found.observed[c],
        failed[c],
    )  # fmt: skip
    w = np.flatnonzero(found.table[:, KIND] != CORNER)
    t, p = found.table[w], p[w]
    normal = np.stack([np.cos(t[:, DIRECTION]), np.sin(t[:, DIRECTION])], axis=1)
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    along = t[:, [START, END]]
    across = np.einsum("wi,wij,wj->w", normal, p[:, :2, :2], normal)
    mixed, turn = np.einsum("wi,wi->w", normal, p[:, :2, 2]), p[:, 2, 2]
    # Turning the line about its middle moves an end across by its distance from there.
    at_ends = across[:, None] - 2.0 * along * mixed[:, None] + along**2 * turn[:, None]
    outer, lengthwise = normal[:, :, None] * normal[:, None, :], tangent[:, :, None] * tangent[:, None, :]
    ends = at_ends[:, :, None, None] * outer[:, None] + END_POINT_SIGMA**2 * lengthwise[:, None]
    lines = np.stack([np.stack([turn, mixed], axis=1), np.stack([mixed, across], axis=1)], axis=1)
    walls = WallMap(
        ids[w], t[:, None, X : Y + 1] + along[:, :, None] * tangent[:, None], ends, t[:, DIRECTION], lines,
        found.observed[w], failed[w],
    )  # fmt: skip
    return corners, walls
