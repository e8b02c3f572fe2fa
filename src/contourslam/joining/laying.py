"""One map laid on another, keyframe by keyframe: from where a few were recognised on to all that still fit."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.poses import between, between_one, compose_one
from contourslam.joining.chart import Chart
from contourslam.matching.align import align

SPACING = 0.8  # m of way between the keyframes that are laid
REACH = 6.0  # m; a keyframe is looked for from others this near, and from these alone is known where it lies
DRIFT, DRIFT_ANGLE = 0.02, math.radians(0.3)  # by which two keyframes of a map may be wrong to each other, per m
BASE, BASE_ANGLE = 0.07, math.radians(1.0)  # and at no distance: m, rad
GATE = 3.0  # standard deviations
LEAST_OVERLAP = 0.6
NEARER = 0.6  # a keyframe that did not fit is tried again from one that is nearer by this factor


@dataclass(frozen=True, slots=True)
class Laid:
    """Keyframes of the second map on the first.

    Attributes
    ----------
    keyframes : ndarray of int, shape (n,)
        Of the second map, ascending: those that fit, and those around them.
    poses : ndarray, shape (n, 3)
        In the first map: m, m, rad.
    fits : ndarray of bool, shape (n,)
    """

    keyframes: Ints
    poses: Floats
    fits: NDArray[np.bool_]


def thinned(chart: Chart, spacing: float = SPACING) -> Ints:
    """Keyframes of a map, one at each so many metres of way, the first of each drive among them."""
    steps = np.floor(chart.way / spacing) + 1e6 * chart.frames.drives
    return np.flatnonzero(np.diff(steps, prepend=-1.0) != 0.0)


def lay(first: Chart, second: Chart, seeds: Iterable[tuple[int, Floats]], keyframes: Ints) -> Laid:
    """Lay a map on another.

    A keyframe is expected where the nearest one that fits has it, as the second map knows the way between the two; the
    map may thus bend as far as its drift allows. The contours of the first map say where it lies.

    Parameters
    ----------
    first, second : Chart
    seeds : iterable of (int, ndarray)
        Keyframes of the second map and their poses in the first.
    keyframes : ndarray of int
        Which are to be laid, ascending.
    """
    own = second.frames.poses
    every = np.union1d(keyframes, np.array([key for key, _ in seeds], np.int64))
    poses, fits = np.full((len(every), 3), np.nan), np.zeros(len(every), np.bool_)
    near, tried = np.full(len(every), np.inf), np.full(len(every), np.inf)
    source = np.full(len(every), -1)

    def spread(at: int) -> None:
        away = _apart(own[every], own[every[at]])
        nearer = away < near
        near[nearer], source[nearer] = away[nearer], at
        near[at], fits[at] = 0.0, True

    for key, pose in seeds:
        at = int(np.searchsorted(every, key))
        found = _fit(first, second, key, pose, 1.0)
        if not fits[at] and found is not None:
            poses[at] = found
            spread(at)
    while True:
        open_ = np.where(fits | (near > REACH) | (near > NEARER * tried), np.inf, near)
        at = int(np.argmin(open_)) if len(open_) else 0
        if not len(open_) or not np.isfinite(open_[at]):
            break
        tried[at] = near[at]
        expected = _expected(own, every, poses, int(source[at]), at)
        found = _fit(first, second, int(every[at]), expected, float(near[at]))
        if found is not None:
            poses[at] = found
            spread(at)
    for at in np.flatnonzero(~fits & (near <= REACH)).tolist():
        poses[at] = _expected(own, every, poses, int(source[at]), at)
    known = np.isfinite(poses[:, 0])
    return Laid(every[known], poses[known], fits[known])


def _apart(poses: Floats, pose: Floats) -> Floats:
    """How far keyframes are from one, m; a turn counts as a way."""
    off = between(pose, poses)
    return np.asarray(np.hypot(off[:, 0], off[:, 1]) + 0.5 * np.abs(off[:, 2]))


def _expected(own: Floats, every: Ints, poses: Floats, source: int, at: int) -> Floats:
    return compose_one(poses[source], between_one(own[every[source]], own[every[at]]))


def _fit(first: Chart, second: Chart, key: int, expected: Floats, away: float) -> Floats | None:
    """Pose of a keyframe in the first map near where it is expected; None where it does not fit."""
    contour = second.contour(key)
    if len(contour) < 8:
        return None
    sigma, turn = BASE + DRIFT * away, BASE_ANGLE + DRIFT_ANGLE * away
    prior = np.diag([1.0 / sigma**2, 1.0 / sigma**2, 1.0 / turn**2])
    found = align(contour, first.known.around(expected), expected, prior)
    off = between_one(expected, found.pose)
    if found.overlap < LEAST_OVERLAP or math.hypot(off[0], off[1]) > GATE * sigma or abs(off[2]) > GATE * turn:
        return None
    return found.pose
