"""What is found out about two maps: how one lies in the other and what speaks for it, or why they stay apart."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.matching.small import invert

# One tie of each joint stays whatever a refinement finds, so that no map ever hangs loose. It is held this much looser,
# for the refinement ties the same keyframes anew, and nothing is to count twice.
LOOSER = 10.0

Reason = Literal["nothing alike", "too little", "ambiguous", "contradicted"]


@dataclass(frozen=True, slots=True)
class Tie:
    """A keyframe of the second map found among the contours of the first.

    Attributes
    ----------
    first, second : int
        Keyframes, each of its own map; the pose is known best as seen from that of the first.
    pose : ndarray, shape (3,)
        The second's keyframe seen from the first's: m, m, rad.
    covariance : ndarray, shape (3, 3)
        In the frame of the second's keyframe.
    """

    first: int
    second: int
    pose: Floats
    covariance: Floats


@dataclass(frozen=True, slots=True)
class Evidence:
    """What speaks for one way of laying a map on another, and against it.

    Attributes
    ----------
    corners, walls : int
        Landmarks of the second map found again in the first.
    agreeing : float
        Length of the surfaces that both maps have there, m.
    contradicted : float
        Part of the surfaces of either map, where the other has looked, that the other saw through.
    way : float
        Length of the robot's way in the second map from which the first was recognised, m.
    rival : float
        What speaks for the best other way of laying them, as a part of what speaks for this one.
    """

    corners: int
    walls: int
    agreeing: float
    contradicted: float
    way: float
    rival: float


@dataclass(frozen=True, slots=True)
class Joint:
    """Two maps that overlap.

    Attributes
    ----------
    pose : ndarray, shape (3,)
        Frame of the second map in the first's, where they overlap: m, m, rad. Both may be bent elsewhere.
    ties : tuple of Tie
    evidence : Evidence
    method : str
        What proposed it first: "constellation" (corners and walls) or "search" (contours).
    """

    pose: Floats
    ties: tuple[Tie, ...]
    evidence: Evidence
    method: str

    @property
    def surest(self) -> Tie:
        """The tie that is known best."""
        return min(self.ties, key=lambda tie: float(np.trace(tie.covariance[:2, :2])))

    def bonds(self) -> Iterator[tuple[Tie, Floats, bool]]:
        """All ties with their information, and the surest once more: whether each may be replaced by a refinement."""
        for tie in self.ties:
            yield tie, invert(tie.covariance), True
        if self.ties:
            yield self.surest, invert(self.surest.covariance) / LOOSER**2, False


@dataclass(frozen=True, slots=True)
class Apart:
    """Two maps that stay apart.

    Attributes
    ----------
    reason : str
        "nothing alike", "too little" (what is alike would fit many buildings), "ambiguous" (another way of laying them
        fits about as well) or "contradicted" (one map saw through the other's walls).
    best : Joint or None
        The likeliest way of laying them, for those who want to look; None where nothing was alike.
    """

    reason: Reason
    best: Joint | None = None
