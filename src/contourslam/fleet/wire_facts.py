"""Facts as whole numbers: positions, angles and covariances in steps so fine that nothing that matters is lost."""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.errors import MessageError
from contourslam.fleet import wire_contours
from contourslam.fleet.compact import Bytes, Reader, States, Writer, take
from contourslam.fleet.facts import Fact, KeyframeFact, RelationFact, StretchFact
from contourslam.kernels import kernel
from contourslam.slam.measurement import WALL

PLACE, HEADING = 0.001, 1e-4  # of a keyframe's pose, m and rad: where the server begins to look
APART, TURN = 1e-4, 5e-5  # of relative poses, m and rad: no match is surer than 1 mm and 0.02 degrees
STAMP = 1e-6  # s
OCTAVE, LEAST_VARIANCE = 8, 1e-12  # steps a doubling of variances, and the least that is not taken for none
ROOTS, LEAST_ROOT, LEAN = 32, 1e-9, 32  # the same of roots of matrices; steps of their other numbers
CORRELATION = 16
KERNEL = 1e-3  # of a robust kernel's width
POINT, DIRECTION, LENGTH = 0.005, 2.0 * math.pi / 1024, 0.02  # of sightings: m, rad, m
FARTHEST = 1e10  # m, s, rad: beyond it a number is none
MOST_FACTS, MOST_SEEN, MOST_MEMBERS = 10_000, 5_000, 10_000

# Contexts. Of poses three each, of matrices seven: which roots are none, roots, leanings.
(FACT, NUMBER, WHEN, BLUR, DRIVE, POINTS, SIGHTINGS, FROM, TO, WIDTH, TIE, ANCHOR, MEMBERS, MEMBER) = range(
    wire_contours.CONTEXTS, wire_contours.CONTEXTS + 14
)
POSE, RELATIVE, MEMBER_POSE = MEMBER + 1, MEMBER + 4, MEMBER + 7
INFORMATION = MEMBER + 10  # seven for each kind of relation
KINDS = 3
SIGHTING = INFORMATION + 7 * KINDS  # 13 of corners, 13 of walls
CONTEXTS = SIGHTING + 26
# About how many bits the numbers of each context have: else the first few of a message would cost twice as much.
_SIZES = {
    **{wire_contours.BEARING + n: bits for n, bits in enumerate((1, 2, 4, 4))},
    **{wire_contours.RANGES + n: bits for n, bits in enumerate((2, 2, 3, 5, 9, 9, 7, 9))},
    **{wire_contours.NORMAL + n: bits for n, bits in enumerate((0, 0, 1, 2))},
    **dict.fromkeys((WHEN,), 23),
    **dict.fromkeys((POINTS, *range(POSE, POSE + 3)), 9),
    **dict.fromkeys(range(RELATIVE, RELATIVE + 3), 12),
    **dict.fromkeys(range(MEMBER_POSE, MEMBER_POSE + 3), 12),
    **{SIGHTING + n: bits for n, bits in enumerate((1, 9, 8, 8, 8, 1, 6, 6, 8, 1, 8, 0, 8))},
    **{SIGHTING + 13 + n: bits for n, bits in enumerate((0, 9, 8, 8, 0, 0, 6, 0, 8, 0, 0, 0, 8))},
}
SIZES = tuple(_SIZES.get(context, 0) for context in range(CONTEXTS))

(_KIND, _X, _Y, _DIRECTION, _OPENING, _CONVEX, _START, _END, _PXX, _PXY, _PYY, _PXT, _PTT) = range(13)


def in_steps(value: float, step: float) -> int:
    """Give a number in whole steps.

    Raises
    ------
    MessageError
        If it is not finite, or beyond everything.
    """
    if not abs(value) < FARTHEST:
        raise MessageError(f"{value:g} is no number that can be sent")
    return round(value / step)


def put_pose(writer: Writer, context: int, pose: Floats, place: float, turn: float, before: Ints) -> None:
    """Add a pose by its difference to the one `before`, in steps, which is moved on to this one."""
    steps = [in_steps(float(pose[0]), place), in_steps(float(pose[1]), place), in_steps(float(pose[2]), turn)]
    for i, step in enumerate(steps):
        writer.put(context + i, step - int(before[i]))
    before[:] = steps


def take_pose(reader: Reader, context: int, place: float, turn: float, before: Ints) -> Floats:
    """Give the pose that :func:`put_pose` added; `before` is moved on."""
    for i in range(3):
        before[i] = bounded(int(before[i]) + reader.take(context + i))
    return np.array([before[0] * place, before[1] * place, before[2] * turn])


def bounded(value: int) -> int:
    """Give a whole number, held against what can be.

    Raises
    ------
    MessageError
        If it is beyond everything.
    """
    if abs(value) >= 1 << 53:
        raise MessageError("a number in it is beyond everything; it is damaged or foreign")
    return value


def put_variance(value: float) -> int:
    """Give a variance in steps of its logarithm; 0 for none."""
    if not value < FARTHEST:
        raise MessageError(f"{value:g} is no variance that can be sent")
    return 0 if value < LEAST_VARIANCE else 1 + round(OCTAVE * math.log2(value / LEAST_VARIANCE))


