"""What the base measured itself: angles of its wheels, and its inertial sensors."""

import math
from dataclasses import dataclass

from contourslam.errors import RecordingError


@dataclass(frozen=True, slots=True)
class WheelReading:
    """How far the wheels have turned.

    Attributes
    ----------
    stamp : float
        s.
    angles : tuple of (float, float)
        Of the left and the right wheel since some start, ahead is up, rad.
    speeds : tuple of (float, float)
        rad/s.

    Raises
    ------
    RecordingError
        If a number is not finite.
    """

    stamp: float
    angles: tuple[float, float]
    speeds: tuple[float, float]

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.stamp, *self.angles, *self.speeds))):
            raise RecordingError("wheels that did not turn by a finite angle")


@dataclass(frozen=True, slots=True)
class InertialReading:
    """What the inertial sensors say, in the base frame (x ahead, y left, z up).

    Attributes
    ----------
    stamp : float
        s.
    gyro : tuple of (float, float, float)
        Rates, rad/s; the bias is in them.
    acceleration : tuple of (float, float, float)
        m/s²; at rest z is about 9.81.

    Raises
    ------
    RecordingError
        If a number is not finite.
    """

    stamp: float
    gyro: tuple[float, float, float]
    acceleration: tuple[float, float, float]

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.stamp, *self.gyro, *self.acceleration))):
            raise RecordingError("an inertial reading that is not finite")


BaseReading = WheelReading | InertialReading
