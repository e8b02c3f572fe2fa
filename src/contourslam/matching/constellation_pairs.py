"""Which landmarks agree at a pose, the pose that lays them best on each other, and what their agreement is worth."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap_angle
from contourslam.kernels import kernel
from contourslam.matching import small

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Columns of a landmark. A wall stands at its middle and looks along its normal; a corner has no half length, a wall no
# opening. A wall of full weight holds one direction as well as a corner holds both.
X, Y, DIRECTION, KIND, OPENING, HALF, WEIGHT = range(7)
WALL, CONCAVE, CONVEX = 0.0, 1.0, 2.0


@kernel
def information(row: Floats) -> tuple[float, float, float]:
    """What a landmark says of the position, in corners' worth: xx, xy and yy in its own frame."""
    if row[KIND] != WALL:
        return row[WEIGHT], 0.0, row[WEIGHT]
    nx, ny = math.cos(row[DIRECTION]), math.sin(row[DIRECTION])
    return row[WEIGHT] * nx * nx, row[WEIGHT] * nx * ny, row[WEIGHT] * ny * ny


@kernel
def worth(xx: float, xy: float, yy: float) -> float:
    """Information as far as both directions are held: twice the root of its determinant, at most its trace."""
    return 2.0 * math.sqrt(max(xx * yy - xy * xy, 0.0))


@kernel
def _overlap(mine: Floats, other: Floats, dx: float, dy: float, turn: float) -> tuple[float, float, float]:
    """Where two walls lie side by side: from and to along `other` as seen from the middle of `mine`; offset there.

    dx, dy leads from the middle of `other` to that of `mine`. At s along `other` the offset is the third number plus s
    times the tangent of the turn.
    """
    nx, ny = math.cos(other[DIRECTION]), math.sin(other[DIRECTION])
    along, across = -ny * dx + nx * dy, nx * dx + ny * dy
    half = mine[HALF] * math.cos(turn)
    return max(-half, -other[HALF] - along), min(half, other[HALF] - along), across


@kernel
def _miss(mine: Floats, other: Floats, dx: float, dy: float, turn: float) -> tuple[float, float]:
    """How far two landmarks of a kind lie apart, m, and on how much of `mine`; walls across them, inf if side by side.

    dx, dy and turn lead from `other` to `mine`.
    """
    if mine[KIND] != WALL:
        return math.hypot(dx, dy), 1.0
    first, last, across = _overlap(mine, other, dx, dy, turn)
    if last - first < min(mine[HALF], other[HALF]):  # half of the shorter wall has to lie beside the longer
        return math.inf, 0.0
    slope = math.tan(turn)
    miss = math.sqrt(0.5 * ((across + slope * first) ** 2 + (across + slope * last) ** 2))
    return miss, (last - first) / max(2.0 * mine[HALF], 1e-9)


@kernel
def pair_nearest(
    local: Floats, known: Floats, pose: Floats, gate: float, angle_gate: float, pairs: Ints, misses: Floats,
    shares: Floats,
) -> None:  # fmt: skip
    """Nearest known landmark of each local one within the gates into `pairs`, else -1; how far off, on how much of it.

    The corners come first in `known`. A known corner goes to one local corner only; several local walls may be parts of
    one known wall.
    """
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    owner = np.full(known.shape[0], -1, dtype=np.int64)
    pairs[:], misses[:] = -1, gate
    walls = known.shape[0] - int((known[:, KIND] == WALL).sum())  # where they begin
    for i in range(local.shape[0]):
        mine = local[i]
        x, y = pose[0] + cos * mine[X] - sin * mine[Y], pose[1] + sin * mine[X] + cos * mine[Y]
        for j in range(walls, known.shape[0]) if mine[KIND] == WALL else range(walls):
            other = known[j]
            dx, dy = x - other[X], y - other[Y]
            if dx * dx + dy * dy > (mine[HALF] + other[HALF] + misses[i]) ** 2 or mine[KIND] != other[KIND]:
                continue
            if abs(mine[OPENING] - other[OPENING]) > 2.0 * angle_gate:
                continue
            turn = wrap_angle(mine[DIRECTION] + pose[2] - other[DIRECTION])
            if abs(turn) > angle_gate:
                continue
            miss, share = _miss(mine, other, dx, dy, turn)
            if miss < misses[i] and (owner[j] < 0 or miss < misses[owner[j]]):
                pairs[i], misses[i], shares[i] = j, miss, share
        j = pairs[i]
        if j >= 0 and mine[KIND] != WALL:
            if owner[j] >= 0:
                pairs[owner[j]] = -1
            owner[j] = i


