"""The streaming object: odometry and scans go in, poses and a map of corners and walls come out."""

from collections.abc import Callable

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Contours, Floats, Ints
from contourslam.detectors import Detector, make_detector
from contourslam.geometry.poses import compose_one
from contourslam.landmarks import find_landmarks, trace
from contourslam.matching.oriented import move, oriented_points
from contourslam.scan import LaserScan, Odometry
from contourslam.slam import ekf
from contourslam.slam.association import Model, associate
from contourslam.slam.contour_motion import ContourMotion, ContourStep
from contourslam.slam.landmark_filter import LandmarkFilter
from contourslam.slam.landmark_life import Nursery, bear, drop_unseen, merge_twins
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.look import Look
from contourslam.slam.measurement import predict_measurements
from contourslam.slam.motion import predict
from contourslam.slam.observation import X1, Y1, Observations, loosened, observe, to_world
from contourslam.slam.result import ScanUpdate
from contourslam.slam.visibility import by_angle, expected_in_scan
from contourslam.slam.wheels import Wheels

# Doubt that a slip of the wheels adds to the pose: half a metre, ten degrees. At least three pairs must then agree,
# twice as many numbers as a pose has.
SLIP = np.diag([0.5**2, 0.5**2, np.radians(10.0) ** 2])
SLIP_PAIRS = 3
# With contour matching, landmarks are looked for after this way, m, or rad turned, and not before ...
LOOK_EVERY = 0.2
# ... and what they are measured wrong by, a wall by its bends and frames and by the angle at which the beams meet it,
# changes over this one: a filter that takes all the looks for independent believes a bent wall against its heading.
INDEPENDENT = 1.0


def _no_lap(stage: str) -> None:
    """Nobody measures."""


