"""Votes for the pose: every pair of a local and a known landmark that may be the same one votes where it would fit.

A generalised Hough transform (Ballard 1981). A corner votes for a spot, a wall for a strip along itself; the votes of
one heading fill a grid over the positions. Each local landmark has one vote a cell, so that dense places of the map do
not win by being dense, and votes across one direction only, as those of a bare corridor, count for little.
"""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap_angle
from contourslam.kernels import kernel
from contourslam.matching.constellation_pairs import (
    DIRECTION,
    HALF,
    KIND,
    OPENING,
    WALL,
    Floats,
    Ints,
    X,
    Y,
    information,
    worth,
)

VOTERS = 64  # so many local landmarks vote at most: those fit one word
HALF_AS_GOOD = 0.5  # peaks of fewer votes than this part of the best's are left out

Masks = NDArray[np.uint64]


@kernel
def pairs_by_heading(
    local: Floats, known: Floats, first: float, step: float, bins: int, opening_tolerance: float
) -> tuple[Ints, Ints, Floats, Ints]:
    """Pairs that may be the same, sorted by turn: local index, known index, turn; and where each bin of turns starts.

    Bin b holds the turns nearest to first + b step; pairs of other turns are left out.
    """
    places = np.zeros(bins + 1, dtype=np.int64)
    starts = places
    mine, other, turns = np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    for counting in (True, False):
        for i in range(local.shape[0]):
            for j in range(known.shape[0]):
                if local[i, KIND] != known[j, KIND]:
                    continue
                if abs(local[i, OPENING] - known[j, OPENING]) > opening_tolerance:
                    continue
                turn = known[j, DIRECTION] - local[i, DIRECTION] - first + 0.5 * step
                turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi))
                b = int(turn / step)
                if b >= bins:
                    continue
                if counting:
                    places[b + 1] += 1
                else:
                    mine[places[b]], other[places[b]], turns[places[b]] = i, j, first + turn - 0.5 * step
                    places[b] += 1
        if counting:
            starts = np.cumsum(places)
            places = starts.copy()
            mine, other = np.empty(starts[-1], np.int64), np.empty(starts[-1], np.int64)
            turns = np.empty(starts[-1])
    return mine, other, turns, starts


@kernel
def stamp(
    mask: Masks, bit: np.uint64, x: float, y: float, tx: float, ty: float, half: float, reach: float
) -> None:  # fmt: skip
    """Set the bit in the cells within `reach` across and `half` along the direction tx, ty of x, y; all in cells."""
    height, width = mask.shape
    steep = abs(ty) > abs(tx)
    if steep:  # walk along the rows in place of the columns
        x, y, tx, ty = y, x, ty, tx
        height, width = width, height
    slope = ty / tx
    across, along = reach * math.sqrt(1.0 + slope * slope), max(half * abs(tx), reach)
    for u in range(max(math.floor(x - along), 0), min(math.floor(x + along), width - 1) + 1):
        middle = y + slope * (u + 0.5 - x)
        for v in range(max(math.floor(middle - across), 0), min(math.floor(middle + across), height - 1) + 1):
            if steep:
                mask[u, v] |= bit
            else:
                mask[v, u] |= bit


