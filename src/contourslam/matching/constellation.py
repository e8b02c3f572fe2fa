"""Constellations of corners and walls found again: a map says where it holds what was seen around the robot.

Every pair of a local and a known landmark that could be the same one votes for the poses that would lay them on each
other: a corner for a spot, a wall for a strip along itself. The votes of one heading fill a grid over the positions;
its peaks are refined by least squares and judged again by the pairs that then agree. This is a generalised Hough
transform (Ballard 1981) in which each local landmark has one vote a cell, so that dense places of the map do not win
by their density, and in which votes across one direction only, as those of a bare corridor, count for little.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap, wrap_angle
from contourslam.kernels import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

X, Y, DIRECTION = 0, 1, 2  # of a landmark as the kernels see it: a corner, or the middle of a wall and its normal
OPENING, CONVEX = 3, 4  # of a corner
HALF, WEIGHT = 3, 4  # of a wall: half its length, m; its weight against a corner's 1

FULL_WALL = 2.0  # a wall of this length, m, weighs as much in its one direction as a corner does in both
VOTERS = 31  # so many local corners, and so many walls, vote at most: those fit one word
KEPT = 48  # peaks that are refined
MOST_CELLS = 4e6  # of the grid of positions; beyond, the cells grow
LEAST = 0.2  # a lower score is no place
ROUNDS = np.array([3.0, 2.0, 1.0, 1.0])  # gates of the refinement, in tolerances


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
        Landmarks that agree, in corners' worth, counting only as much as both directions are held, times the part of
        the local constellation that was found. The best other proposal's score as a part of the best's tells how
        ambiguous the place is.
    residual : float
        Root mean square of the pairs' distances, m.
    """

    pose: Floats
    corner_pairs: Ints
    wall_pairs: Ints
    score: float
    residual: float


def _pack(known: Constellation) -> tuple[Floats, Floats]:
    """Rows of the corners and of the walls, as the kernels take them."""
    corners = np.column_stack([known.corners, known.directions, known.openings, known.convex])
    ends = np.asarray(known.end_points, dtype=np.float64)
    half = 0.5 * np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    walls = np.column_stack([ends.mean(axis=1), known.normals, half, np.minimum(2.0 * half / FULL_WALL, 1.0)])
    return corners, walls


@kernel
def _pairs_by_heading(
    corners: Floats, walls: Floats, known_corners: Floats, known_walls: Floats, first: float, step: float, bins: int,
    opening_tolerance: float,
) -> tuple[Ints, Ints, Floats, Ints]:  # fmt: skip
    """Pairs that may be the same: local index (walls after the corners), known index, turn; and where each bin starts.

    Bin b holds the turns nearest to first + b step; pairs of other turns are left out.
    """
    k, w = corners.shape[0], walls.shape[0]
    starts = np.zeros(bins + 1, dtype=np.int64)
    local = np.empty(0, dtype=np.int64)
    known, turns, place = local, np.empty(0), local
    for counting in (True, False):
        for i in range(k + w):
            others = known_corners if i < k else known_walls
            mine = corners[i] if i < k else walls[i - k]
            for j in range(others.shape[0]):
                other = others[j]
                if i < k and (mine[CONVEX] != other[CONVEX] or abs(mine[OPENING] - other[OPENING]) > opening_tolerance):
                    continue
                turn = other[DIRECTION] - mine[DIRECTION] - first + 0.5 * step
                turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi))
                b = int(turn / step)
                if b >= bins:
                    continue
                if counting:
                    starts[b + 1] += 1
                else:
                    p = place[b]
                    local[p], known[p], turns[p] = i, j, first + turn - 0.5 * step
                    place[b] += 1
        if counting:
            starts = np.cumsum(starts)
            place = starts.copy()
            local, known, turns = np.empty(starts[-1], np.int64), np.empty(starts[-1], np.int64), np.empty(starts[-1])
    return local, known, turns, starts


