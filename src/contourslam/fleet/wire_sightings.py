"""Sightings of corners and walls as whole numbers."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.errors import MessageError
from contourslam.fleet import wire_contours
from contourslam.fleet.compact import Bytes, Reader, States, take
from contourslam.kernels import kernel
from contourslam.slam.measurement import WALL

OCTAVE, LEAST_VARIANCE = 8, 1e-12  # steps a doubling of variances, and the least that is not taken for none
CORRELATION = 16
POINT, DIRECTION, LENGTH = 0.005, 2.0 * math.pi / 1024, 0.02  # m, rad, m

SIGHTING = wire_contours.CONTEXTS  # first context: 13 of corners, 13 of walls
CONTEXTS = SIGHTING + 26
(_KIND, _X, _Y, _DIRECTION, _OPENING, _CONVEX, _START, _END, _PXX, _PXY, _PYY, _PXT, _PTT) = range(13)


@kernel
def _take_rows(data: Bytes, state: Ints, states: States, rows: Ints) -> bool:
    for i in range(rows.shape[0]):
        kind = take(data, state, states, SIGHTING)
        if kind != 0 and kind != 1:
            return False
        rows[i, 0] = kind
        for column in range(1, 13):
            rows[i, column] = take(data, state, states, SIGHTING + 13 * kind + column)
    return True


def _sighting_steps(seen: NDArray[np.float32]) -> Ints:
    rows: Floats = np.asarray(seen, np.float64).reshape(-1, 13)
    if not (np.abs(rows) < 1e6).all() or not np.isin(rows[:, _KIND], (0.0, WALL)).all():
        raise MessageError("sightings that are not finite, or neither corners nor walls, cannot be sent")
    steps = np.zeros(rows.shape, np.int64)
    steps[:, _KIND], steps[:, _CONVEX] = rows[:, _KIND], rows[:, _CONVEX] > 0.5
    steps[:, [_X, _Y]] = np.rint(rows[:, [_X, _Y]] / POINT)
    steps[:, [_DIRECTION, _OPENING]] = np.rint(rows[:, [_DIRECTION, _OPENING]] / DIRECTION)
    steps[:, [_START, _END]] = np.rint(rows[:, [_START, _END]] / LENGTH)
    steps[:, _END] += np.where(steps[:, _KIND] == WALL, steps[:, _START], 0)  # a wall's ends mirror each other
    variances = rows[:, [_PXX, _PYY, _PTT]]
    logarithms = 1 + np.rint(OCTAVE * np.log2(np.maximum(variances, LEAST_VARIANCE) / LEAST_VARIANCE))
    steps[:, [_PXX, _PYY, _PTT]] = np.where(variances < LEAST_VARIANCE, 0, logarithms)
    spreads = _spreads(steps)
    for column, other in ((_PXY, 1), (_PXT, 2)):
        both = spreads[:, 0] * spreads[:, other]
        share = np.divide(rows[:, column], both, out=np.zeros(len(rows)), where=both > 0.0)
        steps[:, column] = np.clip(np.rint(CORRELATION * share), 1 - CORRELATION, CORRELATION - 1)
    return steps


def _spreads(steps: Ints) -> Floats:
    """Standard deviations across, along and of the direction, shape (n, 3)."""
    logarithms = steps[:, [_PXX, _PYY, _PTT]]
    return np.where(logarithms > 0, math.sqrt(LEAST_VARIANCE) * 2.0 ** ((logarithms - 1) / (2.0 * OCTAVE)), 0.0)


def _from_sighting_steps(steps: Ints) -> NDArray[np.float32]:
    spreads, rows = _spreads(steps), np.zeros(steps.shape)
    rows[:, _KIND], rows[:, _CONVEX] = steps[:, _KIND], steps[:, _CONVEX]
    rows[:, [_X, _Y]] = steps[:, [_X, _Y]] * POINT
    rows[:, [_DIRECTION, _OPENING]] = steps[:, [_DIRECTION, _OPENING]] * DIRECTION
    rows[:, _START] = steps[:, _START] * LENGTH
    rows[:, _END] = (steps[:, _END] - np.where(steps[:, _KIND] == WALL, steps[:, _START], 0)) * LENGTH
    rows[:, [_PXX, _PYY, _PTT]] = spreads**2
    rows[:, _PXY] = steps[:, _PXY] * spreads[:, 0] * spreads[:, 1] / CORRELATION
    rows[:, _PXT] = steps[:, _PXT] * spreads[:, 0] * spreads[:, 2] / CORRELATION
    return rows.astype(np.float32)


def sighting_numbers(seen: NDArray[np.float32]) -> tuple[Ints, Ints]:
    """Give sightings as contexts and numbers of a :class:`contourslam.fleet.compact.Writer`.

    Raises
    ------
    MessageError
        If one is not finite, or neither corner nor wall.
    """
    steps = _sighting_steps(seen)
    contexts = SIGHTING + 13 * steps[:, :1] + np.arange(13)
    contexts[:, 0] = SIGHTING
    return contexts.ravel(), steps.ravel()


def take_sightings(reader: Reader, count: int) -> NDArray[np.float32]:
    """Give so many sightings, shape (count, 13), rows of :mod:`contourslam.graph.sightings`.

    Raises
    ------
    MessageError
        If they are damaged.
    """
    steps = np.zeros((count, 13), np.int64)
    sound = _take_rows(*reader.parts, steps)
    reader.check()
    logarithms, shares = steps[:, [_PXX, _PYY, _PTT]], steps[:, [_PXY, _PXT]]
    sound = sound and bool((logarithms >= 0).all() and (logarithms <= 80 * OCTAVE).all())
    if not sound or (np.abs(shares) >= CORRELATION).any() or (np.abs(steps) > 1 << 40).any():
        raise MessageError("a sighting in it is neither corner nor wall; it is damaged or foreign")
    return _from_sighting_steps(steps)
