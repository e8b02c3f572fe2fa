"""Corners and walls while the drive goes on: seen, recognised, born into the graph, counted, dropped."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.contour.contours import Contours, Floats, Ints
from contourslam.detectors import Detector
from contourslam.geometry.poses import between_one, compose_one
from contourslam.graph.association import NONE, WIDE_GATES, associate, near
from contourslam.graph.doubt import DoubtTree
from contourslam.graph.landmark_expected import expected
from contourslam.graph.landmark_factors import LANDMARK, bind
from contourslam.graph.landmark_maps import judge, records, to_maps
from contourslam.graph.landmark_set import LandmarkSet, find_landmark_set
from contourslam.graph.pose_graph import PoseGraph
from contourslam.graph.sightings import (
    COLUMNS,
    DIRECTION,
    END,
    KIND,
    OPENING,
    START,
    Sightings,
    X,
    Y,
    sight,
    to_world,
)
from contourslam.kernels import kernel
from contourslam.landmarks import find_landmarks
from contourslam.landmarks.detect import Lap
from contourslam.maps.saved_map import Seen
from contourslam.scan import LaserScan
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.look import Look
from contourslam.slam.measurement import CORNER

FREE = -1.0  # kind of a row of the table that holds nothing
FORGET_AFTER = 15  # keyframes without another sighting after which a landmark in the making is given up
# A landmark not seen from places known this sharply from here is not asked: its twin is found once the loop is closed.
SHARP, SHARP_ANGLE = 0.10, math.radians(3.0)
MARGIN = 3.0  # m by which landmarks may have moved since they were read
SHIFT, LEVER = 0.03, 5.0  # m the robot, or what lies so far ahead, has moved when landmarks are read anew
# What iSAM2 gets while the drive goes on: every so many keyframes the newest sighting of each landmark, and only for a
# while after its birth. Landmarks that tie distant parts of the drive together make each further step of iSAM2 several
# times dearer and the poses no better, for contours tie those parts already; all sightings go into the refinement.
BATCH, WINDOW = 10, 30


@dataclass(frozen=True, slots=True)
class Count:
    """What one keyframe did to the landmarks; the fields are those of :class:`contourslam.slam.result.ScanUpdate`."""

    corners: int
    walls: int
    matched: tuple[int, ...]
    missed: tuple[int, ...]
    born: tuple[int, ...]
    dropped: tuple[int, ...]


NOTHING = Count(0, 0, (), (), (), ())


@kernel
def _refresh(seen: Floats, landmark: Floats, observed: int) -> None:
    """Let a sighting update what the graph does not estimate: a corner's looks, the extents."""
    if seen[KIND] == CORNER:
        landmark[OPENING] += (seen[OPENING] - landmark[OPENING]) / min(observed + 1.0, 20.0)
        landmark[START], landmark[END] = max(seen[START], landmark[START]), max(seen[END], landmark[END])
        return
    tx, ty = -math.sin(landmark[DIRECTION]), math.cos(landmark[DIRECTION])
    along = tx * (seen[X] - landmark[X]) + ty * (seen[Y] - landmark[Y])
    landmark[START] = min(landmark[START], along + seen[START])
    landmark[END] = max(landmark[END], along + seen[END])


