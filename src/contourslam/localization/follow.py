"""The streaming object over a fixed map: each scan aligned to the map's contours, and doubt where they disagree."""

import math
from collections.abc import Callable

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Contours, Floats
from contourslam.detectors import Detector, make_detector
from contourslam.geometry.angles import wrap_angle
from contourslam.geometry.poses import between_one, compose_one
from contourslam.landmarks import find_landmarks, trace
from contourslam.landmarks.detect import NO_MOTION
from contourslam.localization.fixed_map import make_fixed_map
from contourslam.localization.known_map import KnownMap
from contourslam.localization.locate import Locator
from contourslam.localization.lookout import Finder, Lookout
from contourslam.localization.sighted import Sighted
from contourslam.maps import SavedMap
from contourslam.matching.align import POINT_SIGMA, Alignment, align
from contourslam.matching.certainty import exposure, hold
from contourslam.matching.odometry import FLOOR, LEAST_POINTS, LOOSER, POOR
from contourslam.matching.oriented import move, oriented_points
from contourslam.matching.rescue import LOOSE, find_again
from contourslam.matching.small import invert, moved, turned
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import ScanUpdate
from contourslam.slam.wheels import CRUISE, LONGEST, Wheels

FIRST_DOUBT = np.array([0.5, 0.5, math.radians(15.0)])  # of a pose that somebody gives, standard deviations: m, m, rad
USUAL = 0.85  # part of a scan that fits its map, before the drive has told
LEAST_USUAL = 0.6  # so much of it at least, however much has changed
LEARN = 0.02  # weight of the newest scan in what is usual
LEAST_PART = 0.45  # what fits of a scan shows where the robot is if it is this part of it ...
TRUE = 0.02  # ... and what was expected holds it where it wants to be itself, within this, m
LOST = 8  # poor scans in a row, after which the map is no longer believed
DOUBT = np.diag([0.05**2, 0.05**2, math.radians(1.5) ** 2])  # that each of these scans adds to the pose
FOUND = 3  # good scans in a row that end all doubt
RESCUES, RESCUE_EVERY = 4, 8  # poor scans at which the neighbourhood is searched: the first ones, then every so many
# A robot that is lost finds back into the map by itself while it is known this well where it is; else it must look.
STRAYED, STRAYED_ANGLE = 1.0, math.radians(30.0)
# Errors of the map, and of the lidar, are the same from scan to scan at one place: a fix is soon forgotten, so that a
# robot at rest does not come to believe that it knows more than half of its variance better than one scan says.
FORGET = 2.0
LOOK_EVERY = 0.4  # m, or rad turned, after which corners and walls are looked for again
SILENT = 0.05  # s before a scan; odometry that ends earlier leaves open how the robot moved
STEADY_TIMES = np.array([0.0, 1.0])  # s
LEARN_TURNS = 0.01  # weight of the newest scan in what is known of the wheels' turns


