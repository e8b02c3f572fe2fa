"""Equalization: a contour cut into elementary vectors of one arc length (eqs 2-11)."""

import math

import numpy as np

from contourslam.contour.contours import Contours, Floats, Ints
from contourslam.errors import ConfigError
from contourslam.kernels import kernel


@kernel
def _average(points: Floats, start: int, stop: int, least: float, out: Floats, source: Floats) -> int:
    """Average runs of points that span less than `least`; the two end points stay. Returns how many are left."""
    count = 0
    i = start
    while i < stop:
        j = i + 1
        x, y = points[i, 0], points[i, 1]
        # The very ends stay as they are: averaged, they would shorten the contour.
        if i > start:
            while j < stop - 1 and math.hypot(points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]) < least:
                x += points[j, 0]
                y += points[j, 1]
                j += 1
        out[count, 0], out[count, 1] = x / (j - i), y / (j - i)
        source[count] = 0.5 * (i + j - 1)
        count += 1
        i = j
    return count


@kernel
def _equalize_one(
    points: Floats, source: Floats, count: int, p: int, total: float, out: Floats, out_source: Floats
) -> None:
    """Nodes at the ends of p pieces of equal arc length along ``points[:count]``, the first node among them.

    `rest` is what eq. (6) and (11) leave of the current vector gamma(n); a piece takes the rest, then full vectors,
    then the used part of one more (eqs 4-10). The pieces' vectors are the differences of the nodes.
    """
    epsilon = total / p  # eq. (3)
    n = 0
    gamma = math.hypot(points[1, 0] - points[0, 0], points[1, 1] - points[0, 1])
    rest = gamma
    out[0] = points[0]
    out_source[0] = source[0]
    for r in range(1, p):
        need = epsilon
        while rest < need and n < count - 2:  # eq. (7)
            need -= rest
            n += 1
            gamma = math.hypot(points[n + 1, 0] - points[n, 0], points[n + 1, 1] - points[n, 1])
            rest = gamma
        rest -= need  # eqs (6) and (11)
        used = 1.0 - rest / gamma if gamma > 0.0 else 1.0  # eq. (9): along the unit vector of gamma
        out[r, 0] = points[n, 0] + used * (points[n + 1, 0] - points[n, 0])
        out[r, 1] = points[n, 1] + used * (points[n + 1, 1] - points[n, 1])
        out_source[r] = source[n] + used * (source[n + 1] - source[n])
    out[p] = points[count - 1]
    out_source[p] = source[count - 1]


@kernel
def _equalize(
    points: Floats, starts: Ints, closed: np.ndarray, spacing: float, least: float
) -> tuple[Floats, Ints, Floats]:
    contours = closed.size
    m = points.shape[0] + contours
    thin = np.empty((m, 2))
    thin_source = np.empty(m)
    capacity = 4 * m + 64
    out = np.empty((capacity, 2))
    source = np.empty(capacity)
    out_starts = np.zeros(contours + 1, dtype=np.int64)
    filled = 0
    for c in range(contours):
        count = _average(points, starts[c], starts[c + 1], least, thin, thin_source)
        if closed[c]:
            thin[count] = thin[0]
            thin_source[count] = starts[c + 1]
            count += 1
        total = 0.0
        for i in range(count - 1):
            total += math.hypot(thin[i + 1, 0] - thin[i, 0], thin[i + 1, 1] - thin[i, 1])
        pieces = max(round(total / spacing), 1)
        while filled + pieces + 1 > capacity:
            capacity *= 2
            more, more_source = np.empty((capacity, 2)), np.empty(capacity)
            more[:filled], more_source[:filled] = out[:filled], source[:filled]
            out, source = more, more_source
        if count > 1 and total > 0.0:
            _equalize_one(thin, thin_source, count, pieces, total, out[filled:], source[filled:])
            filled += pieces if closed[c] else pieces + 1
        out_starts[c + 1] = filled
    return out[:filled], out_starts, source[:filled]


def equalize(contours: Contours, spacing: float, *, average_below: float = 0.0) -> Contours:
    """Equalize each contour: elementary vectors of equal arc length about `spacing` long (eqs 2-11).

    The paper fixes the number of pieces p; here p is each contour's length over the wished spacing, rounded, so that a
    detector's window means one length on every contour.

    Parameters
    ----------
    contours : Contours
        Raw contours.
    spacing : float
        Wished arc length of a piece, m. It must be long against the range noise, about six to ten standard deviations.
    average_below : float
        Neighbouring points are first averaged until they are this far apart, m. Close to the lidar the raw contour
        zigzags by the noise between points that are nearer than the noise is large, which makes it far too long; this
        is our adaptation, not in the paper. 0 turns it off.

    Returns
    -------
    Contours
        One contour for each raw contour; the pieces of one sum to its end-to-end vector.

    Raises
    ------
    ConfigError
        If `spacing` is not positive.
    """
    if not spacing > 0.0:
        raise ConfigError(f"the spacing of an equalized contour must be positive, got {spacing!r} m")
    points, starts, source = _equalize(contours.points, contours.starts, contours.closed, spacing, average_below)
    return Contours(points, starts, contours.closed, spacing, source)
