"""Which landmark a sighting shows: looks first, then place; cheap tests, for the pose is known to a hand's breadth."""

import math

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.graph.sightings import (
    CONVEX,
    DIRECTION,
    END,
    KIND,
    OPENING,
    START,
    X,
    Y,
)
from contourslam.kernels import kernel
from contourslam.slam.measurement import CORNER

NONE, TAKEN = -1, -2  # no landmark near; one is near, but another sighting fits it better
# The gates: a corner's distance (m), direction and opening (rad); a wall's offset (m), direction (rad), and gap (m)
# along it. Wide ones while the drive goes on, tight ones once the poses are final.
WIDE_GATES = np.array([0.30, math.radians(20.0), math.radians(30.0), 0.15, math.radians(6.0), 0.5])
TIGHT_GATES = np.array([0.20, math.radians(18.0), math.radians(25.0), 0.10, math.radians(4.0), 0.4])


@kernel
def unlikeness(seen: Floats, known: Floats, gates: Floats) -> float:
    """How far two rows in one frame are from being one landmark, in squared gates; infinite beyond any one gate."""
    if seen[KIND] != known[KIND]:
        return math.inf
    dx, dy = seen[X] - known[X], seen[Y] - known[Y]
    turn = -((-(seen[DIRECTION] - known[DIRECTION]) + math.pi) % (2.0 * math.pi) - math.pi)
    if seen[KIND] == CORNER:
        if abs(dx) > gates[0] or abs(dy) > gates[0] or seen[CONVEX] != known[CONVEX]:
            return math.inf
        place = (dx * dx + dy * dy) / gates[0] ** 2
        way, shape = turn / gates[1], (seen[OPENING] - known[OPENING]) / gates[2]
        if place > 1.0 or abs(way) > 1.0 or abs(shape) > 1.0:
            return math.inf
        return float(place + way * way + shape * shape)
    if abs(turn) > gates[4]:  # which tells the two faces of a partition apart too: their normals are opposite
        return math.inf
    nx, ny = math.cos(known[DIRECTION]), math.sin(known[DIRECTION])
    along = -ny * dx + nx * dy
    first, last = max(along + seen[START], known[START]), min(along + seen[END], known[END])
    gap = max(first - last, 0.0)
    if gap > gates[5]:
        return math.inf
    # The two lines are held against each other where the two pieces overlap, or half way between them.
    offset = nx * dx + ny * dy - math.tan(turn) * (0.5 * (first + last) - along)
    if abs(offset) > gates[3]:
        return math.inf
    return float((offset / gates[3]) ** 2 + (turn / gates[4]) ** 2 + (gap / gates[5]) ** 2)


@kernel
def associate(seen: Floats, table: Floats, among: Ints, gates: Floats) -> Ints:
    """Landmark of each sighting.

    A corner is the best for its landmark and its landmark the best for it. A wall just takes its best landmark, for one
    scan may show a wall in several pieces.

    Parameters
    ----------
    seen : ndarray, shape (k, COLUMNS)
    table : ndarray, shape (n, COLUMNS)
        Landmarks, in the same frame.
    among : ndarray of int
        Those that are asked.
    gates : ndarray, shape (6,)

    Returns
    -------
    ndarray of int, shape (k,)
        Rows of `table`, or NONE or TAKEN.
    """
    chosen = np.full(seen.shape[0], NONE, np.int64)
    score = np.full(seen.shape[0], math.inf)
    for i in range(seen.shape[0]):
        for j in among:
            cost = unlikeness(seen[i], table[j], gates)
            if cost < score[i]:
                score[i], chosen[i] = cost, j
    for i in range(seen.shape[0]):
        if chosen[i] < 0 or seen[i, KIND] != CORNER:
            continue
        for k in range(seen.shape[0]):
            if k != i and chosen[k] == chosen[i] and (score[k], k) < (score[i], i):
                chosen[i] = TAKEN
                break
    return chosen


@kernel
def near(table: Floats, count: int, x: float, y: float, reach: float) -> Ints:
    """Rows among the first `count` that have some part within `reach` (m) of a point; rows without a kind are free."""
    out = np.empty(count, np.int64)
    found = 0
    for j in range(count):
        if table[j, KIND] < 0.0:
            continue
        far = reach if table[j, KIND] == CORNER else reach + max(-table[j, START], table[j, END])
        dx, dy = table[j, X] - x, table[j, Y] - y
        if dx * dx + dy * dy < far * far:
            out[found] = j
            found += 1
    return out[:found]
