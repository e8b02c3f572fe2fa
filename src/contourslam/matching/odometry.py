"""Contour odometry: each scan aligned to the contours of the last few metres, with the wheels' word as the prior."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.angles import wrap_angle
from contourslam.geometry.poses import between_one, compose_one
from contourslam.matching.align import Alignment, align
from contourslam.matching.cell_map import CellMap
from contourslam.matching.certainty import Hold, hold, match_covariance
from contourslam.matching.rescue import LOOSE, find_again
from contourslam.matching.small import invert, moved

KEY_DISTANCE, KEY_TURN = 0.4, math.radians(20.0)  # a scan this far from the last keyframe becomes one
LENGTH = 6.0  # m of driving that a local map takes in
FEWEST = 4  # keyframes in a local map that scans are aligned to
LEAST_POINTS = 8  # a scan with fewer contour points is not aligned
# What a match adds to the doubt however many points agree: neighbouring points err alike. Per 0.1 m or 0.1 rad moved.
FLOOR = np.diag([0.003**2, 0.003**2, math.radians(0.1) ** 2])
# The wheels' covariance counts for so much more beside the contours': a prior too tight pulls each step the same way,
# and the heading drifts; one too loose costs next to nothing.
LOOSER = 9.0
LEARN = 0.01  # weight of the newest scan in what is known of the wheels
POOR = 0.8  # an overlap below this part of the usual one says that the alignment may be wrong


class LocalMap:
    """Contours of a stretch of the drive; changed in place as keyframes come in.

    Attributes
    ----------
    anchor : int
        The keyframe whose pose the map moves with.
    pose : ndarray, shape (3,)
        That keyframe in the frame of the contour odometry.
    covariance : ndarray, shape (3, 3)
        Of the robot's pose about this map, in the axes of the odometry's frame.
    cells : CellMap
        In the frame of the contour odometry.
    members : list of int
        Keyframes whose contours it holds.
    travelled : float
        Length of the stretch, m.
    """

    def __init__(self, anchor: int, pose: Floats, half_width: float) -> None:
        self.anchor, self.pose = anchor, pose
        self.covariance: Floats = FLOOR.copy()
        self.cells = CellMap(pose, half_width)
        self._first: Floats = np.empty((0, 4))
        self._hold: Hold | None = None
        self.members: list[int] = []
        self.travelled = 0.0

    def insert(self, keyframe: int, oriented: Floats, pose: Floats, distance: float) -> None:
        """Take in the contours of a keyframe."""
        self.cells.insert(oriented, pose)
        if not self.members:
            self._first = oriented
        self.members.append(keyframe)
        self.travelled += distance

    @property
    def hold(self) -> Hold:
        """What the map knows of the anchor's own scan, as it was when first asked for."""
        if self._hold is None:
            self._hold = hold(self._first, self.cells, self.pose, inside=True)
        return self._hold


@dataclass(frozen=True, slots=True)
class Step:
    """One scan in the frame of the contour odometry.

    Attributes
    ----------
    pose, covariance : ndarray, shape (3,) and (3, 3)
        Of the base; the covariance is about the local map, in the axes of the odometry's frame.
    alignment : Alignment or None
        None where there was nothing to align.
    anchor : int
        Anchor of the local map that the scan was aligned to.
    quality : float
        Overlap as a part of the usual one, at most 1; 0 where nothing was aligned.
    nis : float
        Normalised innovation squared, 3 degrees of freedom: the motion that the contours showed, held against the
        wheels' and the covariance stated with it; 0 where nothing was aligned.
    slipped : bool
        True where the alignment contradicts the increment.
    keyframe : int or None
        Number of the keyframe that the scan became.
    match : ndarray, shape (3, 3), or None
        Of a keyframe that was aligned: covariance of its pose as seen from the anchor, in its own frame.
    finished : LocalMap or None
        A local map that took in its last keyframe before this scan.
    """

    pose: Floats
    covariance: Floats
    alignment: Alignment | None
    anchor: int
    quality: float
    nis: float
    slipped: bool
    keyframe: int | None
    match: Floats | None
    finished: LocalMap | None


