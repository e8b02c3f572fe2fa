"""What the server knows of one run of a robot: its facts, in order, and how they hang together."""

import math
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from hashlib import blake2b

import numpy as np

from contourslam.contour.contours import Floats, Ints
from contourslam.fleet.facts import Fact, KeyframeFact, RelationFact, StretchFact
from contourslam.geometry.poses import between_one, compose_one
from contourslam.graph.places import Keyframe

View = tuple[int, int]
"""First keyframe of the piece that it is of, and number of the stretch in that."""
Identity = tuple[str, float, bytes, int]
"""Robot, stamp, contour, and how many of the same came before in the run."""
KEYS = "it names a keyframe that has not been told of"
FARTHEST, LOCAL = 1e6, 1e3  # m; nobody drives so far, and no local map reaches as far
MOST_SEEN = 1e4  # in the units of sightings
LEAST_ROBUST = 1e-3  # standard deviations
# Information of a direction, 1/m^2 or 1/rad^2: what says less binds nothing, what says more is no measurement.
LEAST_INFORMATION, MOST_INFORMATION = 1e-6, 1e10


class Run:
    """Facts of one run; grows by :meth:`take`.

    Attributes
    ----------
    robot : str
        Its name.
    number : int
        Of the run, drawn by the robot.
    keyframes : list of KeyframeFact
    relations : list of RelationFact
        That wait to be bound in the common map; without the one that ties the first keyframe to the robot's own frame.
    stretches : list of StretchFact
    keys : list of int
        Number of each keyframe in the common map that it has been placed in.
    pieces : list of [int, int]
        First keyframe, and the one after the last, of what this run has added to the common map; each of one drive.
    again : set of int
        Those of `keys` that an earlier run had told of.
    identities : list of Identity or None
        By which each keyframe is known again in another run; None for one that shows nothing.
    way : list of float
        Length of the way up to each keyframe, m; all drives of the run one after the other.
    begins : list of int
        First keyframe of each drive.

    Parameters
    ----------
    robot : str
    number : int
    """

    def __init__(self, robot: str, number: int) -> None:
        self.robot, self.number = robot, number
        self.keyframes: list[KeyframeFact] = []
        self.relations: list[RelationFact] = []
        self.stretches: list[StretchFact] = []
        self.keys: list[int] = []
        self.pieces: list[list[int]] = []
        self.again: set[int] = set()
        self.identities: list[Identity | None] = []
        self._alike: Counter[tuple[float, bytes]] = Counter()
        self.way: list[float] = []
        self.begins: list[int] = []
        self._known_from: dict[int, RelationFact] = {}

    def take(self, fact: Fact) -> str:
        """Take in the next fact.

        Parameters
        ----------
        fact : KeyframeFact, RelationFact or StretchFact

        Returns
        -------
        str
            Why it could not be used; empty where it could.
        """
        wrong = self._wrong(fact)
        if wrong:
            return wrong
        count = len(self.keyframes)
        if isinstance(fact, KeyframeFact):
            if not count or fact.drive != self.keyframes[-1].drive:
                self.begins.append(count)
            self.keyframes.append(fact)
            self.identities.append(self._identity(fact))
            self.way.append(self.way[-1] + self._step(fact.number) if count else 0.0)
        elif isinstance(fact, StretchFact):
            self.stretches.append(fact)
        elif fact.first >= 0:
            self.relations.append(fact)
            self._prefer(fact)
        return ""

    def _wrong(self, fact: Fact) -> str:
        """Tell what of a fact cannot be; empty where nothing is."""
        count = len(self.keyframes)
        if isinstance(fact, KeyframeFact):
            if fact.number != count:
                return f"keyframe {fact.number} comes after keyframe {count - 1}"
            before = self.keyframes[-1].drive if count else 0
            sound = fact.drive >= before and _near(fact.pose) and 0.0 <= fact.blur < MOST_SEEN
            sound = sound and math.isfinite(fact.stamp) and _near(fact.points)
            return "" if sound and (np.abs(fact.seen) < MOST_SEEN).all() else f"keyframe {count}: it cannot be"
        if isinstance(fact, RelationFact):
            name = f"a relation of {fact.first} and {fact.second}"
            if not (-1 <= fact.first < count and 0 <= fact.second < count):
                return f"{name}: {KEYS}"
            sound = fact.first != fact.second and _near(fact.pose) and not fact.robust < LEAST_ROBUST
            return "" if sound and not math.isinf(fact.robust) and _known(fact.information) else f"{name}: it cannot be"
        name = f"a stretch about {fact.anchor}"
        if not fact.members or not all(0 <= number < count for number in (fact.anchor, *fact.members)):
            return f"{name}: {KEYS}"
        return "" if len(fact.seen) == len(fact.members) and _near(fact.seen, LOCAL) else f"{name}: it cannot be"

    def _identity(self, fact: KeyframeFact) -> Identity | None:
        if not len(fact.points):
            return None
        seen = fact.stamp, blake2b(fact.points.tobytes(), digest_size=16).digest()
        self._alike[seen] += 1  # a recording that was mapped twice into one map is in it twice
        return self.robot, *seen, self._alike[seen]

    def place(self, key: int, *, again: bool) -> None:
        """Take in the number that the next keyframe has in the common map, and whether another run had told of it."""
        number = len(self.keys)
        self.keys.append(key)
        if again:
            self.again.add(key)
        elif self.pieces and self.pieces[-1][1] == number and number not in self.begins:
            self.pieces[-1][1] += 1
        else:
            self.pieces.append([number, number + 1])

    @property
    def own(self) -> list[int]:
        """Keyframes that this run has added to the common map."""
        return [number for begin, end in self.pieces for number in range(begin, end)]

    def adds(self, fact: StretchFact) -> bool:
        """Whether a stretch is all placed, and not one that an earlier run had told of."""
        numbers = fact.anchor, *fact.members
        return max(numbers) < len(self.keys) and not all(self.keys[number] in self.again for number in numbers)

    def reach(self, known: Callable[[int], bool]) -> int:
        """Tell how many keyframes can be placed: those up to the last one to which all before it are bound.

        Parameters
        ----------
        known : callable
            Tells whether a keyframe has its place whatever binds it.
        """
        placed = len(self.keys)
        reach, loose = placed, 0
        ends = defaultdict(list)
        for fact in self.relations:
            if max(fact.first, fact.second) >= placed:
                ends[max(fact.first, fact.second)].append(max(min(fact.first, fact.second), placed - 1))
        group = {placed - 1: placed - 1}  # all that is placed is one

        def of(number: int) -> int:
            while group[number] != number:
                group[number] = group[group[number]]
                number = group[number]
            return number

        for number in range(placed, len(self.keyframes)):
            group[number] = number
            loose += 1
            for other in (*ends[number], *((placed - 1,) if known(number) else ())):
                one, two = of(number), of(other)
                if one != two:
                    group[one] = two
                    loose -= 1
            if not loose:
                reach = number + 1
        return reach

    def _step(self, number: int) -> float:
        before, here = self.keyframes[number - 1].pose, self.keyframes[number].pose
        # A loop that was closed in between has moved the robot's map: a keyframe is never as far from the last as that.
        return min(math.hypot(here[0] - before[0], here[1] - before[1]), 1.0)

    def _prefer(self, fact: RelationFact) -> None:
        """Remember what tells best where a keyframe lies: a match to contours rather than the wheels."""
        if fact.tie or fact.first >= fact.second:
            return
        known = self._known_from.get(fact.second)
        if known is None or (math.isnan(fact.robust) and not math.isnan(known.robust)):
            self._known_from[fact.second] = fact

    def known_from(self, number: int) -> tuple[int, Floats]:
        """Tell from which earlier keyframe a keyframe is known best, and how it is seen from there."""
        fact = self._known_from.get(number)
        if fact is not None:
            return fact.first, fact.pose
        return number - 1, between_one(self.keyframes[number - 1].pose, self.keyframes[number].pose)

    def views(self, length: float, begin: tuple[int, int] = (0, 0)) -> Iterator[tuple[tuple[int, int], View, Ints]]:
        """Give the stretches of each piece of this `length` (m), that begin where the one before is half over.

        Parameters
        ----------
        length : float
        begin : (int, int)
            Piece, and number in it, of the first to be given.

        Yields
        ------
        (int, int)
            Piece and number in it.
        View
        ndarray of int, shape (n,)
            Keyframes.
        """
        for piece in range(begin[0], len(self.pieces)):
            first, end = self.pieces[piece]
            from_here = self.way[first]
            count = math.floor(2.0 * (self.way[end - 1] - from_here) / length) - 1
            for k in range(begin[1] if piece == begin[0] else 0, count):
                low = bisect_left(self.way, from_here + 0.5 * k * length, first, end)
                high = bisect_left(self.way, from_here + (0.5 * k + 1.0) * length, first, end)
                yield (piece, k), (first, k), np.arange(low, high)

    def as_keyframe(self, number: int) -> Keyframe:
        """Give a keyframe as the graph has it."""
        fact = self.keyframes[number]
        return Keyframe(fact.stamp, fact.pose, fact.points, fact.blur, fact.drive)

    def chained(self, members: Ints) -> Floats:
        """Poses of keyframes that follow each other, as the run's own contours bind them, seen from the first of them.

        Parameters
        ----------
        members : ndarray of int, shape (n,)
            Ascending without gaps.

        Returns
        -------
        ndarray, shape (n, 3)
        """
        poses = {int(members[0]): np.zeros(3)}
        for number in members[1:].tolist():
            first, seen = self.known_from(number)
            if first not in poses:
                first, seen = number - 1, between_one(self.keyframes[number - 1].pose, self.keyframes[number].pose)
            poses[number] = compose_one(poses[first], seen)
        return np.array(list(poses.values()))


def _near(places: np.ndarray, farthest: float = FARTHEST) -> bool:
    return bool((np.abs(places) < farthest).all())


def _known(information: Floats) -> bool:
    """Whether it is the information of a measurement: finite, positive definite, within limits."""
    if not (np.abs(information) < MOST_INFORMATION).all():
        return False
    return bool(np.linalg.eigvalsh(0.5 * (information + information.T))[0] > LEAST_INFORMATION)