class Localizer:
    """Follows a robot in a fixed map, by the contours of its scans; keeps :class:`contourslam.slam.mapper.Mapper`.

    Parameters
    ----------
    saved : SavedMap
        The map; it is not changed.
    config : Config
    detector : Detector, optional
        A detector object of one's own; by default the one that the configuration names.
    finder : Finder, optional
        Finds the robot anywhere in the map; by default a :class:`contourslam.localization.locate.Locator`, for which the
        map is made ready here: half a second for a floor of a thousand keyframes.
    initial_pose : ndarray, shape (3,), optional
        About where the base is in the map as it starts: m, m, rad.
    initial_covariance : ndarray, shape (3, 3), optional
        How well that is known, in the axes of the map; half a metre and 15 degrees by default.
    lidar_mount : ndarray, shape (3,), optional
        ``T_base_lidar``; that of the configuration by default.
    lap : callable, optional
        Called with the name of each stage when it is done, for those who measure time; the core reads no clock.

    Attributes
    ----------
    localized : bool
        Whether the pose is believed: False before the robot is found, and while it is lost.

    Raises
    ------
    ConfigError
        If the configuration names a detector that does not exist, or the map holds nothing to localise by.
    """

    def __init__(
        self,
        saved: SavedMap,
        config: Config,
        detector: Detector | None = None,
        *,
        finder: Finder | None = None,
        initial_pose: Floats | None = None,
        initial_covariance: Floats | None = None,
        lidar_mount: Floats | None = None,
        lap: Callable[[str], None] = lambda stage: None,
    ) -> None:
        self.config, self._saved = config, saved
        self.detector = detector or make_detector(config.detector, adapted=config.adapted)
        self.mount: Floats = np.array(config.lidar.mount if lidar_mount is None else lidar_mount, dtype=np.float64)
        self._map, self._lap = make_fixed_map(saved), lap
        self._finder: Finder = Locator(KnownMap(saved)) if finder is None else finder
        self._sighted, self._way = Sighted(saved), LOOK_EVERY
        self._wheels = Wheels(config.slam)
        self._stamp = -math.inf
        self.localized = False
        self._usual, self._poor, self._good = USUAL, LOST, 0
        self._pose, self._covariance = self._map.anywhere()
        self._placed = initial_pose is not None
        if initial_pose is not None:
            self._pose = np.array(initial_pose, np.float64)
            given = np.diag(FIRST_DOUBT**2) if initial_covariance is None else initial_covariance
            self._covariance = np.array(given, np.float64)
        self._steady, self._twist = NO_MOTION, np.zeros(3)  # the motion during a scan, if the robot goes on as it did
        self._stale = np.zeros((3, 3))  # what of the last fix is to be forgotten
        self._last_step: Floats = np.zeros(3)
        self._sure, self._since_sure = self._pose, np.zeros(3)  # the last pose beyond doubt, and the wheels since then
        self._turn_excess = 1.0  # variance of the wheels' turns as found, as a part of what is stated of them
        self._taught = 0
        self._lookout: Lookout | None = self._new_lookout()
        self._started_at = self._pose

    def _new_lookout(self) -> Lookout:
        return Lookout(self._finder, self.config.lidar.max_range, self.mount[:2])

    @property
    def start_pose(self) -> Floats:
        """Base in the map where it started, as it was known when the robot was found first, shape (3,)."""
        return self._started_at

    @property
    def odometry_pose(self) -> Floats:
        """Raw odometry at the stamp of the last scan (``T_odom_base``), shape (3,); zeros before the first reading."""
        return self._wheels.pose

    def push_odometry(self, odometry: Odometry) -> None:
        """Take in one odometry reading."""
        self._wheels.push(odometry)

    def corner_map(self) -> CornerMap:
        """Corners of the map; they do not change."""
        return self._saved.corners

    def wall_map(self) -> WallMap:
        """Walls of the map; they do not change."""
        return self._saved.walls

    def finish(self) -> None:
        """Nothing is revised: the poses stay what they were at the time."""

    def push_scan(self, scan: LaserScan) -> ScanUpdate:
        """Align one scan to the map.

        Parameters
        ----------
        scan : LaserScan
            Its odometry up to its last beam should have come before; what is missing is guessed from the last motion.

        Returns
        -------
        ScanUpdate
            Its quality is 0, and its covariance large, while the robot is not localised.
        """
        motion = self._wheels.during(scan)
        elapsed = scan.stamp - self._stamp
        silent = -float(motion[0][-1]) if len(motion[0]) else math.inf  # s between the last reading and the scan
        contours = trace(scan, self.config, self._steady if silent > SILENT else motion, self.mount)
        self._lap("contour")
        oriented = move(oriented_points(contours), self.mount)
        increment, noise = self._wheels.step_or_guess(scan.stamp, motion)
        if silent > SILENT:
            noise = noise + np.diag((CRUISE * min(silent, max(elapsed, 0.0), LONGEST)) ** 2)
        exposed = exposure(scan.offsets, elapsed)
        self._stamp = scan.stamp
        wheels, turn, turn_noise = increment, float(increment[2]), float(noise[2, 2])
        blur = exposed * turn_noise * self._turn_excess
        if self._lookout is None:
            share = min((math.hypot(increment[0], increment[1]) + abs(increment[2])) / 0.1, 1.0)
            noise = LOOSER * noise + share * FLOOR
        else:
            increment, noise = self._lookout.push(
                oriented, increment, noise, exposed, elapsed if math.isfinite(elapsed) else 0.0
            )
        before, quality, nis = self._pose, 0.0, 0.0
        self._since_sure = compose_one(self._since_sure, wheels)
        if self._placed:
            self._pose, self._covariance = moved(before, self._covariance + self._stale, increment, noise)
            self._stale = np.zeros((3, 3))
            if len(oriented) >= LEAST_POINTS:
                quality, nis = self._fit(oriented, before, blur)
        if self._lookout is not None and self._poor > 0 and len(oriented) >= LEAST_POINTS:
            self._look(oriented, blur)
        if quality > POOR and turn_noise > 0.0:
            self._learn(wrap_angle(self._pose[2] - before[2] - turn) ** 2 / turn_noise)
        went = increment if not self._placed or self._lookout is not None else between_one(before, self._pose)
        self._wheels.went(went)
        self._last_step = went
        if self._poor == 0:
            self._sure, self._since_sure = self._pose, np.zeros(3)
        if 0.0 < elapsed < LONGEST:
            # Over two steps: of one alone, an error would come back with the other sign at each scan and not fade.
            twist = went / elapsed
            self._steady = STEADY_TIMES, np.stack([np.zeros(3), 0.5 * (twist + self._twist)])
            self._twist = twist
        self._lap("matching")
        covariance = self._covariance + self._map.doubt_at(self._pose) if self._placed else self._covariance
        quality = quality if self.localized else 0.0
        corners, walls, matched = self._landmarks(contours) if self._due(before) else (0, 0, ())
        return ScanUpdate(
            scan.stamp, self._pose, covariance, corners, walls, matched, (), (), (), nis, 3 if nis > 0.0 else 0, quality
        )

    def _due(self, before: Floats) -> bool:
        """Whether corners and walls are worth looking for again."""
        self._way += math.dist(before[:2], self._pose[:2]) + abs(wrap_angle(self._pose[2] - before[2]))
        if not self.localized or self._way < LOOK_EVERY:
            return False
        self._way = 0.0
        return True

    def _landmarks(self, contours: Contours) -> tuple[int, int, tuple[int, ...]]:
        """Corners and walls in the scan, and which of the map's they are."""
        found = find_landmarks(contours, self.detector, self.config, self._lap)
        matched = self._sighted.ids(found.corners, found.walls, compose_one(self._pose, self.mount))
        self._lap("association")
        return len(found.corners), len(found.walls), matched

    def _learn(self, square: float) -> None:
        """Hold the wheels' turn, in variances of what is stated of it, against that of the map."""
        gain = max(1.0 / (self._taught + 2.0), LEARN_TURNS)
        self._taught += 1
        self._turn_excess += gain * (min(square, 16.0 * self._turn_excess) - self._turn_excess)

    def _enough(self) -> float:
        """Overlap that a good fit has."""
        return POOR * max(self._usual, LEAST_USUAL)

    def _fit(self, oriented: Floats, before: Floats, blur: float) -> tuple[float, float]:
        """Align where the robot is expected; returns how well that fits, at most 1, and the innovation squared."""
        prior = invert(self._covariance)
        found = align(oriented, self._map.cells, self._pose, prior)
        good = self._good_enough(found, oriented)
        if not good:
            first = self._lookout is not None and self._lookout.scans == 1  # near where somebody says
            self._doubt(oriented)
            if first or self._poor <= RESCUES or self._poor % RESCUE_EVERY == 0:
                found = self._rescue(oriented, before, prior, found)
                good = found.overlap >= self._enough()
        off = found.pose - self._pose
        off[2] = wrap_angle(off[2])
        nis = LOOSER * float(off @ prior @ off) if self._lookout is None else 0.0
        if good and (self.localized or self._near()):
            self._take(found, oriented, blur)
            self._agree(found)
        elif not good:
            self._good = 0
            if self.localized:
                self._take(found, oriented, blur, (found.overlap / self._usual) ** 2)
                self._covariance = self._covariance + DOUBT
                self.localized = self._poor < LOST
        return min(found.overlap / max(self._usual, LEAST_USUAL), 1.0), nis

    def _good_enough(self, found: Alignment, oriented: Floats) -> bool:
        """Whether a scan fits as well as usual, or fits in part and there as truly as ever: things have been moved."""
        if found.overlap >= self._enough():
            return True
        if found.overlap < LEAST_PART:
            return False
        alone = align(oriented, self._map.cells, found.pose, LOOSE)
        off = alone.pose - found.pose
        off[2] = wrap_angle(off[2])
        # By how much the points that fit move, root mean square.
        return POINT_SIGMA * math.sqrt(float(off @ alone.information @ off) / max(alone.pairs, 1)) < TRUE

    def _near(self) -> bool:
        """Whether a robot that is lost is known well enough to find back by itself."""
        spread = self._covariance
        return bool(spread[0, 0] + spread[1, 1] < STRAYED**2 and spread[2, 2] < STRAYED_ANGLE**2)

    def _doubt(self, oriented: Floats) -> None:
        """Count a poor scan; at the first one, begin to look out."""
        self._poor += 1
        if self._lookout is None:
            self._lookout = self._new_lookout()
            self._lookout.push(oriented, np.zeros(3), 1e-10 * np.eye(3), 0.0, 0.0)

    def _agree(self, found: Alignment) -> None:
        """Count a good scan; after some of them the robot is followed as ever."""
        self._good += 1
        if self._good >= FOUND or self.localized:
            self.localized = True
            self._usual += LEARN * (found.overlap - self._usual)
        if self._good >= FOUND:
            self._poor, self._lookout = 0, None

    def _rescue(self, oriented: Floats, before: Floats, prior: Floats, poor: Alignment) -> Alignment:
        """Search the neighbourhood: where the wheels have the robot, or where it would be had it gone on as before."""
        expected = [self._pose, compose_one(before, self._last_step), compose_one(self._sure, self._since_sure)]
        around = self._map.around(self._pose)
        found, contradicts = find_again(oriented, around, expected, prior, poor, self._enough())
        if contradicts:
            if found.overlap < self._enough():
                return poor
            self._covariance = invert(LOOSE)
        return found

    def _look(self, oriented: Floats, blur: float) -> None:
        """Ask where in the whole map the robot is; believe it where two looks agree and the scan fits there better."""
        if self._lookout is None:
            return
        pose = self._lookout.look()
        self._lap("search")
        if pose is None:
            return
        found = align(oriented, self._map.cells, pose, LOOSE)
        if found.overlap < POOR * LEAST_USUAL:
            return
        if self._placed and self.localized:
            here = align(oriented, self._map.cells, self._pose, LOOSE)
            if here.overlap > found.overlap - 0.1:
                return
        if not self._placed:
            self._started_at = compose_one(found.pose, between_one(self._lookout.pose, np.zeros(3)))
        self._pose, self._covariance = found.pose, invert(LOOSE)
        self._placed = self.localized = True
        self._take(found, oriented, blur)
        self._poor, self._good = 1, 0

    def _take(self, found: Alignment, oriented: Floats, blur: float, weight: float = 1.0) -> None:
        """Take over the pose of an alignment, with what the contours know of it."""
        own = hold(oriented, self._map.cells, found.pose)
        information = weight * turned(invert(own.covariance(own.variance, blur)), found.pose[2])
        after = invert(invert(self._covariance) + information)
        self._pose, self._covariance = found.pose, after
        self._stale = FORGET * after @ information @ after