@kernel
def _stamp(
    mask: np.ndarray, bit: np.uint64, x: float, y: float, tx: float, ty: float, half: float, reach: float
) -> None:
    """Set the bit in all cells within `reach` across and `half` along the direction tx, ty of x, y; all in cells."""
    height, width = mask.shape
    steep = abs(ty) > abs(tx)
    if steep:  # walk along the rows in place of the columns
        x, y, tx, ty = y, x, ty, tx
        height, width = width, height
    slope = ty / tx
    across, along = reach * math.sqrt(1.0 + slope * slope), max(half * abs(tx), reach)
    for u in range(max(math.floor(x - along), 0), min(math.floor(x + along), width - 1) + 1):
        v = y + slope * (u + 0.5 - x)
        for s in range(max(math.floor(v - across), 0), min(math.floor(v + across), height - 1) + 1):
            if steep:
                mask[u, s] |= bit
            else:
                mask[s, u] |= bit


@kernel
def _worth(mask: np.uint64, weights: Floats) -> float:
    """Votes of these landmarks, as far as both directions are held: twice the root of the information's determinant."""
    xx = xy = yy = 0.0
    i = 0
    while mask:
        if mask & np.uint64(1):
            xx += weights[i, 0]
            xy += weights[i, 1]
            yy += weights[i, 2]
        mask >>= np.uint64(1)
        i += 1
    return 2.0 * math.sqrt(max(xx * yy - xy * xy, 0.0))


@kernel
def _vote(
    corners: Floats, walls: Floats, known_corners: Floats, known_walls: Floats, low: Floats, cells: Floats,
    first: float, step: float, bins: int, turning: bool, tolerance: float, angle_tolerance: float, kept: int,
) -> Floats:  # fmt: skip
    """Peaks of the votes, rows of x, y, heading, worth; `low` is the least x, y and `cells` their size and numbers."""
    k, w = corners.shape[0], walls.shape[0]
    size = cells[0]
    local, known, turns, starts = _pairs_by_heading(
        corners, walls, known_corners, known_walls, first, step, bins, 2.0 * angle_tolerance
    )
    weights = np.zeros((k + w, 3))  # xx, xy, yy of the information; walls' in the local frame
    for i in range(k + w):
        if i < k:
            weights[i, 0] = weights[i, 2] = 1.0
        else:
            nx, ny = math.cos(walls[i - k, DIRECTION]), math.sin(walls[i - k, DIRECTION])
            weights[i] = walls[i - k, WEIGHT] * np.array([nx * nx, nx * ny, ny * ny])
    # What a heading could reach at most says where to begin and when to stop.
    bounds = np.zeros(bins)
    for b in range(bins):
        present = np.uint64(0)
        for c in range(b - 1, b + 2):
            c = c % bins if turning else c
            if 0 <= c < bins:
                for p in range(starts[c], starts[c + 1]):
                    present |= np.uint64(1) << np.uint64(local[p])
        bounds[b] = _worth(present, weights)
    peaks = np.zeros((kept, 5))  # the last column counts the cells that were averaged
    count, best, least = 0, 0.0, 0.0
    mask = np.zeros((int(cells[2]), int(cells[1])), dtype=np.uint64)
    for b in np.argsort(-bounds):
        if bounds[b] <= 0.0 or bounds[b] < 0.5 * best:
            break
        heading = first + b * step
        cos, sin = math.cos(heading), math.sin(heading)
        mask[:] = 0
        for c in range(b - 1, b + 2):
            c = c % bins if turning else c
            if c < 0 or c >= bins:
                continue
            for p in range(starts[c], starts[c + 1]):
                i, j = local[p], known[p]
                mine = corners[i] if i < k else walls[i - k]
                other = known_corners[j] if i < k else known_walls[j]
                off = abs(wrap_angle(turns[p] - heading))
                if off > (step if i >= k else 1.5 * step):
                    continue
                x, y = cos * mine[X] - sin * mine[Y], sin * mine[X] + cos * mine[Y]
                tx, ty, half = 1.0, 0.0, 0.0
                lever = math.hypot(x, y)
                if i >= k:
                    tx, ty = -math.sin(other[DIRECTION]), math.cos(other[DIRECTION])
                    half = max(mine[HALF], other[HALF])  # half of the shorter wall then lies beside the longer
                    lever = abs(tx * x + ty * y)
                reach = tolerance + min(0.5 * step * lever, 2.0 * tolerance)  # a heading's half step moves it so far
                _stamp(
                    mask, np.uint64(1) << np.uint64(i), (other[X] - x - low[0]) / size, (other[Y] - y - low[1]) / size,
                    tx, ty, half / size, reach / size,
                )  # fmt: skip
        last, worth = np.uint64(0), 0.0
        for v in range(mask.shape[0]):
            for u in range(mask.shape[1]):
                if mask[v, u] != last:  # neighbours mostly have the same votes
                    last = mask[v, u]
                    worth = _worth(last, weights)
                if worth <= least or worth < 0.5 * best:
                    continue
                best = max(best, worth)
                px, py = low[0] + (u + 0.5) * size, low[1] + (v + 0.5) * size
                slot = -1
                for q in range(count):
                    turn = abs(wrap_angle(peaks[q, 2] - heading))
                    if turn < 2.5 * step and math.hypot(peaks[q, 0] - px, peaks[q, 1] - py) < 2.5 * size:
                        slot = q
                        break
                if slot >= 0 and worth == peaks[slot, 3] and heading == peaks[slot, 2]:  # one more of a plateau
                    peaks[slot, 4] += 1.0
                    peaks[slot, 0] += (px - peaks[slot, 0]) / peaks[slot, 4]
                    peaks[slot, 1] += (py - peaks[slot, 1]) / peaks[slot, 4]
                    continue
                if slot < 0:
                    slot = count if count < kept else int(np.argmin(peaks[:, 3]))
                    count = min(count + 1, kept)
                elif worth <= peaks[slot, 3]:
                    continue
                peaks[slot, 0], peaks[slot, 1], peaks[slot, 2] = px, py, heading
                peaks[slot, 3], peaks[slot, 4] = worth, 1.0
                least = peaks[:, 3].min() if count == kept else 0.0
    return peaks[:count]