@kernel
def solve(local: Floats, known: Floats, pose: Floats, pairs: Ints, sigma: float, angle_sigma: float) -> Floats:
    """One Gauss-Newton step over the pairs from `pose`; a direction that they leave open stays."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    normal = np.diag(np.array([1.0, 1.0, 100.0]))  # a weak prior at the pose itself: a metre, a tenth of a radian
    gradient, row = np.zeros(3), np.empty(3)
    for i in range(local.shape[0]):
        if pairs[i] < 0:
            continue
        mine, other = local[i], known[pairs[i]]
        x, y = cos * mine[X] - sin * mine[Y], sin * mine[X] + cos * mine[Y]
        dx, dy = pose[0] + x - other[X], pose[1] + y - other[Y]
        turn = wrap_angle(mine[DIRECTION] + pose[2] - other[DIRECTION])
        corner = mine[KIND] != WALL
        nx, ny, first, last, across, slope = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if corner:
            normal[2, 2] += 1.0 / angle_sigma**2
            gradient[2] += turn / angle_sigma**2
        else:
            nx, ny = math.cos(other[DIRECTION]), math.sin(other[DIRECTION])
            first, last, across = _overlap(mine, other, dx, dy, turn)
            slope = math.tan(turn)
        for half in range(2):  # a corner's x and y; a wall's offset at either end of the overlap
            if corner:
                nx, ny = 1.0 - half, float(half)
                row[2], off, weight = -nx * y + ny * x, nx * dx + ny * dy, 1.0
            else:
                along = first if half == 0 else last
                row[2], off, weight = -nx * y + ny * x + along, across + slope * along, 0.5 * mine[WEIGHT]
            row[0], row[1] = nx, ny
            for a in range(3):
                gradient[a] += weight / sigma**2 * off * row[a]
                for b in range(3):
                    normal[a, b] += weight / sigma**2 * row[a] * row[b]
    step = small.solve(normal, gradient)
    return np.array([pose[0] - step[0], pose[1] - step[1], wrap_angle(pose[2] - step[2])])


@kernel
def judge(
    local: Floats, known: Floats, starts: Floats, gates: Floats, angle_tolerance: float, slack: float
) -> tuple[Floats, Ints]:
    """Refine each pose of `starts` over the pairs that agree, with one gate (m) a round, and judge it by the last.

    Returns rows of x, y, heading, score, root mean square miss and number of known landmarks that agree; and the known
    landmark of each local one, -1 for none. The score is the pairs' :func:`worth`, each the less the farther it is off
    and the less of a wall it covers, times the part of all local landmarks that they are. `slack` (rad) is added to the
    first round's angle gate.
    """
    found, pairs = np.empty((starts.shape[0], 6)), np.empty((starts.shape[0], local.shape[0]), dtype=np.int64)
    misses, shares = np.empty(local.shape[0]), np.empty(local.shape[0])
    radius = np.sqrt(local[:, X] ** 2 + local[:, Y] ** 2).max() + 2.0 * gates[0] + local[:, HALF].max() + known[:, HALF]
    total, final = local[:, WEIGHT].sum(), gates[-1]
    for q in range(starts.shape[0]):
        pose = starts[q, :3].copy()
        index = np.flatnonzero((known[:, X] - pose[0]) ** 2 + (known[:, Y] - pose[1]) ** 2 < radius**2)
        near = known[index]
        for turn in range(gates.size):
            angle_gate = angle_tolerance + (slack if turn == 0 else 0.0)
            pair_nearest(local, near, pose, gates[turn], angle_gate, pairs[q], misses, shares)
            if turn + 1 < gates.size:
                pose = solve(local, near, pose, pairs[q], 0.5 * final, 0.5 * angle_tolerance)
        xx = xy = yy = agreed = squares = 0.0
        number, seen = 0, np.zeros(near.shape[0])
        for i in range(local.shape[0]):
            if pairs[q, i] < 0:
                continue
            credit = shares[i] * (1.0 - (misses[i] / final) ** 2)
            of_xx, of_xy, of_yy = information(local[i])
            xx, xy, yy = xx + credit * of_xx, xy + credit * of_xy, yy + credit * of_yy
            agreed += credit * local[i, WEIGHT]
            squares += misses[i] ** 2
            number += 1
            seen[pairs[q, i]] = 1.0
            pairs[q, i] = index[pairs[q, i]]
        found[q, :3] = pose
        found[q, 3], found[q, 4], found[q, 5] = (
            worth(xx, xy, yy) * agreed / total,
            math.sqrt(squares / max(number, 1)),
            seen.sum(),
        )
    return found, pairs
