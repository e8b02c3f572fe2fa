"""One map of several: built side by side, solved together, overlapping corners and walls become one."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Ints
from contourslam.detectors import make_detector
from contourslam.graph.keeping import keep, remember
from contourslam.graph.memory import Memory
from contourslam.graph.places import ROBUST_TIES
from contourslam.graph.refine import refine
from contourslam.joining.again import Again, look_again
from contourslam.joining.building import Pair, build, keyframes_of
from contourslam.joining.groups import Group, LeftOut, find_groups
from contourslam.joining.joint import Joint
from contourslam.maps.saved_map import SavedMap
from contourslam.matching.small import invert

ROUNDS = 5  # of tying and solving at most: maps that were bent come nearer to each other in each

LOOKS = 3  # times that overlaps are looked for which the solution so far does not know


@dataclass(frozen=True, slots=True)
class Merged:
    """A map made of one or several.

    Attributes
    ----------
    saved : SavedMap
        In the frame of the map of the first member, whose landmarks keep their ids. Where there is but one, or nothing
        is in another that is not in this one, it is that map, unchanged.
    members : tuple of int
        Numbers of the maps in it, that with the most keyframes first, the others in their order.
    keys : tuple of ndarray of int
        Of each member, where its keyframes stand in the new map.
    joints : tuple of (int, int)
        Pairs of maps whose joints hold it together.
    left_out : tuple of LeftOut
        Joints that contradict surer ones.
    """

    saved: SavedMap
    members: tuple[int, ...]
    keys: tuple[Ints, ...]
    joints: tuple[Pair, ...]
    left_out: tuple[LeftOut, ...]


def merge_maps(
    maps: Sequence[SavedMap],
    joints: Mapping[Pair, Joint],
    config: Config | None = None,
    *,
    observer: Callable[[Merged], None] = lambda merged: None,
) -> tuple[Merged, ...]:
    """Make one map of each group of maps that joints bind, by one optimisation of all of them.

    Parameters
    ----------
    maps : sequence of SavedMap
        A drive that is in several of them binds them too, and is taken once.
    joints : mapping of (int, int) to Joint
        By the numbers of the two maps.
    config : Config, optional
        Its rules say which landmarks are worth their place in a map.
    observer : callable, optional
        Called with each map when it is made.

    Returns
    -------
    tuple of Merged
        The one of most maps first.

    Raises
    ------
    MapError
        If a map does not hold what binds its keyframes.
    """
    out = []
    for group in find_groups(maps, joints):
        out.append(merge_group(maps, joints, group, config or Config()))
        observer(out[-1])
    return tuple(out)


def merge_group(maps: Sequence[SavedMap], joints: Mapping[Pair, Joint], group: Group, config: Config) -> Merged:
    """Make one map of those of a group; the arguments are those of :func:`merge_maps`."""
    members = [maps[number] for number in group.members]
    if len(members) == 1:
        keys = (np.arange(len(keyframes_of(members[0]))),)
        return Merged(members[0], group.members, keys, group.joints, group.left_out)
    place = {number: n for n, number in enumerate(group.members)}
    built = build(members, group.frames, {(place[a], place[b]): joints[a, b] for a, b in group.joints})
    first, whole = members[0], built.saved
    saved = first if len(keyframes_of(first)) == len(keyframes_of(whole)) else solve_map(whole, config)
    return Merged(saved, group.members, built.keys, group.joints, group.left_out)


def solve_map(built: SavedMap, config: Config) -> SavedMap:
    """Solve a map that was put together: all keyframes tied to what is around them, and to all landmarks.

    Parameters
    ----------
    built : SavedMap
        Its poses are a first guess.
    config : Config

    Returns
    -------
    SavedMap
        The same keyframes, sightings and stretches; corners and walls anew, those that several maps had being one.
    """
    memory = remember_all(built, config)
    for rounds in (0, *[ROUNDS] * LOOKS):
        # Before any keyframe is tied anew: where a map is bent it would be tied as bent, and then nobody would look.
        saved = _refined(memory, built.about, rounds)
        relations = saved.relations
        memory = remember_all(saved, config)
        found = [] if relations is None else look_again(memory, keyframes_of(saved), relations)
        if rounds and not found:
            return saved
        for again in found:
            _tie(memory, again)
    return _refined(memory, built.about, ROUNDS)


def _tie(memory: Memory, again: Again) -> None:
    anchor, places = memory.places.list[again.place].anchor, memory.places
    information = invert(places.match_covariance(again.place, again.keyframe, again.pose))
    memory.graph.relate(anchor, again.keyframe, again.pose, information, ROBUST_TIES, tie=True)


def _refined(memory: Memory, about: Mapping[str, str], rounds: int) -> SavedMap:
    settled = refine(memory.graph, memory.keyframes, memory.places, memory.landmarks.sightings, rounds)
    return keep(memory, settled, about)


def remember_all(built: SavedMap, config: Config) -> Memory:
    """Give the memory of a graph that reaches as far as any keyframe of the map saw."""
    points = keyframes_of(built).points
    reach = max(config.lidar.max_range, float(np.abs(points[:, :2]).max(initial=0.0)))
    config = replace(config, lidar=replace(config.lidar, max_range=reach))
    detector = make_detector(config.detector, adapted=config.adapted)
    return remember(config, built, detector, np.zeros(3))