@kernel
def _pair(
    corners: Floats, walls: Floats, known_corners: Floats, known_walls: Floats, pose: Floats, gate: float,
    angle_gate: float, pairs: Ints, misses: Floats,
) -> None:  # fmt: skip
    """Nearest known landmark of each local one within the gates into `pairs`, else -1; and how far off it is."""
    k, w = corners.shape[0], walls.shape[0]
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    pairs[:] = -1
    misses[:] = gate
    owner = np.full(known_corners.shape[0], -1, dtype=np.int64)
    for i in range(k):
        mine = corners[i]
        x, y = pose[0] + cos * mine[X] - sin * mine[Y], pose[1] + sin * mine[X] + cos * mine[Y]
        for j in range(known_corners.shape[0]):
            other = known_corners[j]
            miss = math.hypot(x - other[X], y - other[Y])
            if miss >= misses[i] or mine[CONVEX] != other[CONVEX]:
                continue
            if abs(mine[OPENING] - other[OPENING]) > 2.0 * angle_gate:
                continue
            if abs(wrap_angle(other[DIRECTION] - mine[DIRECTION] - pose[2])) > angle_gate:
                continue
            if owner[j] >= 0 and misses[owner[j]] <= miss:
                continue
            pairs[i], misses[i] = j, miss
        if pairs[i] >= 0:
            if owner[pairs[i]] >= 0:
                pairs[owner[pairs[i]]] = -1
            owner[pairs[i]] = i
    for i in range(w):
        mine = walls[i]
        x, y = pose[0] + cos * mine[X] - sin * mine[Y], pose[1] + sin * mine[X] + cos * mine[Y]
        for j in range(known_walls.shape[0]):
            other = known_walls[j]
            dx, dy = x - other[X], y - other[Y]
            reach = mine[HALF] + other[HALF]
            if dx * dx + dy * dy > (reach + gate) ** 2:
                continue
            turn = wrap_angle(mine[DIRECTION] + pose[2] - other[DIRECTION])
            if abs(turn) > angle_gate:
                continue
            first, last, across = _overlap(mine, other, dx, dy, turn)
            if last - first < min(mine[HALF], other[HALF]):  # half of the shorter one
                continue
            slope = math.tan(turn)
            miss = math.sqrt(0.5 * ((across + slope * first) ** 2 + (across + slope * last) ** 2))
            if miss < misses[k + i]:
                pairs[k + i], misses[k + i] = j, miss