def take_variance(step: int) -> float:
    """Give the variance of a step.

    Raises
    ------
    MessageError
        If it is beyond everything.
    """
    if not 0 <= step <= 80 * OCTAVE:
        raise MessageError("a variance in it is beyond everything; it is damaged or foreign")
    return LEAST_VARIANCE * 2.0 ** ((step - 1) / OCTAVE) if step else 0.0


@kernel
def _root(matrix: Floats) -> Floats:
    """Upper R with R^T R = matrix, by Cholesky; a row of zeros where a direction has nothing left."""
    r = np.zeros((3, 3))
    for i in range(3):
        pivot = matrix[i, i]
        for k in range(i):
            pivot -= r[k, i] * r[k, i]
        if pivot <= 1e-12 * matrix[i, i] or pivot <= LEAST_ROOT * LEAST_ROOT:
            continue
        r[i, i] = math.sqrt(pivot)
        for j in range(i + 1, 3):
            rest = matrix[i, j]
            for k in range(i):
                rest -= r[k, i] * r[k, j]
            r[i, j] = rest / r[i, i]
    return r


def put_matrix(writer: Writer, context: int, matrix: Floats, before: Ints) -> None:
    """Add a covariance or information by its root: any whole numbers give a matrix that is one.

    Raises
    ------
    MessageError
        If it is not finite.
    """
    if not (np.abs(matrix) < 1e18).all():
        raise MessageError("a covariance that is not finite cannot be sent")
    root = _root(np.ascontiguousarray(matrix, np.float64))
    sizes = [0 if d <= 0.0 else 1 + max(round(ROOTS * math.log2(d / LEAST_ROOT)), 0) for d in np.diag(root).tolist()]
    own = [_size(size) for size in sizes]
    for i in range(3):
        writer.put(context + i, sizes[i] - int(before[i]))
    # (I + E) R is told in place of R: what one number is off goes on along its row, and the next ones make up for it;
    # so every part of E is small, however much R slants.
    off = np.zeros((3, 3))
    for n, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        scale, step = (own[j] or own[i]) / LEAN, 0
        if own[i]:
            off[i, i] = own[i] / root[i, i] - 1.0
            wanted = float(root[i, j] + off[i, i:j] @ root[i:j, j])
            step = round(wanted / scale)
            off[i, j] = (step * scale - wanted) / root[j, j] if own[j] else 0.0
        writer.put(context + 3 + n, step)
    before[:] = sizes


def take_matrix(reader: Reader, context: int, before: Ints) -> Floats:
    """Give the matrix that :func:`put_matrix` added; `before` is moved on."""
    root = np.zeros((3, 3))
    for i in range(3):
        before[i] += reader.take(context + i)
        if not 0 <= before[i] <= 70 * ROOTS:
            raise MessageError("a covariance in it is beyond everything; it is damaged or foreign")
        root[i, i] = _size(int(before[i]))
    for n, (i, j) in enumerate(((0, 1), (0, 2), (1, 2))):
        lean = bounded(reader.take(context + 3 + n))
        root[i, j] = lean * (root[j, j] or root[i, i]) / LEAN if root[i, i] else 0.0
    return np.asarray(root.T @ root)


def _size(step: int) -> float:
    return LEAST_ROOT * 2.0 ** ((step - 1) / ROOTS) if step else 0.0


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


def _take_sightings(reader: Reader, count: int) -> NDArray[np.float32]:
    steps = np.zeros((count, 13), np.int64)
    sound = _take_rows(*reader.parts, steps)
    reader.check()
    logarithms, shares = steps[:, [_PXX, _PYY, _PTT]], steps[:, [_PXY, _PXT]]
    sound = sound and bool((logarithms >= 0).all() and (logarithms <= 80 * OCTAVE).all())
    if not sound or (np.abs(shares) >= CORRELATION).any() or (np.abs(steps) > 1 << 40).any():
        raise MessageError("a sighting in it is neither corner nor wall; it is damaged or foreign")
    return _from_sighting_steps(steps)


class _Thread:
    """What the facts of a message are told by the difference to; changed in place."""

    def __init__(self) -> None:
        self.number, self.stamp, self.drive, self.key = -1, 0, 0, 0
        self.pose = np.zeros(3, np.int64)
        self.information = np.zeros((KINDS, 3), np.int64)


def put_facts(writer: Writer, facts: Iterable[Fact]) -> None:
    """Add facts.

    Raises
    ------
    MessageError
        If there are too many, or one holds numbers that are not finite.
    """
    every, thread = tuple(facts), _Thread()
    writer.count(FACT, len(every), MOST_FACTS)
    for fact in every:
        if isinstance(fact, KeyframeFact):
            writer.put(FACT, 0)
            _put_keyframe(writer, fact, thread)
        elif isinstance(fact, RelationFact):
            writer.put(FACT, 1)
            _put_relation(writer, fact, thread)
        else:
            writer.put(FACT, 2)
            _put_stretch(writer, fact, thread)