class Landmarks:
    """Corners and walls of the graph, and those in the making; changed in place by every keyframe.

    Parameters
    ----------
    config : Config
    detector : Detector
    mount : ndarray, shape (3,)
        ``T_base_lidar``.
    doubt : DoubtTree

    Attributes
    ----------
    sightings : Sightings
        Everything that the keyframes saw.
    nodes : list of int
        Node of each keyframe in the tree of doubt.
    look : Look or None
        What the last keyframe saw.
    """

    def __init__(self, config: Config, detector: Detector, mount: Floats, doubt: DoubtTree) -> None:
        self._config, self._detector, self._mount, self._doubt = config, detector, mount, doubt
        self.sightings = Sightings()
        self.nodes: list[int] = []
        self.look: Look | None = None
        self._poses: list[Floats] = []
        self.table = np.full((64, COLUMNS), FREE)
        # Of each row of the table: id (-1 in the making), sightings, misses, last keyframe that saw it, its node, and
        # the keyframe from which on iSAM2 gets no more of it.
        self._ids, self._observed, self._failed, self._last, self._node = (np.full(64, -1) for _ in range(5))
        self._until = np.full(64, -1)
        self._stale = np.zeros(64, np.bool_)  # moved in the graph since it was read
        self._shifted = 0.0
        self._used = self._bound = 0
        self._making: dict[int, list[int]] = {}  # rows in the making, with the sightings so far
        self._waiting: list[tuple[int, int]] = []  # sightings that are to enter the graph, with their landmark's row
        self._in_graph: set[int] = set()
        self._home: dict[int, tuple[int, Floats]] = {}  # of earlier drives: by id, the keyframe they move with, and how
        self.failures: list[int] = []  # by id
        self._named: tuple[Floats, tuple[LandmarkSet, Ints, Ints]] | None = None
        self._mapped: tuple[Floats, tuple[CornerMap, WallMap]] | None = None

    def take(
        self, scan: LaserScan, contours: Contours, key: int, pose: Floats, node: int, graph: PoseGraph, lap: Lap
    ) -> Count:
        """Take in what a keyframe saw; what is new in the graph is solved for at its next update.

        Parameters
        ----------
        scan : LaserScan
        contours : Contours
            Of the scan, in the lidar's frame.
        key : int
            Number of the keyframe.
        pose : ndarray, shape (3,)
            In the world.
        node : int
            Of the keyframe in the tree of doubt.
        graph : PoseGraph
            In which the keyframe is already.
        lap : callable
            Called with the name of each stage when it is done.

        Returns
        -------
        Count
        """
        found = find_landmarks(contours, self._detector, self._config, lap)
        rows = sight(found.corners, found.walls, self._mount)
        self.nodes.append(node)
        self._poses.append(pose)
        first = self.sightings.append(key, rows)
        world = to_world(rows, np.zeros(len(rows), np.int64), pose[None])
        around = near(self.table, self._used, pose[0], pose[1], self._config.lidar.max_range + MARGIN)
        live = around[self._sharp(around, node, pose)]
        if graph.settled:  # else a step of iSAM2 would be due for each of them
            self._read(live[self._stale[live]], graph)
        chosen = associate(world, self.table, live, WIDE_GATES)
        innovations = world[:, X : Y + 1] - self.table[chosen, X : Y + 1]
        matched, born = self._recognise(world, chosen, first, key, node)
        self.look = Look(scan.stamp, found, np.where(chosen >= 0, self._ids[chosen], -1), innovations)
        missed = self._count_missed(scan, pose, live, key)
        lap("association")
        dropped = self._drop(live, key)
        if graph.settled and key >= self._bound + BATCH:
            self._bound = key
            self._bind(graph)
        lap("landmarks")
        return Count(len(found.corners), len(found.walls), matched, missed, born, dropped)

    def maps(self, poses: Floats, spreads: Callable[[Ints], Floats] | None = None) -> tuple[CornerMap, WallMap]:
        """Sort everything seen so far into a map.

        Parameters
        ----------
        poses : ndarray, shape (k, 3)
            All keyframes in the world, as they are known now.
        spreads : callable, optional
            Gives the covariances of keyframes in the world, shape (n, 3, 3), by their numbers; without it the tree of
            doubt does, which is on the safe side after loops.

        Returns
        -------
        CornerMap
        WallMap
            The covariances are those of each landmark's fit and of the first keyframe that saw it.
        """
        if self._mapped is None or not np.array_equal(self._mapped[0], poses):
            found, ids, failed = self.named(poses)
            kept = judge(found, failed, self._config.slam)
            found, at = found.only(kept), poses[found.first[kept]]
            if spreads is None:
                known = np.array(
                    [self._doubt.from_start(self.nodes[k], p) for k, p in zip(found.first, at, strict=True)]
                )
            else:
                keys, which = np.unique(found.first, return_inverse=True)
                known = spreads(keys)[which]
            self._mapped = poses.copy(), to_maps(found, ids[kept], failed[kept], at, known.reshape(-1, 3, 3))
        return self._mapped[1]

    def named(self, poses: Floats) -> tuple[LandmarkSet, Ints, Ints]:
        """What the keyframes at these `poses` saw, good or not, their ids, and how often each was missed."""
        if self._named is None or not np.array_equal(self._named[0], poses):
            found = find_landmark_set(self.sightings, poses)
            names = records(found, self.sightings.ids[: self.sightings.count], self.failures)
            self._named = poses.copy(), (found, *names)
        return self._named[1]

    def recall(self, seen: Seen, nodes: list[int], poses: Floats) -> None:
        """Take in, before anything else, what keyframes at `poses` saw on earlier drives, the `nodes` being theirs."""
        self.nodes, self._poses, self.failures = nodes, list(poses), seen.failures.tolist()
        self.sightings.append(seen.keys, seen.rows)
        self.sightings.ids[: self.sightings.count] = seen.ids
        found, ids, failed = self.named(poses)
        good = judge(found, failed, self._config.slam)
        found, ids, failed = found.only(good), ids[good], failed[good]
        last = np.zeros(len(found), np.int64)
        labelled = np.flatnonzero(found.labels >= 0)
        np.maximum.at(last, found.labels[labelled], self.sightings.keys[labelled])
        for j, number in enumerate(ids.tolist()):
            self._begin(found.table[j])
            self._home[number] = int(last[j]), between_one(poses[last[j]], found.table[j, X : DIRECTION + 1])
        self._making.clear()
        rows = slice(len(found))
        self._ids[rows], self._observed[rows], self._failed[rows] = ids, found.observed, failed
        self._last[rows], self._node[rows], self._stale[rows] = last, np.array(nodes)[last], True

    def refresh(self, before: Floats, after: Floats) -> None:
        """Say how the graph has moved the robot: if far, each landmark is read anew from it when it is next come by."""
        step = between_one(before, after)
        self._shifted += math.hypot(step[0], step[1]) + LEVER * abs(step[2])
        if self._shifted > SHIFT:
            self._shifted = 0.0
            self._stale[:] = True

    def seen(self, *, since: int) -> Ints:
        """Rows of the landmarks, those in the making too, that keyframe `since` or a later one saw."""
        used = slice(self._used)
        return np.flatnonzero((self.table[used, KIND] >= 0.0) & (self._last[used] >= since))

    def not_seen(self, *, since: int) -> Ints:
        """Rows of the landmarks of the map that neither keyframe `since` nor a later one saw."""
        used = slice(self._used)
        return np.flatnonzero((self._ids[used] >= 0) & (self._last[used] < since))

    def _read(self, rows: Ints, graph: PoseGraph) -> None:
        """Take over where the graph has these landmarks."""
        self._stale[rows] = False
        for j in rows.tolist():
            number = int(self._ids[j])
            if number in self._in_graph:
                self.table[j, X : DIRECTION + 1] = graph.pose(LANDMARK + number)
            elif number in self._home:
                key, seen = self._home[number]
                self.table[j, X : DIRECTION + 1] = compose_one(graph.pose(key), seen)

    def _sharp(self, rows: Ints, node: int, pose: Floats) -> NDArray[np.bool_]:
        """Which rows were last seen from places that are known sharply from here."""
        sharp = np.zeros(self._doubt.count, np.bool_)
        sharp[self._node[rows]] = True
        nodes = np.flatnonzero(sharp)
        doubt = self._doubt.between(node, nodes, pose)
        sharp[nodes] = (doubt[:, 0, 0] + doubt[:, 1, 1] < SHARP**2) & (doubt[:, 2, 2] < SHARP_ANGLE**2)
        return np.asarray(sharp[self._node[rows]])

    def _recognise(
        self, world: Floats, chosen: Ints, first: int, key: int, node: int
    ) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Book the sightings; returns the ids of landmarks matched and born."""
        matched: list[int] = []
        born: list[int] = []
        for i, j in enumerate(chosen.tolist()):
            if j == NONE:
                j = self._begin(world[i])
            if j < 0:
                continue
            again = self._last[j] == key  # another piece of one wall
            self._last[j], self._node[j] = key, node
            if j in self._making:
                self._making[j].append(first + i)
                self._observed[j] += not again
                self.table[j] = world[i]
                if self._observed[j] >= self._config.slam.sightings_to_birth:
                    born.append(self._bear(j))
                continue
            self._observed[j] += not again
            _refresh(world[i], self.table[j], self._observed[j])
            self.sightings.ids[first + i] = self._ids[j]
            if key < self._until[j]:
                self._waiting.append((first + i, j))
            if not again:
                matched.append(int(self._ids[j]))
        return tuple(matched), tuple(born)

    def _begin(self, row: Floats) -> int:
        """Give a sighting a row of the table as a landmark in the making."""
        free = np.flatnonzero(self.table[: self._used, KIND] < 0.0)
        j = int(free[0]) if len(free) else self._used
        if j == len(self.table):
            self.table = np.concatenate([self.table, np.full_like(self.table, FREE)])
            for name in ("_ids", "_observed", "_failed", "_last", "_node", "_until"):
                setattr(self, name, np.concatenate([getattr(self, name), np.full(j, -1)]))
            self._stale = np.concatenate([self._stale, np.zeros(j, np.bool_)])
        self._used = max(self._used, j + 1)
        self.table[j], self._making[j] = row, []
        self._ids[j], self._observed[j], self._failed[j], self._last[j] = -1, 0, 0, -1
        return j

    def _bear(self, j: int) -> int:
        """Let a landmark in the making enter the map with all its sightings; returns its id."""
        number = len(self.failures)
        self.failures.append(0)
        self._ids[j], self._until[j] = number, self._last[j] + WINDOW
        for s in self._making.pop(j):
            self.sightings.ids[s] = number
            self._waiting.append((s, j))
        return number

    def _bind(self, graph: PoseGraph) -> None:
        """Add the waiting sightings to the graph, after reading where it has the landmarks."""
        newest = {j: s for s, j in self._waiting if self._ids[j] == self.sightings.ids[s]}  # else j holds another now
        self._waiting = []
        if not newest:
            return
        rows, which = np.array(list(newest)), np.array(list(newest.values()))
        self._read(rows, graph)
        seen, keys, numbers = self.sightings.rows[which].astype(np.float64), self.sightings.keys[which], self._ids[rows]
        world = to_world(seen, np.arange(len(seen)), np.array([self._poses[k] for k in keys]))
        fresh = np.array([number not in self._in_graph for number in numbers.tolist()])
        self._in_graph.update(numbers.tolist())
        bind(graph, seen, world, keys, numbers, self.table[rows], fresh)

    def _count_missed(self, scan: LaserScan, pose: Floats, live: Ints, key: int) -> tuple[int, ...]:
        """Count a miss for each landmark that the scan should have shown; returns their ids."""
        rows = live[(self._ids[live] >= 0) & (self._last[live] != key)]
        missed = rows[expected(self.table, rows, scan, compose_one(pose, self._mount), self._config)]
        self._failed[missed] += 1
        ids: list[int] = self._ids[missed].tolist()
        for number in ids:
            self.failures[number] += 1
        return tuple(ids)

    def _drop(self, live: Ints, key: int) -> tuple[int, ...]:
        """Give up what is no landmark; its sightings stay for the final map to judge. Returns the ids."""
        config = self._config.slam
        chances = self._observed[live] + self._failed[live]
        rate = self._failed[live] / np.maximum(chances, 1)
        poor = live[(self._ids[live] >= 0) & (chances >= config.min_chances) & (rate > config.max_false_negative_rate)]
        self.table[poor, KIND] = FREE
        for j in [j for j in self._making if self._last[j] <= key - FORGET_AFTER]:
            del self._making[j]
            self.table[j, KIND] = FREE
        return tuple(self._ids[poor].tolist())