@kernel
def _overlap(mine: Floats, other: Floats, dx: float, dy: float, turn: float) -> tuple[float, float, float]:
    """Where two walls lie beside each other: from and to along `other` as seen from the middle of `mine`; offset there.

    dx, dy leads from the middle of `other` to that of `mine`; at s along `other` the offset is the third plus s times
    the tangent of the turn.
    """
    nx, ny = math.cos(other[DIRECTION]), math.sin(other[DIRECTION])
    along, across = -ny * dx + nx * dy, nx * dx + ny * dy
    half = mine[HALF] * math.cos(turn)
    return max(-half, -other[HALF] - along), min(half, other[HALF] - along), across


@kernel
def _solve(
    corners: Floats, walls: Floats, known_corners: Floats, known_walls: Floats, pose: Floats, pairs: Ints, sigma: float,
    angle_sigma: float,
) -> Floats:  # fmt: skip
    """One Gauss-Newton step over the pairs; what they leave open stays."""
    k, w = corners.shape[0], walls.shape[0]
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    # A weak prior at the pose itself keeps a direction that nothing holds.
    information = np.diag(np.array([1.0, 1.0, 100.0]))
    gradient = np.zeros(3)
    row = np.empty(3)
    for i in range(k + w):
        j = pairs[i]
        if j < 0:
            continue
        mine = corners[i] if i < k else walls[i - k]
        other = known_corners[j] if i < k else known_walls[j]
        x, y = cos * mine[X] - sin * mine[Y], sin * mine[X] + cos * mine[Y]
        dx, dy = pose[0] + x - other[X], pose[1] + y - other[Y]
        if i < k:
            turn = wrap_angle(mine[DIRECTION] + pose[2] - other[DIRECTION])
            information[2, 2] += 1.0 / angle_sigma**2
            gradient[2] += turn / angle_sigma**2
            for axis in range(2):
                row[0], row[1] = 1.0 - axis, float(axis)
                row[2] = -y if axis == 0 else x
                information += np.outer(row, row) / sigma**2
                gradient += row * (dx if axis == 0 else dy) / sigma**2
        else:
            turn = wrap_angle(mine[DIRECTION] + pose[2] - other[DIRECTION])
            first, last, across = _overlap(mine, other, dx, dy, turn)
            nx, ny = math.cos(other[DIRECTION]), math.sin(other[DIRECTION])
            slope, weight = math.tan(turn), 0.5 * mine[WEIGHT] / sigma**2
            for end in range(2):
                s = first if end == 0 else last
                row[0], row[1] = nx, ny
                row[2] = -nx * y + ny * x + s  # turning moves a point by its lever along the wall
                information += weight * np.outer(row, row)
                gradient += weight * row * (across + slope * s)
    step = np.linalg.solve(information, gradient)
    return np.array([pose[0] - step[0], pose[1] - step[1], wrap_angle(pose[2] - step[2])])