class ContourSlam:
    """EKF-SLAM over the corners and walls of a 2-D lidar (eqs 23-31).

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

    Attributes
    ----------
    filter : LandmarkFilter
        The state, changed in place by every scan.
    mount, start_pose : ndarray, shape (3,)
        ``T_base_lidar``, and the pose of the base where it started.
    contours : Contours or None
        Of the last scan, in the lidar's frame; None before the first.
    look : Look or None
        Of the last scan in which landmarks were looked for.

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
        lap: Callable[[str], None] = _no_lap,
    ) -> None:
        self.config = config
        self.detector = detector or make_detector(config.detector, adapted=config.adapted)
        lidar = config.lidar
        self.mount: Floats = np.array(lidar.mount if lidar_mount is None else lidar_mount, dtype=np.float64)
        self.filter = LandmarkFilter(np.zeros(3) if initial_pose is None else np.asarray(initial_pose, np.float64))
        self.start_pose = self.filter.pose
        self._wheels = Wheels(config.slam)
        self._contours = ContourMotion(lidar.max_range) if config.slam.contour_matching else None
        self._way = LOOK_EVERY  # driven since landmarks were last looked for
        self._linearised_at = self.filter.pose
        self._nursery = Nursery()
        self.contours: Contours | None = None
        self.look: Look | None = None
        self._lap = lap

    def push_odometry(self, odometry: Odometry) -> None:
        """Take in one odometry reading."""
        self._wheels.push(odometry)

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        """One step of the filter, to the stamp of the scan.

        Parameters
        ----------
        scan : LaserScan
            Its odometry up to its last beam should have come before; what is missing is extrapolated.

        Returns
        -------
        ScanUpdate
        """
        motion = self._wheels.during(scan)
        contours = self.contours = trace(scan, self.config, motion, self.mount)
        self._lap("contour")
        step = self._predict(scan, motion, contours)
        self._way += LOOK_EVERY if step is None else step.moved
        if self._way < LOOK_EVERY:  # nothing new to see: the contours carry the pose
            return self._update(scan, step)
        found = find_landmarks(contours, self.detector, self.config, self._lap, walls=self.config.slam.walls)
        seen, alike = observe(found.corners, found.walls), 1.0
        if step is not None:
            seen, alike = loosened(seen), max(INDEPENDENT / self._way, 1.0)
        self._way = 0.0
        world = to_world(self.filter.mean[:3], self.mount, seen.looks)
        model = self._expect()
        self._lap("prediction")
        chosen = self._associate(seen, world, model, may_slip=step is None or not step.aligned)
        self._lap("association")
        matched = (chosen >= 0).nonzero()[0]
        at = 3 + 2 * chosen
        innovations = world[:, (X1, Y1)] - self.filter.mean[np.stack((at, at + 1), axis=1)]
        self.look = Look(scan.stamp, found, np.where(chosen >= 0, self.filter.ids[chosen], -1), innovations)
        nis = self._correct(matched, chosen[matched], seen.values, alike * seen.noises, model)
        self._lap("correction")
        missed = self._count_sightings(scan, chosen[matched], world[matched])
        matched_ids = tuple(self.filter.ids[chosen[matched]].tolist())
        born = bear(self.filter, self._nursery, seen, world, chosen, self.mount, self.config.slam)
        dropped = merge_twins(self.filter, chosen[matched]) + drop_unseen(self.filter, self.config.slam)
        self._lap("landmarks")
        return self._update(
            scan, step, corners=len(found.corners), walls=len(found.walls), matched=matched_ids, missed=missed,
            born=born, dropped=dropped, nis=nis,
        )  # fmt: skip

    def _update(
        self, scan: LaserScan, step: ContourStep | None, *, corners: int = 0, walls: int = 0,
        matched: tuple[int, ...] = (), missed: tuple[int, ...] = (), born: tuple[int, ...] = (),
        dropped: tuple[int, ...] = (), nis: float = 0.0,
    ) -> ScanUpdate:  # fmt: skip
        f, quality = self.filter, None if step is None else step.quality
        pose, covariance = f.pose, f.pose_covariance
        return ScanUpdate(
            scan.stamp, pose, covariance, corners, walls, matched, missed, born, dropped, nis, 2 * len(matched), quality
        )

    @property
    def odometry_pose(self) -> Floats:
        """Raw odometry at the stamp of the last scan (``T_odom_base``), shape (3,); zeros before the first reading."""
        return self._wheels.pose

    def finish(self) -> None:
        """Nothing is revised: a filter's poses stay what they were at the time."""

    def corner_map(self) -> CornerMap:
        """Corners of the map as they stand now."""
        return self.filter.corner_map()

    def wall_map(self) -> WallMap:
        """Walls of the map as they stand now."""
        return self.filter.wall_map()

    def _predict(self, scan: LaserScan, motion: tuple[Floats, Floats], contours: Contours) -> ContourStep | None:
        """Move the pose to the scan's stamp, along the contours or the wheels alone (eqs 23-24, 28)."""
        found = None
        if self._contours is None:
            step = self._wheels.step(scan.stamp, motion)
        else:
            found = self._contours.step(scan, move(oriented_points(contours), self.mount), self._wheels, motion)
            step = found.increment, found.covariance
            self._lap("matching")
        if step is not None:
            f = self.filter
            start = self._linearised_at if self.config.slam.first_estimates else f.pose
            predict(f.mean, f.covariance, f.size, *step, start)
            self._linearised_at = f.pose
        return found

    def _expect(self) -> Model:
        f, first = self.filter, self.config.slam.first_estimates
        return predict_measurements(f.mean[:3], self.mount, f.mean, f.table, f.count, first)

    def _associate(self, seen: Observations, world: Floats, model: Model, *, may_slip: bool) -> Ints:
        """Associate; where little matches, ask whether more would if the wheels had slipped since the last scan.

        Contours that were aligned have answered that already, and among many landmarks a false answer is easily found.
        """
        f, config = self.filter, self.config.slam
        chosen = associate(seen, world, f, model, config)
        matched = int((chosen >= 0).sum())
        if not may_slip or config.association != "joint" or matched > 0.5 * len(seen) or len(seen) < SLIP_PAIRS:
            return chosen
        before = f.covariance[:3, :3].copy()
        f.covariance[:3, :3] += SLIP
        slipped = associate(seen, world, f, model, config)
        if np.count_nonzero(slipped >= 0) >= max(matched + 2, SLIP_PAIRS):
            return slipped
        f.covariance[:3, :3] = before
        return chosen

    def _correct(self, rows: Ints, landmarks: Ints, values: Floats, noises: Floats, model: Model) -> float:
        """All matched observations at once (eqs 25-27)."""
        if len(rows) == 0:
            return 0.0
        f = self.filter
        jacobian, nu, noise = ekf.stack(rows, landmarks, values, noises, f.table, *model)
        nis = ekf.correct(f.mean, f.covariance, f.size, ekf.landmark_columns(landmarks), jacobian, nu, noise)
        f.wrap_walls(landmarks)
        return max(nis, 0.0)

    def _count_sightings(self, scan: LaserScan, landmarks: Ints, world: Floats) -> tuple[int, ...]:
        """Count o for what was seen and f for what should have been (Fig. 7); returns the ids of the latter."""
        f, config = self.filter, self.config
        f.refresh(landmarks, world)
        f.observed[landmarks] += 1
        limit = min(config.lidar.max_range, scan.range_max)
        should = expected_in_scan(
            f.mean, f.table, f.count, compose_one(f.mean[:3], self.mount), *by_angle(scan), limit,
            config.landmarks.min_side, config.landmarks.min_side_points, config.landmarks.min_wall,
            config.landmarks.min_wall_points,
        )  # fmt: skip
        should[landmarks] = False
        f.failed[: f.count][should] += 1
        return tuple(f.ids[: f.count][should].tolist())
