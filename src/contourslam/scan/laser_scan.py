"""One turn of a 2-D lidar, each beam with its own angle and its own time."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.display import POINT, WALL, Sketch, card
from contourslam.errors import ScanError


@dataclass(frozen=True, slots=True)
class LaserScan:
    """A scan as it came from the sensor; nothing is filtered yet.

    Attributes
    ----------
    stamp : float
        Time of the first beam in s.
    angles : ndarray, shape (n,)
        Direction of each beam in the lidar's frame, rad, counter-clockwise. They need not be evenly spaced
        and may change in number from scan to scan.
    ranges : ndarray, shape (n,)
        Range of each beam in m. NaN, inf, zero and values outside the limits mean "no return".
    offsets : ndarray, shape (n,)
        Time of each beam after `stamp`, s.
    range_min, range_max : float
        Limits inside which a range is a measurement, m; `range_max` may be infinite.

    Raises
    ------
    ScanError
        If the three arrays differ in shape, a stamp, angle or offset is not finite, or the limits are not a range.
    """

    stamp: float
    angles: NDArray[np.float64]
    ranges: NDArray[np.float64]
    offsets: NDArray[np.float64]
    range_min: float
    range_max: float

    def __post_init__(self) -> None:
        for name in ("angles", "ranges", "offsets"):
            values = getattr(self, name)
            if not _unchanging(values):
                values = np.array(values, dtype=np.float64)
                values.flags.writeable = False
                object.__setattr__(self, name, values)
        shape = self.ranges.shape
        if len(shape) != 1 or self.angles.shape != shape or self.offsets.shape != shape:
            raise ScanError(
                f"scan at stamp {self.stamp}: angles {self.angles.shape}, ranges {shape} and offsets "
                f"{self.offsets.shape} must be vectors of one length"
            )
        if not (math.isfinite(self.stamp) and all_finite(self.angles) and all_finite(self.offsets)):
            raise ScanError(f"scan at stamp {self.stamp}: a stamp, angle or time offset is not finite")
        if not 0.0 <= self.range_min < self.range_max:
            raise ScanError(
                f"scan at stamp {self.stamp}: range limits [{self.range_min}, {self.range_max}] m are not a range"
            )

    def _repr_html_(self) -> str:
        """Show it in a notebook: where the beams ended, around the lidar."""
        with np.errstate(invalid="ignore"):
            returned = (self.ranges >= self.range_min) & (self.ranges <= self.range_max) & np.isfinite(self.ranges)
        angles, ranges = self.angles[returned], self.ranges[returned]
        sketch = Sketch(f"a scan of {len(ranges)} points around its lidar")
        sketch.dots(np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=-1), WALL, 2.0)
        sketch.dots(np.zeros((1, 2)), POINT, 8.0)
        far = math.isfinite(self.range_max)
        figures: dict[str, object] = {
            "stamp": f"{self.stamp:.3f} s",
            "beams, returned": f"{len(self.ranges)}, {len(ranges)}",
            "a range is": f"{self.range_min:g} m or more" + (f", up to {self.range_max:g} m" if far else ""),
        }
        if len(self.angles):
            figures["angles"] = f"{np.degrees(self.angles[0]):.1f}° to {np.degrees(self.angles[-1]):.1f}°"
            figures["from first to last beam"] = f"{1e3 * (self.offsets[-1] - self.offsets[0]):.1f} ms"
        return card("Laser scan", figures, sketch.svg())


def _unchanging(values: object) -> bool:
    """Whether an array may be shared, as the angles of all scans of a log are: nobody can write to it."""
    return (
        isinstance(values, np.ndarray)
        and values.dtype == np.float64
        and not values.flags.writeable
        and bool(values.flags.owndata)
    )


def all_finite(values: NDArray[np.float64]) -> bool:
    """Whether no value of a vector is NaN or infinite; where all are, this takes a tenth of the usual way."""
    return math.isfinite(values.dot(values)) or bool(np.isfinite(values).all())


def evenly_spaced(
    stamp: float,
    ranges: ArrayLike,
    *,
    angle_min: float,
    angle_increment: float,
    range_min: float,
    range_max: float,
    time_increment: float = 0.0,
) -> LaserScan:
    """Build a scan from evenly spaced beams, the form in which ROS and CARMEN carry it.

    Parameters
    ----------
    stamp : float
        Time of the first beam, s.
    ranges : array_like, shape (n,)
        Ranges, m.
    angle_min, angle_increment : float
        Direction of the first beam and the step to the next, rad.
    range_min, range_max : float
        Range limits, m.
    time_increment : float
        Time between two beams, s.

    Raises
    ------
    ScanError
        As :class:`LaserScan`.
    """
    values = np.asarray(ranges, dtype=np.float64)
    index = np.arange(values.size, dtype=np.float64)
    return LaserScan(stamp, angle_min + angle_increment * index, values, time_increment * index, range_min, range_max)
