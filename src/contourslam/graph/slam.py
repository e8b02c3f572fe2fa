"""The streaming object over the graph: contours give the motion, the graph binds what was seen before."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config
from contourslam.contour.contours import Contours, Floats
from contourslam.detectors import Detector, make_detector
from contourslam.geometry.poses import between, between_one, compose, compose_one
from contourslam.graph.doubt import HEADING_PER_M
from contourslam.graph.landmarks import NOTHING
from contourslam.graph.loops import LoopFinder, Tie
from contourslam.graph.memory import Memory, Settled
from contourslam.graph.places import ROBUST_TIES, Keyframe
from contourslam.graph.pose_graph import poses_of
from contourslam.graph.refine import refine
from contourslam.landmarks import trace
from contourslam.matching.certainty import exposure
from contourslam.matching.odometry import ContourOdometry, Step
from contourslam.matching.oriented import move, oriented_points
from contourslam.matching.small import invert, moved, turned
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.look import Look
from contourslam.slam.mapper import Finished
from contourslam.slam.result import Loop, ScanUpdate
from contourslam.slam.wheels import Wheels

ROBUST_WHEELS = 1.0  # width of the Cauchy kernel, in standard deviations
START = np.full(3, 1e-4)  # standard deviations of the pose in the world where the drive begins
UPDATE = 4  # keyframes that enter the graph together: contour odometry is as good over a metre or two
UPDATE_LATER = 300  # keyframes after which one more waits: a step of iSAM2 gets dearer as the graph grows
AT_ONCE = 0.05  # m; a loop that moves the robot by less waits for the next update
REFRESH = 52  # keyframes after which the places are asked anew where they are
STEPS_AFTER_LOOP, STEPS_AT_LAST = 1, 5  # further steps of iSAM2
TIE_PAUSE = 0.45  # m after a tie to an old place in which another would say little more


class GraphSlam:
    """Graph SLAM over keyframes, corners and walls of a 2-D lidar.

    Parameters
    ----------
    config : Config
    detector : Detector, optional
        A detector object of one's own; by default the one that the configuration names.
    initial_pose : ndarray, shape (3,), optional
        x (m), y (m), heading (rad) of the base in the world where it starts; the origin by default.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    lap : callable, optional
        Called with the name of each stage when it is done, for those who measure time; the core reads no clock.
    memory : Memory, optional
        What is known from earlier drives; :func:`contourslam.graph.keeping.resume` makes it of a map that was kept.
    doubt : ndarray, shape (3, 3), optional
        Covariance of `initial_pose` in such a map, in its axes; needed with a memory that holds keyframes.

    Attributes
    ----------
    memory : Memory
    settled : Settled or None
        The refined keyframes, as long as no keyframe has come after the refinement.
    contours : Contours or None
        Of the last scan, in the lidar's frame; None before the first.

    Raises
    ------
    ConfigError
        If the configuration names a detector that does not exist.
    """

    def __init__(
        self,
        config: Config,
        detector: Detector | None = None,
        *,
        initial_pose: Floats | None = None,
        lidar_mount: Floats | None = None,
        lap: Callable[[str], None] = lambda stage: None,
        memory: Memory | None = None,
        doubt: Floats | None = None,
    ) -> None:
        self.config = config
        self.detector = detector or make_detector(config.detector, adapted=config.adapted)
        lidar = config.lidar
        self.mount: Floats = np.array(lidar.mount if lidar_mount is None else lidar_mount, dtype=np.float64)
        self.start_pose: Floats = np.zeros(3) if initial_pose is None else np.asarray(initial_pose, np.float64)
        self._wheels = Wheels(config.slam)
        self.memory = memory or Memory(config, self.detector, self.mount)
        self._graph, self._keyframes = self.memory.graph, self.memory.keyframes
        self._places, self._doubt = self.memory.places, self.memory.doubt
        self._landmarks, self._nodes = self.memory.landmarks, self.memory.nodes
        self._first = len(self._keyframes)
        self._drive = self._keyframes[-1].drive + 1 if self._keyframes else 0
        self._start_covariance = np.diag(START**2) if doubt is None else np.asarray(doubt, np.float64)
        self._contour = self.memory.contour = ContourOdometry(lidar.max_range, self._first)
        # Of each scan: its keyframe, its pose seen from there, and its covariance in the world as known at the time.
        self._scans: list[tuple[int, Floats, Floats]] = []
        self._begins: list[int] = []  # of each keyframe of this drive, its first scan
        self.settled: Settled | None = self.memory.settled
        self._finder = LoopFinder(self._places, self._doubt, self._landmarks)
        self._ties: list[tuple[int, Tie]] = []
        self._tie_covariances: list[Floats] = []
        self._stamp = -math.inf
        self._since, self._since_noise = np.zeros(3), np.zeros((3, 3))
        self._key_pose, self._key_covariance = self.start_pose, np.zeros((3, 3))
        self._travelled, self._tied_at = 0.0, -math.inf
        self._due = self._refresh_due = 0  # keyframes at which the graph is updated, and the places are moved, next
        self.contours: Contours | None = None
        self._standing: tuple[int, int, Floats] | None = None
        self._lap = lap

    def push_odometry(self, odometry: Odometry) -> None:
        """Take in one odometry reading."""
        self._wheels.push(odometry)

    @property
    def odometry_pose(self) -> Floats:
        """Raw odometry at the stamp of the last scan (``T_odom_base``), shape (3,); zeros before the first reading."""
        return self._wheels.pose

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        """Align one scan; where it is far enough from the last keyframe, bind it into the graph.

        Parameters
        ----------
        scan : LaserScan
            Its odometry up to its last beam should have come before; what is missing is guessed from the last motion.

        Returns
        -------
        ScanUpdate
        """
        motion = self._wheels.during(scan)
        contours = self.contours = trace(scan, self.config, motion, self.mount)
        self._lap("contour")
        oriented = move(oriented_points(contours), self.mount)
        increment, noise = self._wheels.step_or_guess(scan.stamp, motion)
        before = self._contour.pose
        exposed = exposure(scan.offsets, scan.stamp - self._stamp)
        step = self._contour.push(oriented, increment, noise, exposed)
        self._wheels.went(between_one(before, step.pose))
        self._stamp = scan.stamp
        self._since, self._since_noise = moved(self._since, self._since_noise, increment, noise)
        self._lap("matching")
        count = NOTHING
        if step.keyframe is not None:
            self.settled = None
            kept = Keyframe(scan.stamp, step.pose, oriented.astype(np.float32), self._contour.blur, self._drive)
            self._add_keyframe(step.keyframe, step, kept)
            self._begins.append(len(self._scans))
            self._lap("graph")
            node = self._nodes[step.anchor]
            count = self._landmarks.take(scan, contours, step.keyframe, self._key_pose, node, self._graph, self._lap)
        seen = between_one(self._keyframes[-1].local, step.pose)
        pose = compose_one(self._key_pose, seen)
        covariance = self._key_covariance + turned(step.covariance, pose[2] - step.pose[2])
        self._scans.append((len(self._keyframes) - 1, seen, covariance))
        return ScanUpdate(
            scan.stamp, pose, covariance, count.corners, count.walls, count.matched, count.missed, count.born,
            count.dropped, step.nis, 0 if step.alignment is None or step.slipped else 3, step.quality,
        )  # fmt: skip

    def corner_map(self) -> CornerMap:
        """Corners of the map as they stand now."""
        return self._map()[0]

    def wall_map(self) -> WallMap:
        """Walls of the map as they stand now."""
        return self._map()[1]

    def _map(self) -> tuple[CornerMap, WallMap]:
        if self.settled is None:
            return self._landmarks.maps(self._stand())
        covariances = self.settled.covariances
        return self._landmarks.maps(self.settled.poses, lambda keys: covariances[keys])

    def _stand(self) -> Floats:
        """Keyframes as the graph has them now, shape (k, 3); read anew only where it has changed."""
        count = len(self._keyframes)
        if self._standing is None or self._standing[:2] != (count, self._graph.updates) or not self._graph.settled:
            poses = poses_of(self._graph.estimate(count), count)
            self._standing = count, self._graph.updates, poses
        return self._standing[2]

    @property
    def look(self) -> Look | None:
        """Of the last keyframe; None before the first."""
        return self._landmarks.look

    @property
    def at_rest(self) -> bool:
        """Whether nothing waits for the next update: to draw up the map then changes nothing in what follows."""
        return self._graph.settled

    def path(self, numbers: NDArray[np.int64] | None = None) -> Floats:
        """Base in the world at some scans as it is seen now, for those who draw it.

        Parameters
        ----------
        numbers : ndarray of int, shape (n,), optional
            Those of the scans, from 0; all by default.

        Returns
        -------
        ndarray, shape (n, 3)
        """
        if numbers is None:
            numbers = np.arange(len(self._scans))
        if not len(numbers):
            return np.empty((0, 3))
        return self._along(self._stand() if self.settled is None else self.settled.poses, numbers)

    def finish(self) -> Finished:
        """Poses of all scans as the graph has them now, refined where the configuration says so, and the loops."""
        if not self._scans:
            return Finished(np.empty((0, 3)), np.empty((0, 3, 3)), ())
        self._graph.update(STEPS_AT_LAST)  # what the last keyframe added, and what the loops have not yet moved
        count = len(self._keyframes)
        covariances = [covariance for _, _, covariance in self._scans]
        if self.config.graph.refine:
            places = self._places if self.config.graph.loops else None
            self.settled = refine(self._graph, self._keyframes, places, self._landmarks.sightings)
            poses, marginals = self.settled.poses, self.settled.covariances
            still = np.zeros((3, 3))  # a scan lies as well to its keyframe as that to the local map
            covariances = [  # but for the first keyframe, which is known exactly, for the map begins there
                known if key == 0 else moved(poses[key], marginals[key], seen, still)[1]
                for key, seen, known in self._scans
            ]
        else:
            poses = poses_of(self._graph.estimate(count), count)
        return Finished(self._along(poses, np.arange(len(self._scans))), np.array(covariances), self.loops())

    def _along(self, keys: Floats, numbers: NDArray[np.int64]) -> Floats:
        """Poses of scans between those of the keyframes: carried on from the one before, and to the one after."""
        which = np.array([self._scans[number][0] for number in numbers])
        seen = np.array([self._scans[number][1] for number in numbers])
        poses = compose(keys[which], seen)
        after = np.minimum(which + 1, len(keys) - 1)
        local = np.array([k.local for k in self._keyframes])
        other = compose(keys[after], between(local[after], compose(local[which], seen)))
        begins = np.array([*self._begins, len(self._scans)])
        begin = begins[which - self._first]
        count = begins[which - self._first + 1] - begin
        weight = np.where(after > which, (numbers - begin) / count, 0.0)
        return compose(poses, between(poses, other) * weight[:, None])

    def loops(self, first: int = 0) -> tuple[Loop, ...]:
        """Loops closed so far, in the order in which they were found, from number `first` on."""
        loops = []
        for (keyframe, tie), covariance in zip(self._ties[first:], self._tie_covariances[first:], strict=True):
            place = self._places.list[tie.place]
            loops.append(
                Loop(
                    earlier_stamp=self._keyframes[place.anchor].stamp,
                    later_stamp=self._keyframes[keyframe].stamp,
                    relative_pose=tie.alignment.pose,
                    covariance=covariance,
                    shift=tie.shift,
                    method=tie.method,
                    pairs=tie.alignment.pairs,
                    residual=tie.alignment.residual,
                    overlap=tie.alignment.overlap,
                    runner_up=tie.runner_up,
                )
            )
        return tuple(loops)

    def _add_keyframe(self, key: int, step: Step, keyframe: Keyframe) -> None:
        """Bind a keyframe to the one before, to the local map it was aligned to, and to old places around it."""
        graph, keyframes = self._graph, self._keyframes
        last = keyframes[-1].local if key > self._first else step.pose
        pose = compose_one(self._key_pose, between_one(last, step.pose))
        keyframes.append(keyframe)
        graph.add(key, pose)
        if key == 0:
            graph.fix(0, pose, START)
        elif key == self._first:
            self._bind_start(pose)
        else:
            wheel_noise = turned(self._since_noise, -self._since[2])
            graph.relate(key - 1, key, self._since, invert(wheel_noise + 1e-8 * np.eye(3)), ROBUST_WHEELS)
            if step.match is not None:
                seen = between_one(keyframes[step.anchor].local, step.pose)
                graph.relate(step.anchor, key, seen, invert(step.match))
        self._since, self._since_noise = np.zeros(3), np.zeros((3, 3))
        self._travelled += math.hypot(step.pose[0] - last[0], step.pose[1] - last[1])
        self._grow_tree(step, pose)
        closed = self.config.graph.loops and self._tie(key, step, pose)
        if closed or key >= self._due:
            self._due = key + UPDATE + key // UPDATE_LATER
            graph.update(STEPS_AFTER_LOOP if closed else 0)
            self._landmarks.refresh(pose, graph.pose(key))
            pose = graph.pose(key)
        self._key_pose = pose
        if closed or key >= self._refresh_due:
            self._refresh_due = key + REFRESH + key // REFRESH
            self._places.move(graph.poses([p.anchor for p in self._places.list]))
        if step.finished is not None:
            anchor = step.finished.anchor
            back = between_one(step.pose, keyframes[anchor].local)
            self._places.add(step.finished, self._nodes[anchor], compose_one(pose, back))
        self._key_covariance = self._doubt.from_start(self._nodes[step.anchor], self._key_pose)

    def _bind_start(self, pose: Floats) -> None:
        """Bind the first keyframe of a further drive to the one of earlier drives that lies nearest."""
        old = self._graph.poses(range(self._first))
        near = int(np.argmin(np.hypot(*(old[:, :2] - pose[:2]).T)))
        information = invert(turned(self._start_covariance, -pose[2]))
        self._graph.relate(near, self._first, between_one(old[near], pose), information, ROBUST_TIES)
        self._nodes[self._first] = self._doubt.add(self._landmarks.nodes[near], pose, self._start_covariance)

    def _tie(self, key: int, step: Step, pose: Floats) -> bool:
        """Tie a keyframe to old places; True where that moves the robot by so much that it cannot wait."""
        node = self._nodes[step.anchor]
        sharp, unsure = self._finder.candidates(pose, node)
        if len(sharp.numbers) and self._travelled < self._tied_at + TIE_PAUSE:
            return False
        nearby = self._finder.tie(self._keyframes[key].oriented, pose, sharp)
        found: list[tuple[int, Tie]] = []
        if nearby is not None:
            self._tied_at, found = self._travelled, [(key, nearby)]
        elif self._contour.active is not None:
            found = self._finder.search(self._contour.active, step.pose, pose, unsure, key, self._travelled)
        for keyframe, tie in found:
            place, seen = self._places.list[tie.place], tie.alignment.pose
            covariance = self._places.match_covariance(tie.place, keyframe, seen)
            self._graph.relate(place.anchor, keyframe, seen, invert(covariance), ROBUST_TIES, tie=True)
            self._ties.append((keyframe, tie))
            self._tie_covariances.append(covariance)
            self._doubt.better(node, place.node, pose, turned(covariance, pose[2]))
        return any(tie.method != "nearby" and math.hypot(tie.shift[0], tie.shift[1]) > AT_ONCE for _, tie in found)

    def _grow_tree(self, step: Step, pose: Floats) -> None:
        """Give a local map that has just been begun its node in the tree of doubt."""
        begun = self._contour.newest
        if begun.anchor in self._nodes:
            return
        covariance = turned(step.covariance, pose[2] - step.pose[2])
        way = between_one(self._keyframes[step.anchor].local, step.pose)
        covariance[2, 2] += HEADING_PER_M**2 * math.hypot(way[0], way[1])
        self._nodes[begun.anchor] = self._doubt.add(self._nodes.get(step.anchor, 0), pose, covariance)
