"""The lines of a CARMEN log that hold scans and odometry, each turned into values.

Formats as CARMEN's logger writes them into the head of its logs. A line that does not fit raises ValueError, with a
reason that is the same for all lines of its kind, or ScanError.
"""

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from contourslam.recordings.numbers import parse_numbers
from contourslam.scan import LaserScan, Odometry

Floats = NDArray[np.float64]
Parsed = tuple[Odometry] | tuple[Odometry, LaserScan]

# SICK scanners say 81.83 or 81.91 m for "no return"; nothing indoors is farther than this.
_NO_RETURN = 50.0
# Far beyond any building: a corrupt number must not overflow in what follows.
_LARGEST = 1e9
WRONG_COUNT = "wrong number of values"


@lru_cache(maxsize=32)
def beam_angles(count: int) -> Floats:
    """Directions of an old-format scan's beams over 180 degrees.

    An odd number of beams includes both ends (181: whole degrees, 361: half degrees), an even one leaves the last out.

    Parameters
    ----------
    count : int
        Number of beams.

    Returns
    -------
    ndarray, shape (count,)
        rad, from -pi/2, counter-clockwise.
    """
    # A copy, for what owns its numbers and is read-only is shared by the scans.
    angles = np.linspace(-0.5 * math.pi, 0.5 * math.pi, count, endpoint=count % 2 == 1).copy()
    angles.flags.writeable = False
    return angles


@lru_cache(maxsize=32)
def _at_once(count: int) -> Floats:
    """Time offsets of beams that count as simultaneous: zeros, shared by all scans."""
    offsets = np.zeros(count)
    offsets.flags.writeable = False
    return offsets


def _odometry(stamp: bytes, pose: list[bytes]) -> Odometry:
    x, y, heading = map(float, pose)
    if not (abs(x) < _LARGEST and abs(y) < _LARGEST and abs(heading) < _LARGEST):  # so that NaN is refused too
        raise ValueError("odometry pose out of bounds")
    return Odometry(float(stamp), np.array((x, y, heading)))


def parse_odom(line: bytes) -> Parsed:
    """``ODOM x y theta tv rv accel ipc_stamp host logger_stamp``."""
    words = line.split()
    if len(words) != 10:
        raise ValueError(WRONG_COUNT)
    return (_odometry(words[7], words[1:4]),)


def parse_flaser(line: bytes) -> Parsed:
    """``FLASER n ranges.. x y theta odom_x odom_y odom_theta ipc_stamp host logger_stamp``."""
    head, *tail = line.rsplit(None, 9)
    words = head.split(None, 2)
    if len(tail) != 9 or len(words) < 2:
        raise ValueError(WRONG_COUNT)
    ranges = parse_numbers(words[2] if len(words) == 3 else b"", _beam_count(words[1], line))
    odometry = _odometry(tail[6], tail[3:6])
    scan = LaserScan(odometry.stamp, beam_angles(ranges.size), ranges, _at_once(ranges.size), 0.0, _NO_RETURN)
    return odometry, scan


def parse_robotlaser(line: bytes) -> Parsed:
    """``ROBOTLASER1``, the newer scan line, which carries its own angles and largest range.

    ``ROBOTLASER1 type start_angle field_of_view resolution max_range accuracy remission_mode n ranges.. m remissions..
    laser_pose robot_pose tv rv forward_distance side_distance turn_axis ipc_stamp host logger_stamp``; logs of the
    first versions have no remissions (not even their number), some also no turn_axis.
    """
    words, count, poses = _robotlaser_words(line)
    start, _, resolution, max_range = map(float, words[2:6])
    if not (abs(start) < 10.0 and abs(resolution) < 10.0):  # radians; NaN is refused too
        raise ValueError("start angle or resolution that is no angle")
    odometry = _odometry(words[-3], words[poses + 3 : poses + 6])
    ranges = parse_numbers(b" ".join(words[9 : 9 + count]), count)
    limit = max_range if 0.0 < max_range < _NO_RETURN else _NO_RETURN
    angles = start + resolution * np.arange(count, dtype=np.float64)
    return odometry, LaserScan(odometry.stamp, angles, ranges, _at_once(count), 0.0, limit)


def laser_pose(line: bytes) -> Floats:
    """Pose of the laser that a well-formed scan line states, x (m), y (m), heading (rad)."""
    if line.startswith(b"FLASER"):
        words, first = line.split(), -9
    else:
        words, _, first = _robotlaser_words(line)
    return np.array([float(word) for word in words[first : first + 3 or None]])


def _robotlaser_words(line: bytes) -> tuple[list[bytes], int, int]:
    """Words of a ROBOTLASER1 line, its number of beams, and where its poses start."""
    words = line.split()
    if len(words) < 22:
        raise ValueError(WRONG_COUNT)
    count = _beam_count(words[8], line)
    rest = len(words) - 9 - count
    if rest in (13, 14):
        return words, count, 9 + count
    if rest < 15 or int(words[9 + count]) != rest - 15:
        raise ValueError(WRONG_COUNT)
    return words, count, len(words) - 14


def _beam_count(word: bytes, line: bytes) -> int:
    count = int(word)
    if not 0 <= count <= len(line) // 2:  # each takes a digit and a blank: a corrupt count must not claim the memory
        raise ValueError(WRONG_COUNT)
    return count


SCAN_LINES: dict[bytes, Callable[[bytes], Parsed]] = {b"FLASER": parse_flaser, b"ROBOTLASER1": parse_robotlaser}
