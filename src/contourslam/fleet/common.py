"""A common map: runs that share a frame, bound by their own relations and to each other by contours."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.fleet.common_kept import Bond, assemble
from contourslam.fleet.runs import Identity, Run
from contourslam.geometry.poses import between_one, compose, compose_one, inverse
from contourslam.graph.places import ROBUST_TIES, Keyframe, Place, Places
from contourslam.graph.pose_graph import PoseGraph
from contourslam.joining.joint import Joint
from contourslam.maps.saved_map import SavedMap
from contourslam.matching.small import invert

HALF_WIDTH = 40.0  # m; contours farther from the anchor of a stretch are left out
START = np.full(3, 1e-4)  # standard deviations of the pose at which the common map begins
UPDATE, UPDATE_LATER = 4, 300  # keyframes that enter the graph together; one more for so many that are in it
REFRESH = 52  # keyframes after which all stretches are asked anew where they are; later more seldom
REACH = 5.0  # m; a stretch of another run whose middle is this near may see what the robot sees
TRIED = 3  # stretches that a keyframe is held against, until it fits one
PAUSE = 0.45  # m of way after a tie to another run in which a further one would say little more
LEAST_OVERLAP = 0.65
STEPS_AFTER_JOINT = 5  # further steps of iSAM2


@dataclass(frozen=True, slots=True)
class Joined:
    """Two common maps became one.

    Attributes
    ----------
    at : float
        s, in the clock of whoever drives the server.
    kept, gone : int
        Number of the common map that they are now, and of the one that went into it.
    members, joining : tuple of str
        Robots of either, as they were.
    joint : Joint
        How the second lay in the first, and on which evidence they were joined.
    """

    at: float
    kept: int
    gone: int
    members: tuple[str, ...]
    joining: tuple[str, ...]
    joint: Joint


class CommonMap:
    """Runs that share a frame: that of the first keyframe of the first of them; changed in place.

    Attributes
    ----------
    number : int
    runs : list of Run
        Each with the numbers of its keyframes here, ``run.keys``.
    owners : list of (Run, int)
        Run and number of each keyframe.
    ties : int
        Keyframes tied to a stretch of another run.
    joined : tuple of Joined
        How it came about.

    Parameters
    ----------
    number : int
    runs : sequence of Run
    """

    def __init__(self, number: int, runs: Sequence[Run] = ()) -> None:
        self.number, self.runs = number, list(runs)
        self.owners: list[tuple[Run, int]] = []
        self.joined: tuple[Joined, ...] = ()
        self.ties = 0
        self._keyframes: list[Keyframe] = []
        self._graph, self._places = PoseGraph(), Places(self._keyframes, HALF_WIDTH)
        self._poses: list[Floats] = []  # as they were when last asked for
        self._bonds: list[Bond] = []
        self._found: list[Bond] = []  # ties that enter the graph with the next keyframes
        self._stretched: dict[Run, int] = {}  # stretches of each run that are in
        self._known: dict[Identity, int] = {}
        self._tied_at: dict[Run, float] = {}
        self._refresh_due = 0

    def __len__(self) -> int:
        return len(self.owners)

    @property
    def members(self) -> tuple[str, ...]:
        """Robots, each once."""
        return tuple(sorted({run.robot for run in self.runs}))

    @property
    def waiting(self) -> int:
        """Keyframes that can be placed and are not yet."""
        return sum(self._reach(run) - len(run.keys) for run in self.runs)

    @property
    def due(self) -> bool:
        """Whether so many wait that they should enter the graph."""
        return self.waiting >= UPDATE + len(self) // UPDATE_LATER

    def pose(self, run: Run, number: int) -> Floats:
        """Base at a keyframe in the frame of this map, as it was when last asked for: shape (3,)."""
        return self._poses[run.keys[number]]

    def covariance(self, run: Run, number: int) -> Floats:
        """Give the covariance of that pose in the axes of this map, shape (3, 3)."""
        return self._graph.covariance(run.keys[number])

    def advance(self) -> None:
        """Place all keyframes that wait, and tie them to the stretches of other runs around them."""
        fresh = self._place()
        self._bind()
        self._graph.update()
        self._settle_in(fresh)
        self._stretch()
        if len(self) >= self._refresh_due:
            self.refresh()
        if len(self.runs) > 1:
            for key in fresh:
                self._tie(key)

    def _place(self) -> list[int]:
        """Give each new keyframe its number here and the pose that its own run tells."""
        begin = len(self)
        for run in self.runs:
            for number in range(len(run.keys), self._reach(run)):
                identity, key = run.identities[number], len(self)
                known = None if identity is None else self._known.setdefault(identity, key)
                if known is not None and known != key:
                    run.place(known, again=True)
                    continue
                self._poses.append(self._guess(run, number, begin))
                self._keyframes.append(run.as_keyframe(number))
                self.owners.append((run, number))
                run.place(key, again=False)
        for key in range(begin, len(self)):
            self._graph.add(key, self._poses[key])
        if begin == 0 and len(self):
            self._graph.fix(0, self._poses[0], START)
        return list(range(begin, len(self)))

    def _reach(self, run: Run) -> int:
        """How many keyframes of a run have a place: the first of all, those known from elsewhere, what is bound."""
        if len(run.keys) == len(run.keyframes):
            return len(run.keys)
        empty = not len(self)
        return run.reach(lambda number: (empty and number == 0) or run.identities[number] in self._known)

    def _guess(self, run: Run, number: int, settled: int) -> Floats:
        if number == 0:
            return np.zeros(3)
        first, seen = run.known_from(number)
        key = run.keys[first]
        # The graph is at rest here, but for what is placed just now.
        return compose_one(self._graph.pose(key) if key < settled else self._poses[key], seen)

    def _bind(self) -> None:
        """Let the runs' own relations, and the ties found since, enter the graph."""
        for run in self.runs:
            waiting, run.relations = run.relations, []
            for fact in waiting:
                if max(fact.first, fact.second) >= len(run.keys):
                    run.relations.append(fact)
                    continue
                robust = None if math.isnan(fact.robust) else fact.robust
                first, second = run.keys[fact.first], run.keys[fact.second]
                if first not in run.again or second not in run.again:  # else the run before has told it
                    self._relate(Bond(first, second, fact.pose, fact.information, robust, fact.tie))
        for bond in self._found:
            self._relate(bond)
        self._found = []

    def _relate(self, bond: Bond) -> None:
        self._bonds.append(bond)
        self._graph.relate(bond.first, bond.second, bond.pose, bond.information, bond.robust, tie=bond.tie)

    def _settle_in(self, keys: Iterable[int]) -> None:
        for key in keys:
            self._poses[key] = self._graph.pose(key)

    def _stretch(self) -> None:
        """Take in the stretches that are finished."""
        for run in self.runs:
            for fact in run.stretches[self._stretched.get(run, 0) :]:
                if max(fact.anchor, *fact.members) >= len(run.keys):
                    break
                self._stretched[run] = self._stretched.get(run, 0) + 1
                if run.adds(fact):
                    anchor = run.keys[fact.anchor]
                    members = tuple(run.keys[number] for number in fact.members)
                    self._places.put(Place(anchor, members, fact.seen, 0), self._graph.pose(anchor))

    def refresh(self) -> None:
        """Ask the graph anew where everything is."""
        self._refresh_due = len(self) + REFRESH + len(self) // REFRESH
        if len(self):
            self._poses = list(self._graph.poses(range(len(self))))
            self._places.move(np.array([self._poses[p.anchor] for p in self._places.list]).reshape(-1, 3))

    def _tie(self, key: int) -> None:
        """Align a keyframe to the nearest stretch of another run that fits."""
        run, number = self.owners[key]
        if run.way[number] < self._tied_at.get(run, -math.inf) + PAUSE:
            return
        pose, tried = self._poses[key], 0
        for place in self._places.near(pose, len(self._places), REACH)[0].tolist():
            anchor = self._places.list[place].anchor
            if self.owners[anchor][0] is run or anchor in run.again:  # the robot itself ties to its own places
                continue
            guess = between_one(self._graph.pose(anchor), pose)
            # One from far off would be a guess: whoever has driven apart for so long is looked for anew.
            found = self._places.tie(place, key, guess, LEAST_OVERLAP)
            if found is not None:
                self._found.append(Bond(anchor, key, found[0], invert(found[1]), ROBUST_TIES, True))
                self._tied_at[run] = run.way[number]
                self.ties += 1
                return
            tried += 1
            if tried == TRIED:
                return

    def laid_by(self, joint: Joint, other: "CommonMap") -> Joint:
        """Give a joint of some time ago as its surest tie lays the other map now."""
        surest = joint.surest
        there = compose_one(self._poses[surest.first], surest.pose)
        return replace(joint, pose=compose_one(there, inverse(other._poses[surest.second])))

    def absorb(self, other: "CommonMap", joint: Joint) -> None:
        """Take in another common map.

        Parameters
        ----------
        other : CommonMap
            Is not to be used any more: its runs belong to this one now.
        joint : Joint
            How it lies in this one, the keyframes of its ties being those of the two common maps.
        """
        offset = len(self)
        moved = compose(joint.pose, np.array(other._poses).reshape(-1, 3))
        self._keyframes += other._keyframes
        for key, pose in enumerate(moved, start=offset):
            self._poses.append(pose)
            self._graph.add(key, pose)
        self.owners += other.owners
        self.runs += other.runs
        for run in other.runs:
            run.keys[:] = [key + offset for key in run.keys]
            run.again = {key + offset for key in run.again}
            self._stretched[run] = other._stretched.get(run, 0)
        for identity, key in other._known.items():
            self._known.setdefault(identity, key + offset)
        for bond in (*other._bonds, *other._found):
            self._relate(replace(bond, first=bond.first + offset, second=bond.second + offset))
        for tie, information, replaceable in joint.bonds():
            self._relate(Bond(tie.first, tie.second + offset, tie.pose, information, ROBUST_TIES, replaceable))
        self._graph.update(STEPS_AFTER_JOINT)
        for place in other._places.list:
            members = tuple(member + offset for member in place.members)
            self._places.put(Place(place.anchor + offset, members, place.seen, 0), moved[place.anchor])
        self.joined += other.joined
        self.ties += other.ties + len(joint.ties)
        self.refresh()

    def kept(self) -> tuple[SavedMap, list[int]]:
        """Give the map as it stands, and the number here of each of its keyframes: those of a run follow each other.

        Only keyframes that are placed are in it, and of their poses no covariance.
        """
        self.refresh()
        order = [run.keys[number] for run in self.runs for number in run.own]
        return assemble(self.runs, np.array(self._poses).reshape(-1, 3), order, self._bonds), order

    def begin_anew(self, saved: SavedMap, order: Sequence[int]) -> None:
        """Take over poses and relations from a refinement of what :meth:`kept` gave."""
        keyframes, relations = saved.keyframes, saved.relations
        if keyframes is None or relations is None:
            raise ValueError("a refined map holds keyframes and relations")
        self._graph, self._bonds = PoseGraph(), []
        for index, key in enumerate(order):
            self._poses[key] = keyframes.poses[index]
        for key, pose in enumerate(self._poses):
            self._graph.add(key, pose)
        for i, (first, second) in enumerate(zip(relations.first.tolist(), relations.second.tolist(), strict=True)):
            width = float(relations.robust[i])
            robust = None if math.isnan(width) else width
            if first < 0:
                self._graph.fix(order[second], relations.poses[i], START)
                continue
            bond = Bond(
                order[first], order[second], relations.poses[i], relations.information[i], robust,
                bool(relations.ties[i]),
            )  # fmt: skip
            self._bonds.append(bond)
            now = between_one(self._poses[bond.first], self._poses[bond.second])
            self._graph.recall(bond.first, bond.second, bond.pose, bond.information, bond.robust, tie=bond.tie, now=now)
        self._graph.update()
        self.refresh()
