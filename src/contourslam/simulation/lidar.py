"""The simulated lidar: every beam is cast from where the lidar is at that beam's own time."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.chance import TURN_RATE, stream
from contourslam.simulation.config import LidarModel
from contourslam.simulation.drive import Drive, Progress
from contourslam.simulation.mjcf import import_mujoco
from contourslam.simulation.room import Room
from contourslam.simulation.world import compile_world

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class IdealScan:
    """One turn without noise.

    Attributes
    ----------
    stamp : float
        Time of the first beam, s.
    angles, offsets : ndarray, shape (n,)
        Direction of each beam in the lidar's frame, rad, and its time after the stamp, s.
    ranges : ndarray, shape (n,)
        Distance to what the beam meets, m; inf where it meets nothing.
    incidences : ndarray, shape (n,)
        Angle between the beam and the surface it meets, rad in [0, pi/2].
    """

    stamp: float
    angles: Floats
    offsets: Floats
    ranges: Floats
    incidences: Floats


def cast_scans(
    room: Room, drive: Drive, lidar: LidarModel, seed: int, *, progress: Progress | None = None
) -> tuple[IdealScan, ...]:
    """Cast all complete turns of a drive: the expensive half; :func:`~contourslam.simulation.noise.add_noise` is cheap.

    Parameters
    ----------
    room : Room
    drive : Drive
        Driven in that room.
    lidar : LidarModel
    seed : int
        Varies the turn rate, where it wobbles.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    tuple of IdealScan

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    """
    caster = SolidCaster(room)
    end, mount_z = drive.times[-1], lidar.mount_height - float(drive.positions[0, 2])
    scans: list[IdealScan] = []
    for stamp, offsets, angles in turns(lidar, seed):
        if stamp + offsets[-1] > end:
            break
        origins, directions = beams(drive, lidar, mount_z, stamp + offsets, angles)
        ranges, incidences = caster.cast(origins, directions)
        scans.append(IdealScan(stamp, angles, offsets, ranges, incidences))
        if progress is not None:
            progress(min(stamp / end, 1.0))
    return tuple(scans)


def turns(lidar: LidarModel, seed: int) -> Iterator[tuple[float, Floats, Floats]]:
    """Turn the lidar without end.

    Parameters
    ----------
    lidar : LidarModel
    seed : int
        Varies the turn rate, where it wobbles.

    Yields
    ------
    stamp : float
        Time of the first beam of a turn, s.
    offsets, angles : ndarray, shape (n,)
        As of :class:`IdealScan`.
    """
    chance, first, wobble = stream(seed, TURN_RATE), 0, 0.0
    while True:
        wobble = 0.9 * wobble + np.sqrt(1 - 0.9**2) * lidar.turn_rate_wobble * chance.standard_normal()
        rate = lidar.turn_rate + wobble
        if lidar.turn_rate_wobble > 0:
            rate = float(np.clip(rate, *lidar.turn_rate_limits))
        beams = round(lidar.samples_per_second / rate)
        angles = -np.pi + 2 * np.pi / beams * np.arange(beams)
        offsets = np.arange(beams) / lidar.samples_per_second
        yield round(first / lidar.samples_per_second, 9), offsets, -angles if lidar.clockwise else angles
        first += beams


def beams(drive: Drive, lidar: LidarModel, mount_z: float, times: Floats, angles: Floats) -> tuple[Floats, Floats]:
    """Origin (m) and unit direction of each beam in the world frame, each shape (n, 3), between physics steps.

    Parameters
    ----------
    drive : Drive
        Or a part of it with the times in it.
    lidar : LidarModel
    mount_z : float
        Height of the lidar above the axle, m.
    times, angles : ndarray, shape (n,)
        s; rad in the lidar's frame.
    """
    index, part = drive.between(times)
    weight = part[:, None]
    position = (1 - weight) * drive.positions[index] + weight * drive.positions[index + 1]
    axes = (1 - weight[:, None]) * drive.rotations[index] + weight[:, None] * drive.rotations[index + 1]
    directions = np.cos(angles)[:, None] * axes[:, :, 0] + np.sin(angles)[:, None] * axes[:, :, 1]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # The last digits of a product depend on how its factors lie in memory: make them lie the same for any drive.
    return position + np.ascontiguousarray(axes) @ np.array([lidar.mount_x, 0.0, mount_z]), directions


class SolidCaster:
    """Casts rays in a room in space, in MuJoCo: without a robot, whose own lidar stands above it and never sees it.

    Parameters
    ----------
    room : Room

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.
    """

    def __init__(self, room: Room) -> None:
        mujoco = import_mujoco()
        self._ray, self._model = mujoco.mj_ray, compile_world(room)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, self._data)

    def cast(self, origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
        """Range (m; inf where it meets nothing) and incidence (rad) of rays.

        Parameters
        ----------
        origins, directions : ndarray, shape (n, 3)
            World frame, m; directions of unit length.
        """
        # One call a beam: casting many at once (mj_multiRay) would make all of them start at one point.
        normals = np.zeros((len(origins), 3))
        found = [
            self._ray(self._model, self._data, origin, direction, None, 1, -1, None, normal)
            for origin, direction, normal in zip(origins, directions, normals, strict=True)
        ]
        ranges = np.array(found)
        incidences = np.arcsin(np.clip(np.abs(np.einsum("ij,ij->i", normals, directions)), 0.0, 1.0))
        return np.where(ranges < 0, np.inf, ranges), incidences
