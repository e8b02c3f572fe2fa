"""The pictures that the scene is coloured from, and where the camera was for each."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import interpolate
from contourslam.recordings.picture import Picture

Floats = NDArray[np.float64]

_APART, _TURNED = 0.1, 0.25  # m, rad; a picture is of use once the robot has moved on by this
_WINDOW = 0.1  # s to both sides that the rate of turn is taken over
_LONGEST = 1.0  # s between the poses that a picture's is interpolated from


@dataclass(frozen=True, slots=True)
class View:
    """A picture with the pose that it was taken at.

    Attributes
    ----------
    picture : Picture
    pose : ndarray, shape (3,)
        Base in the frame of the map: m, m, rad.
    turning : float
        Rate of turn, rad/s.
    """

    picture: Picture
    pose: Floats
    turning: float


@dataclass(frozen=True, slots=True)
class Views:
    """Pictures chosen along the way.

    Attributes
    ----------
    chosen : tuple of View
    seen : int
        How many pictures there were.
    placeless : int
        How many of them have no pose near by in time.
    """

    chosen: tuple[View, ...] = ()
    seen: int = 0
    placeless: int = 0


@dataclass
class _Choice:
    """Pictures kept so far; where they become too many, every second is dropped and fewer are kept from there on."""

    most: int
    apart: float = 1.0
    kept: list[View] = field(default_factory=list)

    def offer(self, view: View) -> None:
        if self.kept and _moved(self.kept[-1].pose, view.pose) < self.apart:
            return
        self.kept.append(view)
        if len(self.kept) > self.most:
            self.kept = self.kept[::2]
            self.apart *= 2.0


def _moved(first: Floats, second: Floats) -> float:
    """How far apart two poses are: 1 is as far as two pictures should be."""
    away = np.hypot(*(second[:2] - first[:2])) / _APART
    return float(away + abs(wrap(np.array(second[2] - first[2]))) / _TURNED)


def choose_views(pictures: Iterable[Picture], stamps: Floats, poses: Floats, most: int) -> Views:
    """Choose pictures along the way and tell where each was taken.

    Parameters
    ----------
    pictures : iterable of Picture
        In the order of the recording.
    stamps : ndarray, shape (n,)
        Of the trajectory, s, in any order.
    poses : ndarray, shape (n, 3)
        Base in the frame of the map.
    most : int
        How many pictures to keep at the most.

    Returns
    -------
    Views
    """
    stamps, first = np.unique(stamps, return_index=True)
    poses = poses[first]
    choice, seen, placeless = _Choice(max(most, 2)), 0, 0
    pose_at = _poses_at(stamps, poses)
    for picture in pictures:
        seen += 1
        placed = pose_at(picture.stamp)
        if placed is None:
            placeless += 1
        else:
            choice.offer(View(picture, *placed))
    return Views(tuple(choice.kept), seen, placeless)


def _poses_at(stamps: Floats, poses: Floats) -> Callable[[float], tuple[Floats, float] | None]:
    def pose_at(stamp: float) -> tuple[Floats, float] | None:
        after = int(np.searchsorted(stamps, stamp))
        if len(stamps) < 2 or not stamps[0] <= stamp <= stamps[-1]:
            return None
        after = min(max(after, 1), len(stamps) - 1)
        span = float(stamps[after] - stamps[after - 1])
        if span > _LONGEST:
            return None
        before, pose, later = interpolate(stamps, poses, stamp + np.array([-_WINDOW, 0.0, _WINDOW]))
        return pose, abs(float(wrap(np.array(later[2] - before[2])))) / (2.0 * _WINDOW)

    return pose_at
