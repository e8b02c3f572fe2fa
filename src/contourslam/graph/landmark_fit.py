"""Corners and walls fitted to all their sightings at once, given where the keyframes are."""

import math

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.geometry.angles import wrap_angle
from contourslam.graph.sightings import (
    DIRECTION,
    END,
    KIND,
    OPENING,
    PTT,
    PXT,
    PXX,
    PXY,
    PYY,
    START,
    X,
    Y,
)
from contourslam.kernels import kernel
from contourslam.slam.measurement import CORNER

ROUNDS = 5
WIDTH = 2.0  # of the Cauchy kernel, in standard deviations


@kernel
def _second(values: Floats) -> float:
    """Second largest value: an extent that two sightings bear out; the only one where there is but one."""
    first, second = -math.inf, -math.inf
    for v in values:
        if v > first:
            first, second = v, first
        elif v > second:
            second = v
    return first if values.size < 2 else second


@kernel
def _fit_corner(world: Floats, members: Ints, row: Floats) -> None:
    """Robust weighted mean; `row` holds where it begins, and then the result."""
    n = members.size
    for _ in range(ROUNDS):
        # Sums about the present estimate, in the world's axes.
        xx = xy = yy = bx = by = tt = bt = ss = so = chi = 0.0
        for i in members:
            seen = world[i]
            c, s = math.cos(seen[DIRECTION]), math.sin(seen[DIRECTION])
            p, q, r = seen[PXX], seen[PXY], seen[PYY]
            det = p * r - q * q
            a, b, d = r / det, -q / det, p / det  # information in the corner's frame, then in the world's
            ixx, ixy = c * c * a - 2.0 * c * s * b + s * s * d, c * s * (a - d) + (c * c - s * s) * b
            iyy = s * s * a + 2.0 * c * s * b + c * c * d
            ex, ey = seen[X] - row[X], seen[Y] - row[Y]
            et = wrap_angle(seen[DIRECTION] - row[DIRECTION])
            off = ixx * ex * ex + 2.0 * ixy * ex * ey + iyy * ey * ey + et * et / seen[PTT]
            w = 1.0 / (1.0 + off / WIDTH**2)
            chi += w * off
            xx, xy, yy = xx + w * ixx, xy + w * ixy, yy + w * iyy
            bx, by = bx + w * (ixx * ex + ixy * ey), by + w * (ixy * ex + iyy * ey)
            tt, bt = tt + w / seen[PTT], bt + w * et / seen[PTT]
            ss, so = ss + w / seen[PTT], so + w * seen[OPENING] / seen[PTT]
        det = xx * yy - xy * xy
        row[X] += (yy * bx - xy * by) / det
        row[Y] += (xx * by - xy * bx) / det
        row[DIRECTION] = wrap_angle(row[DIRECTION] + bt / tt)
        row[OPENING] = so / ss
    c, s = math.cos(row[DIRECTION]), math.sin(row[DIRECTION])
    more = max(chi / max(3 * n - 3, 1), 1.0)
    a, b, d = yy / det * more, -xy / det * more, xx / det * more
    row[PXX] = c * c * a + 2.0 * c * s * b + s * s * d
    row[PXY] = c * s * (d - a) + (c * c - s * s) * b
    row[PYY] = s * s * a - 2.0 * c * s * b + c * c * d
    row[PXT], row[PTT] = 0.0, more / tt
    row[START], row[END] = _second(world[members, START]), _second(world[members, END])


@kernel
def _fit_wall(world: Floats, members: Ints, row: Floats) -> None:
    """Robust line through pieces of it; the row's point moves to the middle of what was seen of it."""
    n = members.size
    first, last = np.empty(n), np.empty(n)
    for turn in range(ROUNDS):
        # Unknowns: offset of the line at the row's point, and its direction, both about the present estimate.
        xx = xt = tt = bx = bt = chi = 0.0
        nx, ny = math.cos(row[DIRECTION]), math.sin(row[DIRECTION])
        for k in range(n):
            seen = world[members[k]]
            dx, dy = seen[X] - row[X], seen[Y] - row[Y]
            along, offset = -ny * dx + nx * dy, nx * dx + ny * dy
            et = wrap_angle(seen[DIRECTION] - row[DIRECTION])
            det = seen[PXX] * seen[PTT] - seen[PXT] ** 2
            a, b, d = seen[PTT] / det, -seen[PXT] / det, seen[PXX] / det
            off = a * offset * offset + 2.0 * b * offset * et + d * et * et
            w = 1.0 / (1.0 + off / WIDTH**2)
            chi += w * off
            # offset = x - along t, et = t.
            j = d - 2.0 * along * b + along * along * a
            xx, xt, tt = xx + w * a, xt + w * (b - along * a), tt + w * j
            g, h = a * offset + b * et, b * offset + d * et
            bx, bt = bx + w * g, bt + w * (h - along * g)
            first[k], last[k] = -(along + seen[START]), along + seen[END]
        det = xx * tt - xt * xt
        offset, et = (tt * bx - xt * bt) / det, (xx * bt - xt * bx) / det
        start, end = -_second(first), _second(last)
        if start >= end:
            start, end = -first.max(), last.max()
        # The new point: on the new line, in the middle.
        middle = 0.5 * (start + end) if turn < ROUNDS - 1 else 0.0
        offset -= middle * et
        row[X] += offset * nx - middle * ny
        row[Y] += offset * ny + middle * nx
        row[DIRECTION] = wrap_angle(row[DIRECTION] + et)
    more = max(chi / max(2 * n - 2, 1), 1.0)
    row[START], row[END] = start, end
    row[PXX], row[PXT], row[PTT] = more * tt / det, -more * xt / det, more * xx / det
    row[PXY] = row[PYY] = 0.0


@kernel
def fit(world: Floats, labels: Ints, start: Floats) -> Floats:
    """Fit each landmark to its sightings.

    Parameters
    ----------
    world : ndarray, shape (n, COLUMNS)
        Sightings in the world.
    labels : ndarray of int, shape (n,)
        Landmark of each, -1 for none.
    start : ndarray, shape (m, COLUMNS)
        Where each fit begins.

    Returns
    -------
    ndarray, shape (m, COLUMNS)
        Landmarks in the world; those without sightings as in `start`.
    """
    out = start.copy()
    m = start.shape[0]
    counts = np.zeros(m + 1, np.int64)
    for label in labels:
        if label >= 0:
            counts[label + 1] += 1
    begins = np.cumsum(counts)
    members, filled = np.empty(begins[m], np.int64), begins.copy()
    for i in range(labels.size):
        if labels[i] >= 0:
            members[filled[labels[i]]] = i
            filled[labels[i]] += 1
    for j in range(m):
        own = members[begins[j] : begins[j + 1]]
        if own.size == 0:
            continue
        if out[j, KIND] == CORNER:
            _fit_corner(world, own, out[j])
        else:
            _fit_wall(world, own, out[j])
    return out
