"""What the X4 on the moving robot sees: each sample from where its head is at that sample's own time."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.config import LidarModel
from contourslam.simulation.hardware.body import Body, Moment
from contourslam.simulation.lidar import IdealScan, SolidCaster, turns
from contourslam.simulation.noise import measure
from contourslam.simulation.room import Room

Floats = NDArray[np.float64]
LASER_ASIDE, LASER_TILT = 0.0218, 0.0218 / 0.1553
"""The laser sits this far beside the head's axis, m, and looks inwards with this slope: the straight line that the
maker's correction of angles describes, to 0.02 degrees beyond half a metre."""


class Sight:
    """Measures for an :class:`~contourslam.simulation.hardware.x4.X4`; changed by every measurement.

    Parameters
    ----------
    room : Room
    lidar : LidarModel
    body : Body
        What carries it; its last moments must cover the times asked for.
    seed : int
        Of the noise and of the head's turning.
    """

    def __init__(self, room: Room, lidar: LidarModel, body: Body, seed: int) -> None:
        self._caster = SolidCaster(room)
        self._lidar, self._body, self._seed = lidar, body, seed
        self._chance = np.random.default_rng([seed, 103])
        self._mount = np.array([lidar.mount_x, 0.0, lidar.mount_height - body.now.position[2]])

    def samples(self) -> Iterator[int]:
        """Give how many samples each turn has, as the turn rate wanders."""
        return (len(offsets) for _, offsets, _ in turns(self._lidar, self._seed))

    def measure(self, times: Floats, degrees: Floats) -> Floats:
        """Measure distances (mm) at times (s) in uncorrected device angles (degrees, clockwise)."""
        ranges, incidences = self.true_ranges(times, degrees)
        ideal = IdealScan(float(times[0]), -np.radians(degrees), times - times[0], ranges, incidences)
        return 1000.0 * measure(ideal, self._lidar, self._chance).ranges

    def true_ranges(self, times: Floats, degrees: Floats) -> tuple[Floats, Floats]:
        """Distances from the head's axis (m; inf for nothing) and angles between laser and surface (rad)."""
        places, axes = _between(self._body.moments, times)
        bearing = -np.radians(degrees)
        ahead = np.cos(bearing)[:, None] * axes[:, :, 0] + np.sin(bearing)[:, None] * axes[:, :, 1]
        right = np.sin(bearing)[:, None] * axes[:, :, 0] - np.cos(bearing)[:, None] * axes[:, :, 1]
        rays = ahead - LASER_TILT * right
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        begins = places + axes @ self._mount + LASER_ASIDE * right
        lengths, incidences = self._caster.cast(begins, rays)
        hit = np.isfinite(lengths)
        found = LASER_ASIDE * right + np.where(hit, lengths, 0.0)[:, None] * rays
        return np.where(hit, np.linalg.norm(found, axis=1), np.inf), incidences


def _between(moments: Sequence[Moment], times: Floats) -> tuple[Floats, Floats]:
    """Places (n, 3) and axes (n, 3, 3) at times, between the moments around each."""
    known = np.array([moment.time for moment in moments])
    after = np.clip(np.searchsorted(known, times), 1, len(known) - 1)
    first, last = int(after.min()) - 1, int(after.max())
    few = [moments[k] for k in range(first, last + 1)]
    places, axes = np.array([moment.position for moment in few]), np.array([moment.axes for moment in few])
    after = after - first
    weight = np.clip((times - known[first + after - 1]) / (known[first + after] - known[first + after - 1]), 0.0, 1.0)
    mix = weight[:, None]
    return (
        (1.0 - mix) * places[after - 1] + mix * places[after],
        (1.0 - mix[:, None]) * axes[after - 1] + mix[:, None] * axes[after],
    )