class ContourOdometry:
    """Poses in a frame that drifts slowly and never jumps; changed in place by every scan.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Of the base at the last scan.
    active : LocalMap or None
        What the next scan is aligned to.
    keyframes : int
        Number of the next one.
    blur : float
        Variance of the last scan's heading from turns during it that the wheels did not tell, rad^2.

    Parameters
    ----------
    max_range : float
        No contour point lies farther from the robot than this, m.
    first : int
        Number of the first keyframe.
    """

    def __init__(self, max_range: float, first: int = 0) -> None:
        self._half_width = max_range + LENGTH
        self.pose: Floats = np.zeros(3)
        self.active: LocalMap | None = None
        self._following: LocalMap | None = None
        self.keyframes = first
        self._last_key: Floats = np.zeros(3)
        self._usual = 0.0
        self._motion: Floats = np.zeros(3)  # between the last two scans
        self._turns = np.zeros(2)  # squares of the wheels' errors of turning, and what they should be; running means
        self._taught = 0.0
        self.blur = 0.0
        self._trusted: Floats = np.zeros(3)  # where the wheels have it, from the last scan that agreed with them

    def push(self, oriented: Floats, increment: Floats, noise: Floats, exposure: float = 0.0) -> Step:
        """Align a scan.

        Parameters
        ----------
        oriented : ndarray, shape (n, 4)
            Contour points and normals in the frame of the base.
        increment : ndarray, shape (3,)
            Motion since the last scan as the wheels, or a guess, have it, in the frame of the base then.
        noise : ndarray, shape (3, 3)
            Its covariance.
        exposure : float
            Part of it that blurs the scan, see :func:`contourslam.matching.certainty.exposure`.

        Returns
        -------
        Step
        """
        turn_noise = float(noise[2, 2])
        share = min((math.hypot(increment[0], increment[1]) + abs(increment[2])) / 0.1, 1.0)
        before = self.pose
        noise = LOOSER * noise + share * FLOOR
        for local in (self.active, self._following):
            if local is not None:
                self.pose, local.covariance = moved(before, local.covariance, increment, noise)
        self._trusted = compose_one(self._trusted, increment)
        found, quality, nis, slipped = None, 0.0, 0.0, False
        active = self.active
        if active is not None and len(oriented) >= LEAST_POINTS:
            steady = compose_one(before, self._motion)
            found, quality, nis, slipped = self._align(oriented, active, [self.pose, steady, self._trusted])
        self._motion = between_one(before, self.pose)
        if not slipped:
            self._trusted = self.pose
            if found is not None:
                # Contours know a scan's heading as it was on average over the scan: blur has been taken off the noise.
                known = turn_noise * (1.0 - min(exposure, 1.0 / 3.0))
                self._learn(wrap_angle(increment[2] - self._motion[2]) ** 2, known, share)
        anchor = self.keyframes if active is None else active.anchor
        distance, turn = self._since_keyframe()
        self.blur = exposure * turn_noise * self.turn_excess
        keyframe, match, finished = None, None, None
        if active is None or distance > KEY_DISTANCE or turn > KEY_TURN:
            keyframe = self.keyframes
            if active is not None and found is not None:
                match = match_covariance(
                    hold(oriented, active.cells, self.pose), self.pose, active.hold, active.pose, self.blur
                )
            finished = self._keep(oriented, distance)
        about = active or self.newest
        return Step(self.pose, about.covariance, found, anchor, quality, nis, slipped, keyframe, match, finished)

    def _align(
        self, oriented: Floats, active: LocalMap, expected: list[Floats]
    ) -> tuple[Alignment, float, float, bool]:
        """Align where the wheels have the scan, and where that fits badly, elsewhere."""
        prior, slipped = invert(active.covariance), False
        found = align(oriented, active.cells, self.pose, prior)
        if found.overlap < POOR * self._usual:
            enough = (POOR + 0.2) * self._usual
            found, slipped = find_again(oriented, active.cells, expected, prior, found, enough)
        quality = min(found.overlap / max(self._usual, 0.5), 1.0)
        self._usual += 0.02 * (found.overlap - self._usual) if self._usual > 0.0 else found.overlap
        off = found.pose - self.pose
        off[2] = wrap_angle(off[2])
        self.pose = found.pose
        for local in (active, self._following):
            if local is not None:
                before = LOOSE if slipped else invert(local.covariance)
                local.covariance = invert(before + found.information)
        return found, quality, LOOSER * float(off @ prior @ off), slipped

    @property
    def turn_excess(self) -> float:
        """Variance of the wheels' turns as found, as a part of what was stated."""
        return float(self._turns[0] / self._turns[1]) if self._turns[1] > 0.0 else 1.0

    def _learn(self, square: float, expected: float, share: float) -> None:
        """Hold the wheels' turns against those of the contours; a robot at rest teaches nothing."""
        if self._turns[1] == 0.0:
            self._turns[:] = expected
        gain = share * max(1.0 / (self._taught + 2.0), LEARN)
        self._taught += share
        square = min(square, 16.0 * self.turn_excess * expected)  # a slip is none of the usual errors
        self._turns += gain * (np.array([square, expected]) - self._turns)

    def _since_keyframe(self) -> tuple[float, float]:
        step = between_one(self._last_key, self.pose)
        return math.hypot(step[0], step[1]), abs(float(step[2]))

    def _keep(self, oriented: Floats, distance: float) -> LocalMap | None:
        """Insert a keyframe; two local maps overlap by half, so that there always is one with some metres in it."""
        number, finished = self.keyframes, None
        if self.active is None:
            self.active = LocalMap(number, self.pose, self._half_width)
        for local in (self.active, self._following):
            if local is not None:
                local.insert(number, oriented, self.pose, distance)
        following = self._following
        if following is not None and self.active.travelled > LENGTH and len(following.members) >= FEWEST:
            finished, self.active, following = self.active, following, None
        if following is None and 2.0 * self.active.travelled > LENGTH:
            following = LocalMap(number, self.pose, self._half_width)
            following.insert(number, oriented, self.pose, 0.0)
        self._following, self._last_key = following, self.pose
        self.keyframes += 1
        return finished

    @property
    def newest(self) -> LocalMap:
        """The local map begun last."""
        newest = self._following or self.active
        if newest is None:
            raise RuntimeError("no scan has been pushed yet")
        return newest
