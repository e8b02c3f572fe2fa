"""Constellations of corners and walls found again: a map says where it holds what was seen around the robot.

Votes of the pairs that may be the same find the poses worth a look (:mod:`.constellation_votes`); least squares over
the pairs that then agree refines and judges them (:mod:`.constellation_pairs`).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.matching.constellation_pairs import (
    CONCAVE,
    CONVEX,
    DIRECTION,
    HALF,
    KIND,
    OPENING,
    WALL,
    WEIGHT,
    Floats,
    Ints,
    X,
    Y,
    judge,
)
from contourslam.matching.constellation_votes import VOTERS, vote

FULL_WALL = 1.0  # a wall of this length, m, holds its one direction as well as a corner holds both
KEPT = 48  # peaks of the votes that are refined
MOST_CELLS = 4e6  # of the grid of positions; beyond, the cells grow
ROUNDS = np.array([3.0, 2.0, 1.0, 1.0])  # gates of the refinement, in tolerances
LEAST = 0.2  # a lower score is no place


@dataclass(frozen=True, slots=True)
class Constellation:
    """Corners and walls in one frame.

    Attributes
    ----------
    corners : ndarray, shape (k, 2)
        Positions, m.
    directions : ndarray, shape (k,)
        Bisector of the two sides, pointing into the angle they enclose, rad.
    openings : ndarray, shape (k,)
        Angle between the sides, in (0, pi), rad.
    convex : ndarray of bool, shape (k,)
        True where matter fills the angle.
    normals : ndarray, shape (w,)
        Direction of each wall's normal, from free space into the wall, rad.
    end_points : ndarray, shape (w, 2, 2)
        First and last point of each wall, m.

    Raises
    ------
    ValueError
        If the shapes disagree or a number is not finite.
    """

    corners: Floats
    directions: Floats
    openings: Floats
    convex: NDArray[np.bool_]
    normals: Floats
    end_points: Floats

    def __post_init__(self) -> None:
        k, w = len(self.directions), len(self.normals)
        wanted = {"corners": (k, 2), "directions": (k,), "openings": (k,), "convex": (k,), "normals": (w,)}
        for name, shape in (wanted | {"end_points": (w, 2, 2)}).items():
            values = getattr(self, name)
            if np.shape(values) != shape or not np.isfinite(values).all():
                raise ValueError(f"Constellation.{name} must be finite and of shape {shape}, is {np.shape(values)}")


@dataclass(frozen=True, slots=True)
class Proposal:
    """A place where the local constellation may lie in the map.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Pose of the local frame in the map's: m, m, rad.
    corner_pairs, wall_pairs : ndarray of int, shape (n, 2) and (m, 2)
        Indices of the local and the known landmark. Several local walls may be parts of one known wall.
    score : float
        Landmarks that agree, a corner counting two and a wall of a metre or more one, as far as both directions are
        held, times the part of the local constellation that was found. The best other proposal's score as a part of
        the best's tells how ambiguous the place is.
    residual : float
        Root mean square of the pairs' distances, m.
    """

    pose: Floats
    corner_pairs: Ints
    wall_pairs: Ints
    score: float
    residual: float


def _rows(of: Constellation) -> Floats:
    """Landmarks as the kernels take them, the corners first."""
    k, w = len(of.directions), len(of.normals)
    ends = np.asarray(of.end_points, dtype=np.float64)
    rows = np.zeros((k + w, 7))
    rows[:k, :2], rows[k:, :2] = of.corners, ends.mean(axis=1)
    rows[:k, DIRECTION], rows[k:, DIRECTION] = of.directions, of.normals
    rows[:k, OPENING] = of.openings
    rows[:k, KIND], rows[k:, KIND] = np.where(of.convex, CONVEX, CONCAVE), WALL
    rows[k:, HALF] = 0.5 * np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    rows[:k, WEIGHT], rows[k:, WEIGHT] = 1.0, np.minimum(2.0 * rows[k:, HALF] / FULL_WALL, 1.0)
    return rows


def propose(
    local: Constellation,
    known: Constellation,
    *,
    guess: Floats | None = None,
    window: Floats | None = None,
    tolerance: float = 0.15,
    angle_tolerance_deg: float = 6.0,
    min_pairs: int = 3,
    keep: int = 5,
) -> tuple[Proposal, ...]:
    """Places where the local constellation may lie in the map, best first.

    Parameters
    ----------
    local : Constellation
        What was seen around the robot, in a frame near it.
    known : Constellation
        The map.
    guess : ndarray, shape (3,), optional
        Pose of the local frame in the map's: m, m, rad; unused without a window.
    window : ndarray, shape (3,), optional
        Half-widths in x, y and heading around the guess in which to search, m, m, rad; by default anywhere.
    tolerance : float
        Landmarks that agree lie at most this far apart, m.
    angle_tolerance_deg : float
        Their directions differ by no more than this, degrees; openings of corners by no more than twice.
    min_pairs : int
        A proposal has at least so many known landmarks that agree.
    keep : int
        At most so many proposals, each farther from the others than three tolerances or two angle tolerances.

    Returns
    -------
    tuple of Proposal
        Empty where nothing fits, or where what fits leaves a direction open.

    Raises
    ------
    ValueError
        If a window comes without a guess, or a number is out of its range.
    """
    if not (tolerance > 0.0 and 0.0 < angle_tolerance_deg < 90.0 and min_pairs > 0 and keep > 0):
        raise ValueError(
            f"propose: tolerance, angle_tolerance_deg (below 90), min_pairs and keep must be positive, "
            f"got {tolerance!r}, {angle_tolerance_deg!r}, {min_pairs!r}, {keep!r}"
        )
    if window is not None and guess is None:
        raise ValueError("propose: a window needs a guess around which to lie")
    for given in (guess, window):
        if given is not None and (np.shape(given) != (3,) or not np.isfinite(given).all()):
            raise ValueError(f"propose: guess and window must be three finite numbers, got {given!r}")
    seen, landmarks = _rows(local), _rows(known)
    if len(seen) == 0 or len(landmarks) == 0:
        return ()
    angle = math.radians(angle_tolerance_deg)
    step = 0.5 * angle
    if window is None or guess is None:
        reach = np.hypot(seen[:, X], seen[:, Y]).max()
        spots = np.concatenate([known.corners, known.end_points.reshape(-1, 2)])
        low, high = spots.min(axis=0) - reach, spots.max(axis=0) + reach
        bins = math.ceil(2.0 * math.pi / step)
        first, step = -math.pi, 2.0 * math.pi / bins
    else:
        low, high = guess[:2] - window[:2], guess[:2] + window[:2]
        side = math.ceil(min(float(window[2]), math.pi) / step)
        first, bins = float(guess[2]) - side * step, 2 * side + 1
    size = max(2.0 * tolerance, math.sqrt(float(np.prod(high - low)) / MOST_CELLS))
    columns, rows = (int(n) for n in np.maximum(np.ceil((high - low) / size), 1.0))
    voters = seen[np.argsort(-seen[:, WEIGHT], kind="stable")[:VOTERS]]
    peaks = vote(voters, landmarks, low, size, columns, rows, first, step, bins, window is None, tolerance, angle, KEPT)
    found, pairs = judge(seen, landmarks, peaks, ROUNDS * tolerance, angle, step)
    chosen: list[Proposal] = []
    for q in np.argsort(-found[:, 3], kind="stable"):
        pose = found[q, :3].copy()
        if found[q, 3] < LEAST or found[q, 5] < min_pairs:
            continue
        if window is not None and guess is not None and (np.abs(_offset(pose, guess)) > window).any():
            continue
        apart = (_offset(pose, better.pose) for better in chosen)
        if any(math.hypot(x, y) < 3.0 * tolerance and abs(turn) < 2.0 * angle for x, y, turn in apart):
            continue
        index = np.flatnonzero(pairs[q] >= 0)
        both = np.column_stack([index, pairs[q, index]])
        walls = index >= len(local.directions)
        wall_pairs = both[walls] - [len(local.directions), len(known.directions)]
        chosen.append(Proposal(pose, both[~walls], wall_pairs, float(found[q, 3]), float(found[q, 4])))
        if len(chosen) == keep:
            break
    return tuple(chosen)


def _offset(pose: Floats, other: Floats) -> Floats:
    return np.append(pose[:2] - other[:2], wrap(pose[2] - other[2]))
