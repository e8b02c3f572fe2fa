"""Which maps belong together: the surest joints make trees, and every other joint must agree with the way round."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap_angle
from contourslam.geometry.poses import between_one, compose_one, inverse
from contourslam.graph.doubt import DoubtTree
from contourslam.graph.places import FARTHEST
from contourslam.graph.regrown import regrow
from contourslam.joining.building import Pair, keyframes_of
from contourslam.joining.joint import Joint, Tie
from contourslam.joining.shared import shared
from contourslam.joining.ties import turned_tie
from contourslam.maps.saved_map import SavedMap
from contourslam.matching.small import moved, solve, turned

EXACT = np.diag([1e-8, 1e-8, 1e-8])  # covariance of a keyframe as seen from itself
UNLIKELY = 16.3  # squared distance that three numbers off by chance exceed once in a thousand times


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A joint that contradicts surer ones.

    Attributes
    ----------
    maps : (int, int)
    off : ndarray, shape (3,)
        How far its second keyframe lies from where the surer joints have it: m, m, rad.
    sigma : ndarray, shape (3,)
        Standard deviations of that.
    """

    maps: Pair
    off: Floats
    sigma: Floats


@dataclass(frozen=True, slots=True)
class Group:
    """Maps that belong together.

    Attributes
    ----------
    members : tuple of int
        Numbers of the maps, that with the most keyframes first, the others in their order.
    frames : ndarray, shape (n, 3)
        Frame of each in that of the first, about: m, m, rad.
    joints : tuple of (int, int)
        Pairs of maps whose joints hold.
    left_out : tuple of LeftOut
    """

    members: tuple[int, ...]
    frames: Floats
    joints: tuple[Pair, ...]
    left_out: tuple[LeftOut, ...]


def strength(joint: Joint) -> float:
    """Metres of surface that speak for a joint, less what speaks for its rival."""
    return joint.evidence.agreeing * (1.0 - joint.evidence.rival)


def find_groups(maps: Sequence[SavedMap], joints: Mapping[Pair, Joint]) -> tuple[Group, ...]:
    """Sort maps into groups whose joints agree.

    Parameters
    ----------
    maps : sequence of SavedMap
    joints : mapping of (int, int) to Joint
        By the numbers of the two maps.

    Returns
    -------
    tuple of Group
        Each map is in one of them; the largest first.

    Raises
    ------
    MapError
        If a map does not hold what binds its keyframes.
    """
    ways = [_Ways(saved) for saved in maps]
    tree: dict[int, list[_Step]] = {number: [] for number in range(len(maps))}
    holding: list[Pair] = []
    left_out: list[LeftOut] = []
    for (first, second), (one, other) in shared([way.keyframes for way in ways]).items():
        if not _path(tree, first, second):
            tie = Tie(int(one[0]), int(other[0]), np.zeros(3), EXACT)
            mine, theirs = ways[first].keyframes.poses[tie.first], ways[second].keyframes.poses[tie.second]
            _connect(tree, (first, second), tie, compose_one(mine, inverse(theirs)))
    for pair in sorted(joints, key=lambda pair: (-strength(joints[pair]), pair)):
        tie, path = joints[pair].surest, _path(tree, *pair)
        if path:
            off, covariance = _contradiction(ways, path, tie)
            if float(off @ solve(covariance, off)) > UNLIKELY and (np.abs(off) > FARTHEST).any():
                left_out.append(LeftOut(pair, off, np.sqrt(np.diag(covariance))))
                continue
        else:
            _connect(tree, pair, tie, joints[pair].pose)
        holding.append(pair)
    return _groups(ways, tree, holding, left_out)


@dataclass(frozen=True, slots=True)
class _Step:
    """From one map to another: over which keyframes, and how the other's frame lies in the one's."""

    maps: Pair
    tie: Tie
    pose: Floats


class _Ways:
    """Relative poses of the keyframes of a map, and how well they are known; the latter is found out when asked for."""

    def __init__(self, saved: SavedMap) -> None:
        self.keyframes = keyframes_of(saved)
        self._saved = saved
        self._doubt: DoubtTree | None = None
        self._nodes: list[int] = []

    def between(self, first: int, second: int) -> tuple[Floats, Floats]:
        """Pose of a keyframe seen from another, and its covariance in the axes of that one."""
        relations, stretches = self._saved.relations, self._saved.stretches
        if self._doubt is None and relations is not None and stretches is not None:
            self._doubt = DoubtTree()
            _, self._nodes = regrow(self._doubt, self.keyframes, relations, stretches.anchors)
        poses, nodes = self.keyframes.poses, self._nodes
        assert self._doubt is not None
        covariance = self._doubt.between(nodes[second], np.array([nodes[first]]), poses[second])[0]
        return between_one(poses[first], poses[second]), turned(covariance, -poses[first, 2])


def _connect(tree: dict[int, list[_Step]], pair: Pair, tie: Tie, pose: Floats) -> None:
    first, second = pair
    tree[first].append(_Step(pair, tie, pose))
    tree[second].append(_Step((second, first), turned_tie(tie), inverse(pose)))


def _path(tree: dict[int, list[_Step]], first: int, second: int) -> list[_Step]:
    """Steps from one map to another along the tree; none where there is no way."""
    ways: dict[int, list[_Step]] = {first: []}
    waiting = [first]
    for at in waiting:
        for step in tree[at]:
            other = step.maps[1]
            if other not in ways:
                ways[other] = [*ways[at], step]
                waiting.append(other)
    return ways.get(second, [])


def _contradiction(ways: Sequence[_Ways], path: Sequence[_Step], tie: Tie) -> tuple[Floats, Floats]:
    """How far a tie is off the way round, and the covariance of that, in the axes of its first keyframe."""
    pose, covariance, at = np.zeros(3), np.zeros((3, 3)), tie.first
    for step in path:
        for way, noise in (
            ways[step.maps[0]].between(at, step.tie.first),
            (step.tie.pose, turned(step.tie.covariance, step.tie.pose[2])),
        ):
            pose, covariance = moved(pose, covariance, way, noise)
        at = step.tie.second
    pose, covariance = moved(pose, covariance, *ways[path[-1].maps[1]].between(at, tie.second))
    off = tie.pose - pose
    off[2] = wrap_angle(off[2])
    return off, covariance + turned(tie.covariance, tie.pose[2])


def _groups(
    ways: Sequence[_Ways], tree: dict[int, list[_Step]], holding: Sequence[Pair], left_out: Sequence[LeftOut]
) -> tuple[Group, ...]:
    groups: list[Group] = []
    sizes = [len(way.keyframes) for way in ways]
    for lead in sorted(range(len(ways)), key=lambda number: (-sizes[number], number)):
        if any(lead in group.members for group in groups):
            continue
        members = [lead, *(n for n in range(len(ways)) if n != lead and _path(tree, lead, n))]
        frames = []
        for number in members:
            frame = np.zeros(3)
            for step in _path(tree, lead, number):
                frame = compose_one(frame, step.pose)
            frames.append(frame)
        groups.append(
            Group(
                tuple(members),
                np.array(frames),
                tuple(pair for pair in holding if pair[0] in members),
                tuple(left for left in left_out if left.maps[0] in members),
            )
        )
    return tuple(sorted(groups, key=lambda group: -len(group.members)))
