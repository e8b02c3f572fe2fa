"""The streaming object over a fixed map: each scan aligned to the map's contours, and doubt where they disagree."""

import math
from collections.abc import Callable

import numpy as np

from contourslam.config import Config
from contourslam.contour.contours import Floats
from contourslam.detectors import Detector, make_detector
from contourslam.geometry.angles import wrap_angle
from contourslam.geometry.poses import between_one, compose_one
from contourslam.landmarks import trace
from contourslam.localization.fixed_map import make_fixed_map
from contourslam.localization.known_map import KnownMap
from contourslam.localization.locate import Locator
from contourslam.localization.lookout import STILL, Agreed, Finder, Lookout
from contourslam.localization.motion import Motion, Step
from contourslam.localization.sighted import NO_SIGHT, Sighted
from contourslam.localization.trust import Trust
from contourslam.maps import SavedMap
from contourslam.matching.align import POINT_SIGMA, Alignment, align
from contourslam.matching.certainty import hold
from contourslam.matching.odometry import FLOOR, LEAST_POINTS, LOOSER, POOR
from contourslam.matching.oriented import move, oriented_points
from contourslam.matching.rescue import LOOSE, find_again
from contourslam.matching.small import invert, moved, turned
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.result import ScanUpdate

FIRST_DOUBT = np.array([0.5, 0.5, math.radians(15.0)])  # of a pose that somebody gives, standard deviations: m, m, rad
LEAST_PART = 0.45  # what fits of a scan shows where the robot is if it is this part of it ...
TRUE = 0.02  # ... and what was expected holds it where it wants to be itself, within this, m
DOUBT = np.diag([0.05**2, 0.05**2, math.radians(1.5) ** 2])  # that each poor scan adds to the pose
RESCUES, RESCUE_EVERY = 4, 8  # poor scans at which the neighbourhood is searched: the first ones, then every so many
# Overlap that a scan must have where looks agree that it is: of one in a corridor that only looks like the right one,
# half fits, and it takes some way to tell.
FITS = {"sure": 0.65, "steady": 0.55}
# Overlap by which a scan must fit better elsewhere than where the robot is thought to be: where looks are sure, and
# where they are a hint only.
BETTER, MUCH_BETTER = 0.1, 0.25
CHECK_LOOKS = 3  # looks that a second opinion takes
# A robot that is lost finds back into the map by itself while it is known this well where it is; else it must look.
STRAYED, STRAYED_ANGLE = 1.0, math.radians(30.0)
# Errors of the map, and of the lidar, are the same from scan to scan at one place: a fix is soon forgotten, so that a
# robot at rest does not come to believe that it knows more than half of its variance better than one scan says.
FORGET = 2.0


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
        Finds the robot anywhere in the map; by default a :class:`contourslam.localization.locate.Locator`, for which
        the map is made ready here: half a second for a floor of a thousand keyframes.
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
    mount : ndarray, shape (3,)
        ``T_base_lidar``.

    Raises
    ------
    ConfigError
        If the configuration names a detector that does not exist.
    MapError
        If the map holds nothing to localise by.
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
        self.config, self._saved, self._lap = config, saved, lap
        self.detector = detector or make_detector(config.detector, adapted=config.adapted)
        self.mount: Floats = np.array(config.lidar.mount if lidar_mount is None else lidar_mount, dtype=np.float64)
        self._map, self._sighted = make_fixed_map(saved), Sighted(saved, config, self.detector)
        self._finder: Finder = Locator(KnownMap(saved)) if finder is None else finder
        self._motion = Motion(config.slam)
        self._started_at: Floats | None = None
        self.start_over(initial_pose, initial_covariance)

    def start_over(self, pose: Floats | None = None, covariance: Floats | None = None) -> None:
        """Forget where the robot is: it is looked for near a pose, or everywhere.

        Parameters
        ----------
        pose : ndarray, shape (3,), optional
            About where the base is in the map: m, m, rad.
        covariance : ndarray, shape (3, 3), optional
            How well that is known, in the axes of the map; half a metre and 15 degrees by default.
        """
        self._trust, self._placed = Trust(), pose is not None
        self._pose, self._covariance = self._map.anywhere()
        if pose is not None:
            given = np.diag(FIRST_DOUBT**2) if covariance is None else covariance
            self._pose, self._covariance = np.array(pose, np.float64), np.array(given, np.float64)
        self._stale = np.zeros((3, 3))  # what of the last fix is to be forgotten
        self._sure, self._since_sure = self._pose, np.zeros(3)  # the last pose beyond doubt, and the wheels since then
        self._lookout: Lookout | None = self._new_lookout()
        self._checking = True  # some looks are taken also if all is well

    def _new_lookout(self) -> Lookout:
        return Lookout(self._finder, self.config.lidar.max_range, self.mount[:2])

    @property
    def localized(self) -> bool:
        """Whether the pose is believed: False before the robot is found, and while it is lost."""
        return self._trust.localized

    @property
    def start_pose(self) -> Floats:
        """Base in the map where it started, as it was known when the robot was found first, shape (3,)."""
        return self._pose if self._started_at is None else self._started_at

    @property
    def odometry_pose(self) -> Floats:
        """Raw odometry at the stamp of the last scan (``T_odom_base``), shape (3,); zeros before the first reading."""
        return self._motion.odometry_pose

    def push_odometry(self, odometry: Odometry) -> None:
        """Take in one odometry reading."""
        self._motion.push(odometry)

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
        step = self._motion.up_to(scan)
        contours = trace(scan, self.config, step.during, self.mount)
        self._lap("contour")
        oriented = move(oriented_points(contours), self.mount)
        increment, noise = self._step(oriented, step)
        before, quality, nis = self._pose, 0.0, 0.0
        self._since_sure = compose_one(self._since_sure, step.increment)
        if self._placed:
            self._pose, self._covariance = moved(before, self._covariance + self._stale, increment, noise)
            self._stale = np.zeros((3, 3))
        beside = None if self._lookout is None else self._lookout.pose
        if len(oriented) >= LEAST_POINTS:
            if self._placed:
                quality, nis = self._fit(oriented, before, step)
            self._look(oriented, step.blur)
        if self._started_at is None and self.localized and beside is not None:
            self._started_at = compose_one(self._pose, between_one(beside, np.zeros(3)))
        followed = self._placed and self._lookout is None
        self._motion.went(between_one(before, self._pose) if followed else increment, sure=followed and quality > POOR)
        if self._trust.poor == 0:
            self._sure, self._since_sure = self._pose, np.zeros(3)
        self._lap("matching")
        covariance = self._covariance + self._map.doubt_at(self._pose) if self._placed else self._covariance
        quality = quality if self.localized else 0.0
        sight = NO_SIGHT
        if self.localized:
            went = math.dist(before[:2], self._pose[:2]) + abs(wrap_angle(self._pose[2] - before[2]))
            lidar = compose_one(self._pose, self.mount)
            sight = self._sighted.look(contours, lidar, went, self._lap)
        return ScanUpdate(
            scan.stamp, self._pose, covariance, sight.corners, sight.walls, sight.matched, (), (), (), nis,
            3 if nis > 0.0 else 0, quality,
        )  # fmt: skip

    def _step(self, oriented: Floats, step: Step) -> tuple[Floats, Floats]:
        """Motion and covariance: the wheels' while the map is there to mend it, that of the contours otherwise."""
        if self._lookout is not None:
            elapsed = step.elapsed if math.isfinite(step.elapsed) else 0.0
            return self._lookout.push(oriented, step.increment, step.noise, step.exposure, elapsed)
        share = min((math.hypot(step.increment[0], step.increment[1]) + abs(step.increment[2])) / 0.1, 1.0)
        return step.increment, LOOSER * step.noise + share * FLOOR

    def _fit(self, oriented: Floats, before: Floats, step: Step) -> tuple[float, float]:
        """Align where the robot is expected; returns how well that fits, at most 1, and the innovation squared."""
        trust, prior = self._trust, invert(self._covariance)
        found = align(oriented, self._map.cells, self._pose, prior)
        good = self._good(found, oriented)
        if not good:
            first = self._lookout is not None and self._lookout.scans == 1  # near where somebody says
            self._look_out(oriented)
            if first or trust.poor < RESCUES or trust.poor % RESCUE_EVERY == 0:
                found = self._rescue(oriented, before, prior, found)
                good = found.overlap >= trust.enough
        off = found.pose - self._pose
        off[2] = wrap_angle(off[2])
        nis = LOOSER * float(off @ prior @ off) if self._lookout is None else 0.0
        if not good:
            if self.localized:
                self._take(found, oriented, step.blur, trust.quality(found.overlap) ** 2)
                self._covariance = self._covariance + DOUBT
            trust.count_poor()
        elif self.localized or self._near():
            self._take(found, oriented, step.blur)
            trust.count_good(found.overlap, min(max(step.elapsed, 0.0), 1.0))
        return trust.quality(found.overlap), nis

    def _good(self, found: Alignment, oriented: Floats) -> bool:
        """Whether a scan fits as well as usual, or fits in part and there as truly as ever: things have been moved."""
        if found.overlap >= self._trust.enough:
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

    def _look_out(self, oriented: Floats) -> None:
        """Begin to look where the robot is."""
        if self._lookout is None:
            self._lookout = self._new_lookout()
            self._lookout.push(oriented, *STILL, 0.0, 0.0)

    def _rescue(self, oriented: Floats, before: Floats, prior: Floats, poor: Alignment) -> Alignment:
        """Search the neighbourhood: where the wheels have the robot, or where it would be had it gone on as before."""
        expected = [self._pose, compose_one(before, self._motion.last), compose_one(self._sure, self._since_sure)]
        found, contradicts = find_again(
            oriented, self._map.around(self._pose), expected, prior, poor, self._trust.enough
        )
        if contradicts:
            if found.overlap < self._trust.enough:
                return poor
            self._covariance = invert(LOOSE)
        return found

    def _look(self, oriented: Floats, blur: float) -> None:
        """Where there is doubt, ask where in the whole map the robot is, and believe looks that agree."""
        trust = self._trust
        if trust.wants_check():
            self._checking = True
            self._look_out(oriented)
        if self._lookout is None:
            return
        agreed = self._lookout.look() if trust.poor or self._checking else None
        self._lap("search")
        if agreed is not None and self._fits_better(agreed, oriented):
            found = align(oriented, self._map.cells, agreed.pose, LOOSE)
            self._pose, self._covariance, self._placed = found.pose, invert(LOOSE), True
            self._take(found, oriented, blur)
            trust.found()
        elif trust.poor == 0 and (agreed is not None or not self._checking or self._lookout.looks >= CHECK_LOOKS):
            self._lookout, self._checking = None, False

    def _fits_better(self, agreed: Agreed, oriented: Floats) -> bool:
        """Whether the scan fits at a pose, and clearly better than where the robot is thought to be, if it is."""
        hint = agreed.word == "hint"
        there = align(oriented, self._map.cells, agreed.pose, LOOSE).overlap
        if there < (self._trust.enough if hint else FITS[agreed.word]):
            return False
        if not self.localized and not hint:
            return True
        here = align(oriented, self._map.cells, self._pose, LOOSE).overlap
        return self._placed and there > here + (MUCH_BETTER if hint else BETTER)

    def _take(self, found: Alignment, oriented: Floats, blur: float, weight: float = 1.0) -> None:
        """Take over the pose of an alignment, with what the contours know of it."""
        own = hold(oriented, self._map.cells, found.pose)
        information = weight * turned(invert(own.covariance(own.variance, blur)), found.pose[2])
        after = invert(invert(self._covariance) + information)
        self._pose, self._covariance = found.pose, after
        self._stale = FORGET * after @ information @ after