@kernel
def _judge(
    corners: Floats, walls: Floats, known_corners: Floats, known_walls: Floats, peaks: Floats, gates: Floats,
    angle_tolerance: float, slack: float, radius: float,
) -> tuple[Floats, Ints, Floats]:  # fmt: skip
    """Refine each peak; rows of x, y, heading, score, residual; the known landmark of each local one; distinct ones."""
    k, w = corners.shape[0], walls.shape[0]
    found = np.empty((peaks.shape[0], 6))
    all_pairs = np.empty((peaks.shape[0], k + w), dtype=np.int64)
    misses = np.empty(k + w)
    total = float(k)
    for i in range(w):
        total += walls[i, WEIGHT]
    final = gates[-1]
    for q in range(peaks.shape[0]):
        pose = peaks[q, :3].copy()
        near = np.hypot(known_corners[:, X] - pose[0], known_corners[:, Y] - pose[1]) < radius
        near_walls = np.hypot(known_walls[:, X] - pose[0], known_walls[:, Y] - pose[1]) < radius + known_walls[:, HALF]
        some, some_walls = np.flatnonzero(near), np.flatnonzero(near_walls)
        few, few_walls = known_corners[some], known_walls[some_walls]
        pairs = all_pairs[q]
        for turn in range(gates.size):
            angle_gate = angle_tolerance + (slack if turn == 0 else 0.0)
            _pair(corners, walls, few, few_walls, pose, gates[turn], angle_gate, pairs, misses)
            if turn + 1 < gates.size:
                pose = _solve(corners, walls, few, few_walls, pose, pairs, 0.5 * final, 0.5 * angle_tolerance)
        xx = xy = yy = agreed = squares = 0.0
        number, distinct = 0, 0
        seen_walls = np.zeros(some_walls.size, dtype=np.bool_)
        for i in range(k + w):
            j = pairs[i]
            if j < 0:
                continue
            credit = 1.0 - (misses[i] / final) ** 2
            squares += misses[i] ** 2
            number += 1
            if i < k:
                xx, yy = xx + credit, yy + credit
                agreed += credit
                distinct += 1
                pairs[i] = some[j]
            else:
                credit *= walls[i - k, WEIGHT]
                nx, ny = math.cos(walls[i - k, DIRECTION]), math.sin(walls[i - k, DIRECTION])
                xx, xy, yy = xx + credit * nx * nx, xy + credit * nx * ny, yy + credit * ny * ny
                agreed += credit
                distinct += 0 if seen_walls[j] else 1
                seen_walls[j] = True
                pairs[i] = some_walls[j]
        found[q, :3] = pose
        found[q, 3] = 2.0 * math.sqrt(max(xx * yy - xy * xy, 0.0)) * agreed / total
        found[q, 4] = math.sqrt(squares / max(number, 1))
        found[q, 5] = float(distinct)
    return found, all_pairs, misses


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
    corners, walls = _pack(local)
    known_corners, known_walls = _pack(known)
    if len(corners) + len(walls) == 0 or len(known_corners) + len(known_walls) == 0:
        return ()
    angle = math.radians(angle_tolerance_deg)
    step = 0.5 * angle
    reach = max((math.hypot(x, y) for x, y in np.concatenate([corners[:, :2], walls[:, :2]])), default=0.0)
    if window is None or guess is None:
        spots = np.concatenate([known_corners[:, :2], known.end_points.reshape(-1, 2)])
        low, high = spots.min(axis=0) - reach, spots.max(axis=0) + reach
        bins = math.ceil(2.0 * math.pi / step)
        step = 2.0 * math.pi / bins
        first = -math.pi
    else:
        low, high = np.asarray(guess)[:2] - np.asarray(window)[:2], np.asarray(guess)[:2] + np.asarray(window)[:2]
        side = math.ceil(min(window[2], math.pi) / step)
        first, bins = float(guess[2]) - side * step, 2 * side + 1
    size = max(2.0 * tolerance, math.sqrt(float(np.prod(high - low)) / MOST_CELLS))
    cells = np.array([size, *np.maximum(np.ceil((high - low) / size), 1.0)])
    loudest = [_longest(corners, np.ones(len(corners))), _longest(walls, walls[:, HALF])]
    peaks = _vote(
        *loudest, known_corners, known_walls, low, cells, first, step, bins, window is None, tolerance, angle, KEPT
    )
    gates = ROUNDS * tolerance
    found, pairs, _ = _judge(
        corners, walls, known_corners, known_walls, peaks, gates, angle, step, reach + 2.0 * gates[0]
    )
    chosen: list[Proposal] = []
    for q in np.argsort(-found[:, 3]):
        pose, score = found[q, :3], float(found[q, 3])
        if score < LEAST or found[q, 5] < min_pairs:
            continue
        if window is not None and (np.abs(_offset(pose, np.asarray(guess))) > window).any():
            continue
        apart = (_offset(pose, other.pose) for other in chosen)
        if any(math.hypot(x, y) < 3.0 * tolerance and abs(turn) < 2.0 * angle for x, y, turn in apart):
            continue
        i = np.flatnonzero(pairs[q] >= 0)
        both = np.column_stack([i, pairs[q, i]])
        of_corners = i < len(corners)
        wall_pairs = both[~of_corners] - [len(corners), 0]
        chosen.append(Proposal(pose.copy(), both[of_corners], wall_pairs, score, float(found[q, 4])))
        if len(chosen) == keep:
            break
    return tuple(chosen)


def _longest(rows: Floats, lengths: Floats) -> Floats:
    """At most so many as may vote."""
    return rows if len(rows) <= VOTERS else rows[np.argsort(-lengths, kind="stable")[:VOTERS]]


def _offset(pose: Floats, other: Floats) -> Floats:
    offset = pose - other
    offset[2] = wrap(offset[2])
    return offset
