"""Contours in few bytes: steps of bearing, range and normal, told by how they differ from what is expected."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.errors import MessageError
from contourslam.fleet.compact import Bytes, Reader, States, take
from contourslam.kernels import kernel

# Finer, the bytes grow by one bit a point and number for each half; coarser, alignments move by more than a millimetre.
BEARINGS = 8192  # steps of a turn
RANGE = 0.005  # m
NORMALS = 64  # steps of a turn
FARTHEST = 1 << 17  # steps of range: 655 m
MOST_POINTS = 20_000  # of one keyframe

BEARING, RANGES, NORMAL = 0, 4, 12  # first contexts
CONTEXTS = 16
BASE = 3  # points back to the other end of the line on which the next one is expected
BREAK, AWAY = 16, 240  # steps of range and of bearing beyond which another surface begins
SKIP = 4  # steps of bearing below which a step is never a long one


@kernel
def _wrap(value: int, turn: int) -> int:
    return int((value + turn // 2) % turn - turn // 2)


@kernel
def _size(value: int) -> int:
    """How far a number was off, in four classes."""
    off = abs(value)
    return 0 if off <= 1 else 1 if off <= 4 else 2 if off <= 12 else 3


@kernel
def _expected(steps: Ints, i: int, begun: int, turn: int) -> int:
    """Range of point i, `turn` on from the one before, on the line through that one and another of the same surface."""
    if i == 0:
        return 0
    r1, base = int(steps[i - 1, 1]), min(i - 1 - begun, BASE)
    if base < 1 or turn <= 0:
        return r1
    r0, way = steps[i - 1 - base, 1], _wrap(steps[i - 1, 0] - steps[i - 1 - base, 0], BEARINGS)
    # 1 / r is linear in the bearing, as far as the turn is small.
    under = r0 * way + (r0 - r1) * turn
    if way <= 0 or under <= 0:
        return r1
    r = int((r0 * r1 * way) // under)
    return r if 3 * r <= 4 * r1 and 3 * r1 <= 4 * r else r1


@kernel
def _next(last: Ints, turn: int, off: int, bend: int, begun: int, i: int) -> int:
    """Move `last` (turn, its change, range off, bend) on to point i; returns the point at which its surface began."""
    last[1], last[2], last[3] = turn - last[0], off, bend
    last[0] = turn
    return i if abs(off) > BREAK or abs(turn) > AWAY else begun


@kernel
def _range_context(last: Ints, turn: int) -> int:
    return RANGES + _size(last[2]) + (4 if abs(turn) > 3 * max(abs(int(last[0])), SKIP) else 0)


@kernel
def _normal_context(last: Ints, off: int, turn: int) -> int:
    return NORMAL + (2 if last[3] else 0) + (1 if abs(off) > BREAK or abs(turn) > AWAY else 0)


@kernel
def _code(steps: Ints, contexts: Ints, values: Ints) -> None:
    last, begun = np.array([0, 0, FARTHEST, NORMALS]), 0
    for i in range(steps.shape[0]):
        before = steps[i - 1] if i else np.zeros(3, np.int64)
        turn = _wrap(steps[i, 0] - before[0], BEARINGS)
        off, bend = steps[i, 1] - _expected(steps, i, begun, turn), _wrap(steps[i, 2] - before[2], NORMALS)
        contexts[3 * i], values[3 * i] = BEARING + _size(last[1]), turn - last[0]
        contexts[3 * i + 1], values[3 * i + 1] = _range_context(last, turn), off
        contexts[3 * i + 2], values[3 * i + 2] = _normal_context(last, off, turn), bend
        begun = _next(last, turn, off, bend, begun, i)


@kernel
def _decode(data: Bytes, state: Ints, states: States, steps: Ints) -> bool:
    """Fill the steps; False where they are none that can be."""
    last, begun = np.array([0, 0, FARTHEST, NORMALS]), 0
    bearing = normal = 0
    for i in range(steps.shape[0]):
        turn = last[0] + take(data, state, states, BEARING + _size(last[1]))
        if not -BEARINGS <= turn <= BEARINGS:
            return False
        off = take(data, state, states, _range_context(last, turn))
        r = _expected(steps, i, begun, turn) + off
        bend = take(data, state, states, _normal_context(last, off, turn))
        if not 0 <= r <= FARTHEST or not -NORMALS <= bend <= NORMALS:
            return False
        bearing, normal = (bearing + turn) % BEARINGS, (normal + bend) % NORMALS
        steps[i, 0], steps[i, 1], steps[i, 2] = bearing, r, normal
        begun = _next(last, turn, off, bend, begun, i)
    return True


def to_steps(points: NDArray[np.float32]) -> Ints:
    """Give points and normals as steps of bearing, range and the direction of the normal, shape (n, 3).

    Raises
    ------
    MessageError
        If they are too many, too far away or not finite.
    """
    rows: Floats = points.astype(np.float64)
    ranges = np.hypot(rows[:, 0], rows[:, 1])
    if len(rows) > MOST_POINTS or not np.isfinite(rows).all() or (ranges > FARTHEST * RANGE).any():
        raise MessageError(
            f"a contour of {len(rows)} points cannot be sent: {MOST_POINTS} at most, within {FARTHEST * RANGE:.0f} m"
        )
    steps = np.empty((len(rows), 3), np.int64)
    steps[:, 1] = np.rint(ranges / RANGE)
    bearings = np.rint(np.arctan2(rows[:, 1], rows[:, 0]) * (BEARINGS / (2.0 * math.pi)))
    steps[:, 0] = np.where(steps[:, 1] > 0, bearings % BEARINGS, 0)
    steps[:, 2] = np.rint(np.arctan2(rows[:, 3], rows[:, 2]) * (NORMALS / (2.0 * math.pi))) % NORMALS
    return steps


def to_points(steps: Ints) -> NDArray[np.float32]:
    """Points and normals of steps, shape (n, 4)."""
    bearings, normals = steps[:, 0] * (2.0 * math.pi / BEARINGS), steps[:, 2] * (2.0 * math.pi / NORMALS)
    ranges = steps[:, 1] * RANGE
    columns = (ranges * np.cos(bearings), ranges * np.sin(bearings), np.cos(normals), np.sin(normals))
    return np.stack(columns, axis=1).astype(np.float32)


def contour_numbers(points: NDArray[np.float32]) -> tuple[Ints, Ints]:
    """Give the numbers that stand for a contour, with their contexts, both of shape (3 n,).

    Raises
    ------
    MessageError
        As :func:`to_steps`.
    """
    steps = to_steps(points)
    contexts, values = np.empty(3 * len(steps), np.int64), np.empty(3 * len(steps), np.int64)
    _code(steps, contexts, values)
    return contexts, values


def take_contour(reader: Reader, count: int) -> NDArray[np.float32]:
    """Read a contour of `count` points.

    Raises
    ------
    MessageError
        If the numbers make no contour, or end too early.
    """
    steps = np.zeros((count, 3), np.int64)
    if not _decode(*reader.parts, steps):
        raise MessageError("a contour in it leaves the plane; it is damaged or foreign")
    reader.check()
    return to_points(steps)
