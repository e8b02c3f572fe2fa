"""Where the lidar sits on the robot, out of a recording's transforms."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.rigid import from_quaternion, rigid
from contourslam.recordings.ros_messages import frame_name

Floats = NDArray[np.float64]

_BASES = ("base_link", "base_footprint")
# No robot is larger, m.
_LARGEST = 1e3


@dataclass(frozen=True, slots=True)
class Mount:
    """Place of the lidar in the base frame.

    Attributes
    ----------
    base : str
        The base frame.
    pose : tuple of (float, float, float)
        x (m), y (m), yaw (rad).
    mirrored : bool
        It hangs upside down.
    matrix : ndarray, shape (4, 4)
        The same place in space, m.
    """

    base: str
    pose: tuple[float, float, float]
    mirrored: bool
    matrix: Floats


class FrameTree:
    """Frames and the transforms between them."""

    def __init__(self) -> None:
        self._parents: dict[str, tuple[str, Floats]] = {}

    def add(self, transforms: list[Any]) -> None:
        """Add the transforms of a ``TFMessage``; the first for a frame counts, and one that is no motion does not."""
        for stamped in transforms:
            child, parent = frame_name(stamped.child_frame_id), frame_name(stamped.header.frame_id)
            matrix = _matrix(stamped.transform)
            if matrix is not None:
                self._parents.setdefault(child, (parent, matrix))

    def mount(self, lidar_frame: str, odometry_child: str) -> Mount | None:
        """Find the lidar in the base frame: the one that the odometry speaks of, or else one of the usual names."""
        found = self.from_base(lidar_frame, odometry_child)
        if found is None:
            return None
        base, matrix = found
        yaw = float(np.arctan2(matrix[1, 0], matrix[0, 0]))
        return Mount(base, (float(matrix[0, 3]), float(matrix[1, 3]), yaw), bool(matrix[2, 2] < 0.0), matrix)

    def from_base(self, frame: str, odometry_child: str) -> tuple[str, Floats] | None:
        """Find the base frame, and the transform (4, 4) from a frame to it; None where they do not hang together."""
        above = self._ancestors(frame_name(frame))
        for base in dict.fromkeys((frame_name(odometry_child), *_BASES)):
            up_from_base = self._ancestors(base)
            common = next((name for name in above if name in up_from_base), None)
            if base and common is not None:
                return base, np.linalg.inv(up_from_base[common]) @ above[common]
        return None

    def _ancestors(self, frame: str) -> dict[str, Floats]:
        """Give every frame above `frame`, nearest first, with the transform from `frame` to it."""
        found = {frame: np.eye(4)}
        matrix = np.eye(4)
        while frame in self._parents:
            frame, step = self._parents[frame]
            if frame in found:  # a cycle: the transforms are wrong
                break
            matrix = step @ matrix
            found[frame] = matrix
        return found


def _matrix(transform: Any) -> Floats | None:
    """4 by 4 matrix of a transform message; None for corrupt values."""
    q, t = transform.rotation, transform.translation
    length = math.hypot(q.x, q.y, q.z, q.w)
    if not (abs(length - 1.0) < 0.1 and math.hypot(t.x, t.y, t.z) < _LARGEST):  # so that NaN is refused too
        return None
    return rigid(from_quaternion(q.x, q.y, q.z, q.w), (t.x, t.y, t.z))
