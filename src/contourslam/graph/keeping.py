"""The graph's map as it is kept, and a further drive that goes on in it."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import gtsam
import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.contour.contours import Floats, Ints
from contourslam.detectors import Detector, make_detector
from contourslam.errors import MapError
from contourslam.geometry.poses import between
from contourslam.graph.memory import Memory, Settled
from contourslam.graph.places import Keyframe, Place
from contourslam.graph.pose_graph import joined, poses_of, to_array
from contourslam.graph.regrown import regrow
from contourslam.graph.slam import GraphSlam
from contourslam.maps.saved_map import NOT_CONTINUABLE, Contoured, Relations, SavedMap, Seen, Stretches


def kept(slam: GraphSlam, about: Mapping[str, str]) -> SavedMap:
    """Everything that a graph knows, as it is kept; the drive may go on.

    Parameters
    ----------
    slam : GraphSlam
        After :meth:`GraphSlam.finish` the refined map is kept, before it the map as it stands.
    about : mapping of str to str
        What people want to know of the map.

    Returns
    -------
    SavedMap
        Its keyframes are in the frame of the map, which is the world of the first drive.
    """
    return keep(slam.memory, slam.settled, about)


def keep(memory: Memory, settled: Settled | None, about: Mapping[str, str]) -> SavedMap:
    """Everything that a memory holds, as it is kept; it may grow on.

    Parameters
    ----------
    memory : Memory
    settled : Settled or None
        Its keyframes as a refinement found them; None for the map as it stands.
    about : mapping of str to str
        What people want to know of the map.

    Returns
    -------
    SavedMap
    """
    count = len(memory.keyframes)
    if settled is None:
        nodes, poses = memory.landmarks.nodes, poses_of(memory.graph.estimate(count), count)
        spreads = [memory.doubt.from_start(node, pose) for node, pose in zip(nodes, poses, strict=True)]
        settled = Settled(poses, np.array(spreads).reshape(-1, 3, 3))
    covariances = settled.covariances
    return SavedMap(
        *memory.landmarks.maps(settled.poses, lambda keys: covariances[keys]),
        _contoured(memory.keyframes, settled),
        _relations(memory, settled),
        _seen(memory, settled.poses),
        _stretches(memory),
        dict(about),
    )


def standing(slam: GraphSlam) -> tuple[Floats, tuple[NDArray[np.float32], ...]]:
    """Poses of the keyframes as they stand now, shape (k, 3), and the contour of each in the frame of the base.

    The contours are those of the graph itself, for they never change: this takes a millisecond or two.
    """
    memory, count = slam.memory, len(slam.memory.keyframes)
    poses = poses_of(memory.graph.estimate(count), count) if slam.settled is None else slam.settled.poses
    return poses, tuple(keyframe.oriented for keyframe in memory.keyframes)


def _contoured(keyframes: list[Keyframe], settled: Settled) -> Contoured:
    points = [keyframe.oriented for keyframe in keyframes]
    return Contoured(
        np.array([keyframe.stamp for keyframe in keyframes]),
        settled.poses,
        settled.covariances,
        np.array([keyframe.blur for keyframe in keyframes]),
        np.cumsum([0, *map(len, points)]),
        np.concatenate([np.empty((0, 4), np.float32), *points]),
        np.array([keyframe.drive for keyframe in keyframes], np.int64),
    )


def _relations(memory: Memory, settled: Settled) -> Relations:
    graph = memory.graph
    every = joined(graph.factors, graph.ties) if settled.factors is None else settled.factors
    count = every.size()
    rows = [read_relation(every.at(i)) for i in range(count)]
    return Relations(
        np.array([first for first, _, _, _, _ in rows], np.int64),
        np.array([second for _, second, _, _, _ in rows], np.int64),
        np.array([pose for _, _, pose, _, _ in rows]).reshape(-1, 3),
        np.array([information for _, _, _, information, _ in rows]).reshape(-1, 3, 3),
        np.array([robust for _, _, _, _, robust in rows], np.float64),
        np.arange(count) >= graph.factors.size(),
    )


def read_relation(factor: Any) -> tuple[int, int, Floats, Floats, float]:
    """Give what a factor binds: two keyframes (the first -1 for the map), pose seen from there, information, kernel."""
    noise, robust = factor.noiseModel(), math.nan
    if isinstance(noise, gtsam.noiseModel.Robust):
        kernel: Any = noise.robust()
        weight = kernel.weight(1.0)  # of Cauchy's kernel, which does not tell its width otherwise
        noise, robust = noise.noise(), math.sqrt(weight / (1.0 - weight))
    keys, information = factor.keys(), noise.information()
    if isinstance(factor, gtsam.PriorFactorPose2):
        return -1, keys[0], to_array(factor.prior()), information, robust
    return keys[0], keys[1], to_array(factor.measured()), information, robust


def _seen(memory: Memory, poses: Floats) -> Seen:
    """Sightings, those of landmarks that only the whole drive showed named too, so that these keep their ids."""
    sightings, failures = memory.landmarks.sightings, memory.landmarks.failures
    n = sightings.count
    ids = sightings.ids[:n].copy()
    found, names, _ = memory.landmarks.named(poses)
    new = (ids < 0) & (found.labels >= 0)
    new[new] = names[found.labels[new]] >= len(failures)
    ids[new] = names[found.labels[new]]
    given = max(len(failures), int(names.max(initial=-1)) + 1)
    missed = np.array([*failures, *[0] * (given - len(failures))], np.int64)
    return Seen(sightings.keys[:n].copy(), ids, sightings.rows[:n].copy(), missed)


def _stretches(memory: Memory) -> Stretches:
    """Places, and the local map that the drive is in: it will be a place to the next one."""
    pieces = [(place.anchor, place.members, place.seen) for place in memory.places.list]
    active = None if memory.contour is None else memory.contour.active
    if active is not None:
        way = np.array([memory.keyframes[member].local for member in active.members])
        pieces.append((active.anchor, tuple(active.members), between(active.pose, way)))
    return Stretches(
        np.array([anchor for anchor, _, _ in pieces], np.int64),
        np.cumsum([0, *(len(members) for _, members, _ in pieces)]),
        np.array([member for _, members, _ in pieces for member in members], np.int64),
        np.concatenate([np.empty((0, 3)), *(seen for _, _, seen in pieces)]),
    )


def resume(
    config: Config,
    saved: SavedMap,
    initial_pose: Floats,
    covariance: Floats,
    *,
    detector: Detector | None = None,
    lidar_mount: Floats | None = None,
    lap: Callable[[str], None] = lambda stage: None,
) -> GraphSlam:
    """Begin a further drive in a map that was kept.

    The drive begins at `initial_pose`, which is tied to the nearest old keyframe with `covariance`; from then on it is
    tied to old places as any drive is that comes by them. Corners and walls keep their ids and their records;
    :meth:`GraphSlam.finish` refines the whole map and gives the poses of the new drive's scans.

    Parameters
    ----------
    config : Config
    saved : SavedMap
    initial_pose : ndarray, shape (3,)
        Base in the frame of the map where the drive begins: m, m, rad.
    covariance : ndarray, shape (3, 3)
        Of `initial_pose`, in the axes of the map.
    detector : Detector, optional
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    lap : callable, optional
        As of :class:`GraphSlam`.

    Returns
    -------
    GraphSlam

    Raises
    ------
    MapError
        If the map does not hold what a further drive needs: one of landmarks alone, or a file of version 1.
    ConfigError
        If the configuration names a detector that does not exist.
    """
    detector = detector or make_detector(config.detector, adapted=config.adapted)
    mount = np.array(config.lidar.mount if lidar_mount is None else lidar_mount, dtype=np.float64)
    memory = remember(config, saved, detector, mount)
    return GraphSlam(
        config, detector, initial_pose=initial_pose, lidar_mount=mount, lap=lap, memory=memory, doubt=covariance
    )


def remember(config: Config, saved: SavedMap, detector: Detector, mount: Floats) -> Memory:
    """Give the memory of a graph that knows all that a map holds; :func:`keep` is its inverse.

    Parameters
    ----------
    config : Config
    saved : SavedMap
    detector : Detector
    mount : ndarray, shape (3,)
        ``T_base_lidar``; like the detector, of drives that are to come.

    Returns
    -------
    Memory

    Raises
    ------
    MapError
        If the map does not hold what binds its keyframes.
    """
    keyframes, relations, seen, stretches = saved.keyframes, saved.relations, saved.seen, saved.stretches
    if not keyframes or relations is None or seen is None or stretches is None:
        raise MapError(NOT_CONTINUABLE)
    memory = Memory(config, detector, mount)
    memory.keyframes += _keyframes(keyframes)
    _bind(memory, keyframes.poses, relations)
    memory.nodes, nodes = regrow(memory.doubt, keyframes, relations, stretches.anchors)
    _put(memory, stretches, keyframes.poses)
    memory.landmarks.recall(seen, nodes, keyframes.poses)
    memory.settled = Settled(keyframes.poses, keyframes.covariances)
    return memory


def _keyframes(kept: Contoured) -> list[Keyframe]:
    """Keyframes of earlier drives; their own odometry being gone, the map takes its place."""
    return [
        Keyframe(float(kept.stamps[i]), kept.poses[i], kept.contour(i), float(kept.blurs[i]), int(kept.drives[i]))
        for i in range(len(kept))
    ]


def _bind(memory: Memory, poses: Floats, relations: Relations) -> None:
    """Take in all relations; the map stays as it was kept, where landmarks had their say too, until loops move it."""
    graph = memory.graph
    now = between(poses[relations.first], poses[relations.second])
    for key, pose in enumerate(poses):
        graph.add(key, pose)
    for i in range(len(relations.first)):
        first, second, width = int(relations.first[i]), int(relations.second[i]), float(relations.robust[i])
        information = relations.information[i]
        if first < 0:
            graph.fix(second, relations.poses[i], 1.0 / np.sqrt(np.diag(information)))
        else:
            robust = None if math.isnan(width) else width
            tie = bool(relations.ties[i])
            graph.recall(first, second, relations.poses[i], information, robust, tie=tie, now=now[i])
    graph.update()


def _put(memory: Memory, stretches: Stretches, poses: Floats) -> None:
    """Take in the places; all of them lie behind the robot."""
    for i, anchor in enumerate(stretches.anchors.tolist()):
        entries = slice(stretches.starts[i], stretches.starts[i + 1])
        members: Ints = stretches.members[entries]
        place = Place(anchor, tuple(members.tolist()), stretches.seen[entries], memory.nodes[anchor])
        memory.places.put(place, poses[anchor])
    memory.places.of_before = len(memory.places)
