"""Facts as whole numbers: positions, angles and covariances in steps so fine that nothing that matters is lost."""

import math
from collections.abc import Iterable

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.errors import MessageError
from contourslam.fleet import wire_contours, wire_sightings
from contourslam.fleet.compact import Reader, Writer
from contourslam.fleet.facts import Fact, KeyframeFact, RelationFact, StretchFact
from contourslam.fleet.wire_sightings import LEAST_VARIANCE, OCTAVE, SIGHTING, sighting_numbers, take_sightings
from contourslam.matching.small import square_root

PLACE, HEADING = 0.001, 1e-4  # of a keyframe's pose, m and rad: where the server begins to look
APART, TURN = 1e-4, 5e-5  # of relative poses, m and rad: no match is surer than 1 mm and 0.02 degrees
STAMP = 1e-6  # s
ROOTS, LEAST_ROOT, LEAN = 32, 1e-9, 32  # the same of roots of matrices; steps of their other numbers
KERNEL = 1e-3  # of a robust kernel's width
FARTHEST = 1e10  # m, s, rad: beyond it a number is none
MOST_FACTS, MOST_SEEN, MOST_MEMBERS = 10_000, 5_000, 10_000

# Contexts. Of poses three each, of matrices six: roots and leanings.
(FACT, NUMBER, WHEN, BLUR, DRIVE, POINTS, SIGHTINGS, FROM, TO, WIDTH, TIE, ANCHOR, MEMBERS, MEMBER) = range(
    wire_sightings.CONTEXTS, wire_sightings.CONTEXTS + 14
)
POSE, RELATIVE, MEMBER_POSE = MEMBER + 1, MEMBER + 4, MEMBER + 7
INFORMATION = MEMBER + 10  # six for each kind of relation
KINDS = 3
CONTEXTS = INFORMATION + 6 * KINDS
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


def put_matrix(writer: Writer, context: int, matrix: Floats, before: Ints) -> None:
    """Add a covariance or information by its root: any whole numbers give a matrix that is one.

    Raises
    ------
    MessageError
        If it is not finite.
    """
    if not (np.abs(matrix) < 1e18).all():
        raise MessageError("a covariance that is not finite cannot be sent")
    root = square_root(np.ascontiguousarray(matrix, np.float64), LEAST_ROOT * LEAST_ROOT)
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
    writer.count(SIGHTINGS, len(fact.seen), MOST_SEEN)
    writer.extend(*sighting_numbers(fact.seen))
    thread.number = thread.key = fact.number
    thread.stamp, thread.drive = stamp, fact.drive


def _take_keyframe(reader: Reader, thread: _Thread) -> KeyframeFact:
    thread.number = thread.key = bounded(thread.number + 1 + reader.take(NUMBER))
    thread.stamp = bounded(thread.stamp + reader.take(WHEN))
    thread.drive = bounded(thread.drive + reader.take(DRIVE))
    pose = take_pose(reader, POSE, PLACE, HEADING, thread.pose)
    blur = take_variance(reader.take(BLUR))
    points = wire_contours.take_contour(reader, reader.count(POINTS, wire_contours.MOST_POINTS))
    seen = take_sightings(reader, reader.count(SIGHTINGS, MOST_SEEN))
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
    put_matrix(writer, INFORMATION + 6 * kind, fact.information, thread.information[kind])
    thread.key = fact.second


def _take_relation(reader: Reader, thread: _Thread) -> RelationFact:
    tie, width = reader.take(TIE), reader.take(WIDTH)
    if tie not in (0, 1) or not 0 <= width < 1 << 40:
        raise MessageError("a relation in it is of no known kind; it is damaged or foreign")
    thread.key = bounded(thread.key + reader.take(TO))
    first = bounded(thread.key - reader.take(FROM))
    pose = take_pose(reader, RELATIVE, APART, TURN, np.zeros(3, np.int64))
    kind = _kind(width, bool(tie))
    information = take_matrix(reader, INFORMATION + 6 * kind, thread.information[kind])
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
