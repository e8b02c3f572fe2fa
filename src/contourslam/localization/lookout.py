"""Looking where the robot is: its motion and what it sees, kept apart from the map until two looks agree."""

import math
from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, Protocol

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.geometry.poses import between_one, compose_one, transform
from contourslam.localization.posterior import Located
from contourslam.localization.view import View, view_of
from contourslam.matching.odometry import ContourOdometry
from contourslam.matching.oriented import move
from contourslam.slam.contour_motion import step_by_contours

AGREE, AGREE_ANGLE = 0.25, math.radians(5.0)  # m, rad: two looks closer than this say the same
WAY = 5.0  # m of driving that a look takes in
MOST_SCANS = 12  # nor does it take in more than these
BROKEN = 0.6  # contours that fit those before worse than this say that the robot was carried off: all begins anew
EAGER = 6  # looks that are taken in quick succession; later ones keep apart by more
SOON, LATER = 0.25, 1.0  # s between the first looks, and between later ones
LIKELY = 0.7  # probability by which one of two looks is sure enough; a single one had to be surer
HINT, ALONE = (
    0.3,
    0.2,
)  # probability of a look that is a hint, and of a second place beside it at most, as a part of that
MOST_LOOKS = 8  # that are remembered
# Looks none of which is sure must be so many, along so much of way (m) ...
STEADY_LOOKS, STEADY_WAY = 5, 3.0
# ... and none may find it less probable than this that the robot is there, or see a second place half as probable.
DOUBTED, CLEAR = 0.1, 0.5
STILL = np.zeros(3), 1e-10 * np.eye(3)


@dataclass(frozen=True, slots=True)
class _Look:
    """The base in the drive's own frame and, by a look at the map, in the map."""

    drive: Floats
    pose: Floats
    sure: bool
    hint: bool
    clear: bool

    def agrees(self, later: "_Look") -> bool:
        """Whether a later look finds the robot where it must have come to since."""
        off = between_one(compose_one(self.pose, between_one(self.drive, later.drive)), later.pose)
        return math.hypot(off[0], off[1]) < AGREE and abs(float(off[2])) < AGREE_ANGLE


@dataclass(frozen=True, slots=True)
class Agreed:
    """A pose in the map that looks agree on.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        m, m, rad.
    word : {"hint", "sure", "steady"}
        Two looks that were not sure, two that were, or all of them along some way.
    """

    pose: Floats
    word: Literal["hint", "sure", "steady"]


class Finder(Protocol):
    """Finds a robot in a whole map."""

    def find(self, view: View) -> Located:
        """Where what was seen lies in the map, and how sure that is."""


class Lookout:
    """A drive beside the map, with the looks at the map that were taken on the way; changed in place by every scan.

    Parameters
    ----------
    finder : Finder
    max_range : float
        No contour point lies farther from the robot than this, m.
    lidar : ndarray, shape (2,)
        Where the lidar sits on the base, m.
    """

    def __init__(self, finder: Finder, max_range: float, lidar: Floats) -> None:
        self._finder, self._max_range, self._lidar = finder, max_range, lidar
        self.scans = 0
        self.looks = 0
        self._next_look = 0.0
        self._begin()

    def _begin(self) -> None:
        self._odometry = ContourOdometry(self._max_range)
        self._kept: deque[tuple[Floats, Floats]] = deque(maxlen=MOST_SCANS)
        self._seen: deque[_Look] = deque(maxlen=MOST_LOOKS)
        self._newest: Floats = np.empty((0, 4))

    @property
    def pose(self) -> Floats:
        """Of the base in the drive's own frame, shape (3,)."""
        return self._odometry.pose

    def push(
        self, oriented: Floats, increment: Floats, noise: Floats, exposure: float, elapsed: float
    ) -> tuple[Floats, Floats]:
        """Take in a scan; gives its motion since the last one, and the covariance of that, as the contours have them.

        Parameters
        ----------
        oriented, increment, noise, exposure
            As of :meth:`contourslam.matching.odometry.ContourOdometry.push`.
        elapsed : float
            Since the last scan, s.
        """
        before = self._odometry.keyframes
        step = step_by_contours(self._odometry, oriented, increment, noise, exposure)
        if before and step.aligned and step.quality < BROKEN:
            self._begin()
            step = step_by_contours(self._odometry, oriented, *STILL)
            self.looks, self._next_look = 0, 0.0
        first = self._odometry.keyframes == 1 and not self._kept
        self.scans += 1
        self._next_look -= max(elapsed, 0.0)
        self._newest = oriented
        if self._odometry.keyframes > before or first:
            self._kept.append((oriented, self.pose))
        if first or not step.aligned:
            return increment, noise
        return step.increment, step.covariance

    def look(self) -> Agreed | None:
        """Look in the whole map, where a look is due; gives the pose in it where looks agree on one.

        Two looks are enough that are both sure of the pose. Where much has changed none is, for the robot might as well
        be in another building: then all looks along some way must agree, and none see a second place like it. Two looks
        that are less sure, but see no second place, give a hint.
        """
        if self._next_look > 0.0:
            return None
        self.looks += 1
        self._next_look = SOON if self.looks <= EAGER else LATER
        found = self._finder.find(self.view())
        if not np.isfinite(found.pose).all():
            self._seen.clear()
            return None
        rival = found.runners_up[0].probability if found.runners_up else 0.0
        clear = found.probability > DOUBTED and rival < CLEAR * found.probability
        sure = found.confident or (clear and found.probability > LIKELY)
        hint = sure or (found.probability > HINT and rival < ALONE * found.probability)
        look = _Look(self.pose, found.pose, sure, hint, clear)
        agreeing = [other for other in self._seen if other.agrees(look)]
        if len(agreeing) < len(self._seen):
            self._seen = deque([other for other in agreeing if other.hint], MOST_LOOKS)
        self._seen.append(look)
        if self._steady():
            return Agreed(look.pose, "steady")
        if sure and any(other.sure for other in agreeing):
            return Agreed(look.pose, "sure")
        return Agreed(look.pose, "hint") if hint and any(other.hint for other in agreeing) else None

    def _steady(self) -> bool:
        """Whether all looks along some way say the same."""
        way = sum(math.dist(a.drive[:2], b.drive[:2]) for a, b in pairwise(self._seen))
        return len(self._seen) >= STEADY_LOOKS and way > STEADY_WAY and all(look.clear for look in self._seen)

    def view(self) -> View:
        """What was seen on the last metres, in the frame of the base now."""
        points, origins = [self._newest], [np.tile(self._lidar, (len(self._newest), 1))]
        way, last = 0.0, self.pose
        for oriented, pose in reversed(self._kept):
            way += math.hypot(pose[0] - last[0], pose[1] - last[1])
            last = pose
            if way > WAY:
                break
            if oriented is self._newest:
                continue
            seen = between_one(self.pose, pose)
            points.append(move(oriented, seen))
            origins.append(np.tile(transform(seen, self._lidar), (len(oriented), 1)))
        return view_of(np.concatenate(points), np.concatenate(origins))