def take_facts(reader: Reader) -> tuple[Fact, ...]:
    """Give the facts of a message.

    Raises
    ------
    MessageError
        If it is damaged.
    """
    thread, facts = _Thread(), []
    for _ in range(reader.count(FACT, MOST_FACTS)):
        kind = reader.take(FACT)
        if kind not in (0, 1, 2):
            raise MessageError("a fact in it is of no known kind; it is damaged or foreign")
        facts.append((_take_keyframe, _take_relation, _take_stretch)[kind](reader, thread))
    return tuple(facts)


def _put_keyframe(writer: Writer, fact: KeyframeFact, thread: _Thread) -> None:
    stamp = in_steps(fact.stamp, STAMP)
    writer.put(NUMBER, fact.number - thread.number - 1)
    writer.put(WHEN, stamp - thread.stamp)
    writer.put(DRIVE, fact.drive - thread.drive)
    put_pose(writer, POSE, fact.pose, PLACE, HEADING, thread.pose)
    writer.put(BLUR, put_variance(fact.blur))
    writer.count(POINTS, len(fact.points), wire_contours.MOST_POINTS)
    writer.extend(*wire_contours.contour_numbers(fact.points))
    steps = _sighting_steps(fact.seen)
    writer.count(SIGHTINGS, len(steps), MOST_SEEN)
    contexts = SIGHTING + 13 * steps[:, :1] + np.arange(13)
    contexts[:, 0] = SIGHTING
    writer.extend(contexts.ravel(), steps.ravel())
    thread.number = thread.key = fact.number
    thread.stamp, thread.drive = stamp, fact.drive


def _take_keyframe(reader: Reader, thread: _Thread) -> KeyframeFact:
    thread.number = thread.key = bounded(thread.number + 1 + reader.take(NUMBER))
    thread.stamp = bounded(thread.stamp + reader.take(WHEN))
    thread.drive = bounded(thread.drive + reader.take(DRIVE))
    pose = take_pose(reader, POSE, PLACE, HEADING, thread.pose)
    blur = take_variance(reader.take(BLUR))
    points = wire_contours.take_contour(reader, reader.count(POINTS, wire_contours.MOST_POINTS))
    seen = _take_sightings(reader, reader.count(SIGHTINGS, MOST_SEEN))
    return KeyframeFact(thread.number, thread.stamp * STAMP, pose, blur, points, seen, thread.drive)


def _kind(width: int, tie: bool) -> int:
    """Relations of a kind are known about alike: ties, those with a kernel, those without."""
    return 2 if tie else 1 if width else 0


def _put_relation(writer: Writer, fact: RelationFact, thread: _Thread) -> None:
    width = 0 if math.isnan(fact.robust) else 1 + in_steps(max(fact.robust, 0.0), KERNEL)
    kind = _kind(width, fact.tie)
    writer.put(TIE, int(fact.tie))
    writer.put(WIDTH, width)
    writer.put(TO, fact.second - thread.key)
    writer.put(FROM, fact.second - fact.first)
    put_pose(writer, RELATIVE, fact.pose, APART, TURN, np.zeros(3, np.int64))
    put_matrix(writer, INFORMATION + 7 * kind, fact.information, thread.information[kind])
    thread.key = fact.second


def _take_relation(reader: Reader, thread: _Thread) -> RelationFact:
    tie, width = reader.take(TIE), reader.take(WIDTH)
    if tie not in (0, 1) or not 0 <= width < 1 << 40:
        raise MessageError("a relation in it is of no known kind; it is damaged or foreign")
    thread.key = bounded(thread.key + reader.take(TO))
    first = bounded(thread.key - reader.take(FROM))
    pose = take_pose(reader, RELATIVE, APART, TURN, np.zeros(3, np.int64))
    kind = _kind(width, bool(tie))
    information = take_matrix(reader, INFORMATION + 7 * kind, thread.information[kind])
    robust = (width - 1) * KERNEL if width else math.nan
    return RelationFact(first, thread.key, pose, information, robust, bool(tie))


def _put_stretch(writer: Writer, fact: StretchFact, thread: _Thread) -> None:
    if len(fact.members) != len(fact.seen):
        raise MessageError(f"a stretch of {len(fact.members)} keyframes and {len(fact.seen)} poses cannot be sent")
    writer.put(ANCHOR, thread.key - fact.anchor)
    writer.count(MEMBERS, len(fact.members), MOST_MEMBERS)
    before, last = np.zeros(3, np.int64), fact.anchor
    for member, pose in zip(fact.members, fact.seen, strict=True):
        writer.put(MEMBER, member - last)
        put_pose(writer, MEMBER_POSE, pose, APART, TURN, before)
        last = member


def _take_stretch(reader: Reader, thread: _Thread) -> StretchFact:
    anchor = last = bounded(thread.key - reader.take(ANCHOR))
    before, members, seen = np.zeros(3, np.int64), [], []
    for _ in range(reader.count(MEMBERS, MOST_MEMBERS)):
        last = bounded(last + reader.take(MEMBER))
        members.append(last)
        seen.append(take_pose(reader, MEMBER_POSE, APART, TURN, before))
    return StretchFact(anchor, tuple(members), np.array(seen, np.float64).reshape(-1, 3))
