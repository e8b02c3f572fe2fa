"""What a robot tells of its drive: facts that never change once told, so that a repeated one does no harm."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats


@dataclass(frozen=True, slots=True)
class KeyframeFact:
    """A keyframe: where it was thought to be when it was made, and what was seen from it.

    Attributes
    ----------
    number : int
        From 0, in the order of the run.
    stamp : float
        s, in the clock of the robot's scans.
    pose : ndarray, shape (3,)
        Base in the robot's own map as it was then: m, m, rad.
    blur : float
        Variance of the heading from turns during the scan that are not known, rad².
    points : ndarray of float32, shape (n, 4)
        Contour points and normals in the frame of the base: x, y (m), nx, ny.
    seen : ndarray of float32, shape (s, 13)
        Corners and walls with covariance, in the frame of the base: rows of :mod:`contourslam.graph.sightings`.
    drive : int
        From 0; a run that went on in a map that was kept has several, and between two there is no odometry.
    """

    number: int
    stamp: float
    pose: Floats
    blur: float
    points: NDArray[np.float32]
    seen: NDArray[np.float32]
    drive: int = 0


@dataclass(frozen=True, slots=True)
class RelationFact:
    """A relative pose between two keyframes of the run, as in :class:`contourslam.maps.Relations`.

    Attributes
    ----------
    first, second : int
    pose : ndarray, shape (3,)
        Of `second` seen from `first`: m, m, rad.
    information : ndarray, shape (3, 3)
        Inverse covariance, in the frame of `second`.
    robust : float
        Width of the Cauchy kernel in standard deviations; NaN where there is none.
    tie : bool
        True for a tie to a place seen before.
    """

    first: int
    second: int
    pose: Floats
    information: Floats
    robust: float
    tie: bool


@dataclass(frozen=True, slots=True)
class StretchFact:
    """A finished local map, as in :class:`contourslam.maps.Stretches`.

    Attributes
    ----------
    anchor : int
        Keyframe that it moves with.
    members : tuple of int
        Keyframes.
    seen : ndarray, shape (m, 3)
        Their poses seen from the anchor: m, m, rad.
    """

    anchor: int
    members: tuple[int, ...]
    seen: Floats


Fact = KeyframeFact | RelationFact | StretchFact


@dataclass(frozen=True, slots=True)
class Report:
    """One message of a robot to the server.

    Attributes
    ----------
    robot : str
        Its name.
    run : int
        Number drawn by chance each time its mapping begins anew, 63 bits: a robot that restarts has another.
    number : int
        Of the report in this run, from 0 without gaps; the same number always says the same.
    facts : tuple of Fact
    """

    robot: str
    run: int
    number: int
    facts: tuple[Fact, ...]


@dataclass(frozen=True, slots=True)
class Status:
    """Small message of a robot, sent regularly: by it the server sees what it has missed.

    Attributes
    ----------
    robot : str
    run : int
    reports : int
        How many reports there are of this run so far.
    keyframe : int
        The newest, -1 for none.
    pose : ndarray, shape (3,)
        Base seen from that keyframe: m, m, rad.
    stamp : float
        s, in the clock of the robot's scans.
    """

    robot: str
    run: int
    reports: int
    keyframe: int
    pose: Floats
    stamp: float


@dataclass(frozen=True, slots=True)
class Answer:
    """Message of the server to one robot, sent regularly and when its place has changed.

    Attributes
    ----------
    robot : str
    run : int
    received : int
        Reports 0 to `received` - 1 are all here and kept.
    missing : tuple of int
        Later ones that are not here though later yet ones are, the first few.
    common : int
        Number of the common map that the run belongs to; runs of the same number share a frame. It grows.
    members : tuple of str
        Robots whose maps are joined there, this one among them.
    keyframe : int
        The newest of the run that is placed, -1 for none.
    pose : ndarray, shape (3,)
        Base at that keyframe in the frame of the common map: m, m, rad.
    covariance : ndarray, shape (3, 3)
        Of that pose, in the axes of the common map.
    """

    robot: str
    run: int
    received: int
    missing: tuple[int, ...]
    common: int
    members: tuple[str, ...]
    keyframe: int
    pose: Floats
    covariance: Floats