@kernel
def _count(mask: np.uint64) -> int:
    """Number of bits that are set."""
    mask = mask - ((mask >> np.uint64(1)) & np.uint64(0x5555555555555555))
    mask = (mask & np.uint64(0x3333333333333333)) + ((mask >> np.uint64(2)) & np.uint64(0x3333333333333333))
    mask = (mask + (mask >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return int((mask * np.uint64(0x0101010101010101)) >> np.uint64(56))


@kernel
def _worth_of(mask: np.uint64, weights: Floats) -> float:
    """Worth of the landmarks whose bits are set."""
    xx = xy = yy = 0.0
    for i in range(weights.shape[0]):
        if (mask >> np.uint64(i)) & np.uint64(1):
            xx, xy, yy = xx + weights[i, 0], xy + weights[i, 1], yy + weights[i, 2]
    return worth(xx, xy, yy)


@kernel
def _gather(mask: Masks, weights: Floats, corners: np.uint64, at: Floats, peaks: Floats, count: int) -> int:
    """Add the peaks of one heading to `peaks` (x, y, heading, worth, cells averaged) and return how many there are.

    `at` holds the least x and y, the size of a cell, the heading and its step. A peak near a better one gives way.
    """
    size, heading, step = at[2], at[3], at[4]
    best = peaks[:, 3].max()
    least = peaks[:, 3].min()
    last, value = np.uint64(0), 0.0
    for v in range(mask.shape[0]):
        for u in range(mask.shape[1]):
            floor = max(least, HALF_AS_GOOD * best)
            votes = mask[v, u]
            if votes == 0:
                continue
            if _count(votes) + _count(votes & corners) <= floor:  # a corner is worth two at most, a wall one
                continue
            if votes != last:  # neighbours mostly have the same votes
                last, value = votes, _worth_of(votes, weights)
            if value <= floor:
                continue
            x, y = at[0] + (u + 0.5) * size, at[1] + (v + 0.5) * size
            slot = -1
            for q in range(count):
                turn = abs(wrap_angle(peaks[q, 2] - heading))
                if turn < 2.5 * step and math.hypot(peaks[q, 0] - x, peaks[q, 1] - y) < 2.5 * size:
                    slot = q
                    break
            if slot >= 0 and value == peaks[slot, 3] and heading == peaks[slot, 2]:  # one more cell of a plateau
                peaks[slot, 4] += 1.0
                peaks[slot, 0] += (x - peaks[slot, 0]) / peaks[slot, 4]
                peaks[slot, 1] += (y - peaks[slot, 1]) / peaks[slot, 4]
            elif slot < 0 or value > peaks[slot, 3]:
                if slot < 0:
                    slot = count if count < peaks.shape[0] else int(np.argmin(peaks[:, 3]))
                    count = min(count + 1, peaks.shape[0])
                peaks[slot, 0], peaks[slot, 1], peaks[slot, 2], peaks[slot, 3], peaks[slot, 4] = (
                    x,
                    y,
                    heading,
                    value,
                    1.0,
                )
                best, least = max(best, value), peaks[:, 3].min()
    return count


@kernel
def vote(
    local: Floats, known: Floats, low: Floats, size: float, columns: int, rows: int, first: float, step: float,
    bins: int, around: bool, tolerance: float, angle_tolerance: float, kept: int,
) -> Floats:  # fmt: skip
    """Poses with the most votes, rows of x, y, heading, worth; in no order.

    The grid begins at `low` and has cells of `size` m, the headings begin at `first`, `around` where they fill a turn.
    """
    mine, other, turns, starts = pairs_by_heading(local, known, first, step, bins, 2.0 * angle_tolerance)
    weights = np.empty((local.shape[0], 3))
    corners = np.uint64(0)
    for i in range(local.shape[0]):
        weights[i, 0], weights[i, 1], weights[i, 2] = information(local[i])
        if local[i, KIND] != WALL:
            corners |= np.uint64(1) << np.uint64(i)
    # The most that a heading could reach says where to begin and when to stop.
    bounds = np.zeros(bins)
    for b in range(bins):
        present = np.uint64(0)
        for c in range(b - 1, b + 2):
            c = c % bins if around else c
            if 0 <= c < bins:
                for p in range(starts[c], starts[c + 1]):
                    present |= np.uint64(1) << np.uint64(mine[p])
        bounds[b] = _worth_of(present, weights)
    peaks, count = np.zeros((kept, 5)), 0
    mask = np.zeros((rows, columns), dtype=np.uint64)
    for b in np.argsort(-bounds):
        if bounds[b] <= max(HALF_AS_GOOD * peaks[:, 3].max(), peaks[:, 3].min()):
            break
        heading = first + b * step
        cos, sin = math.cos(heading), math.sin(heading)
        mask[:] = 0
        for c in range(b - 1, b + 2):
            c = c % bins if around else c
            if c < 0 or c >= bins:
                continue
            for p in range(starts[c], starts[c + 1]):
                i, j = mine[p], other[p]
                if abs(wrap_angle(turns[p] - heading)) > 0.75 * step:  # bins overlap by half a step
                    continue
                x, y = cos * local[i, X] - sin * local[i, Y], sin * local[i, X] + cos * local[i, Y]
                tx, ty, half, lever = 1.0, 0.0, 0.0, math.hypot(x, y)
                if local[i, KIND] == WALL:
                    tx, ty = -math.sin(known[j, DIRECTION]), math.cos(known[j, DIRECTION])
                    half = max(local[i, HALF], known[j, HALF])  # half of the shorter then lies beside the longer
                    lever = abs(tx * x + ty * y)
                reach = tolerance + min(0.5 * step * lever, 2.0 * tolerance)  # half a step of heading moves it so far
                stamp(
                    mask, np.uint64(1) << np.uint64(i), (known[j, X] - x - low[0]) / size,
                    (known[j, Y] - y - low[1]) / size, tx, ty, half / size, reach / size,
                )  # fmt: skip
        count = _gather(mask, weights, corners, np.array([low[0], low[1], size, heading, step]), peaks, count)
    return peaks[:count, :4].copy()  # a view of one row is contiguous, one of two is not: judge would be compiled twice
