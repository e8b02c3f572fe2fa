"""One run in one room: drive, look around, and hand on what the sensors said, with the truth."""

import bisect
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.rigid import from_planar
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.config import LidarModel, SimulationConfig
from contourslam.simulation.drive import Drive, Progress, drive
from contourslam.simulation.lidar import IdealScan, cast_scans
from contourslam.simulation.noise import add_noise
from contourslam.simulation.odometry import WheelOdometry, read_odometry
from contourslam.simulation.room import Room

Floats = NDArray[np.float64]
Message = LaserScan | Odometry | TruePose


@dataclass(frozen=True, slots=True)
class SimulatedRun:
    """A run: what happened, what the sensors said.

    Attributes
    ----------
    room : Room
    lidar : LidarModel
        The lidar that measured `scans`, its noise included.
    seed : int
    drive : Drive
        The truth at every physics step; its pose at 0 s is the robot's initial pose in the world frame.
    odometry : WheelOdometry
        It starts at zero; :func:`contourslam.geometry.poses.compose` with the initial pose puts it into the world.
    ideal_scans : tuple of IdealScan
    scans : tuple of LaserScan
    """

    room: Room
    lidar: LidarModel
    seed: int
    drive: Drive
    odometry: WheelOdometry
    ideal_scans: tuple[IdealScan, ...]
    scans: tuple[LaserScan, ...]

    @property
    def lidar_mount(self) -> Floats:
        """Pose of the lidar in the base frame: x (m), y (m), heading (rad), shape (3,)."""
        return np.array([self.lidar.mount_x, 0.0, 0.0])

    @property
    def lidar_place(self) -> Floats:
        """T_base_lidar: the same in space, from the floor below the axle, shape (4, 4), m."""
        return from_planar(self.lidar_mount, self.lidar.mount_height)

    @property
    def initial_pose(self) -> Floats:
        """True pose of the base at 0 s in the world frame, shape (3,)."""
        return np.array(self.drive.poses[0])

    def truth(self, stamps: Floats) -> Floats:
        """True poses of the base in the world frame at the given times (s), shape (m, 3)."""
        return self.drive.truth(stamps)

    def with_noise(self, sigma: float, seed: int | None = None) -> "SimulatedRun":
        """Return the same run measured again with another noise; cheap.

        Parameters
        ----------
        sigma : float
            Standard deviation of every range, m.
        seed : int, optional
            Of the noise; by default the run's own.
        """
        lidar = self.lidar.with_noise(sigma)
        noise_seed = self.seed if seed is None else seed
        return replace(self, lidar=lidar, scans=add_noise(self.ideal_scans, lidar, noise_seed))

    def messages(self) -> Iterator[Message]:
        """All messages in the order in which they are published.

        The truth comes with each odometry reading and at each scan's stamp; a scan comes once it is complete, right
        after the first odometry reading that is not older than its last beam.
        """
        ticks = self.odometry.stamps.tolist()
        scan_stamps = [scan.stamp for scan in self.scans]
        true_stamps = np.array(sorted({*ticks, *scan_stamps}))
        out: list[tuple[float, int, Message]] = [
            (stamp, 0, TruePose(stamp, pose))
            for stamp, pose in zip(true_stamps.tolist(), self.truth(true_stamps), strict=True)
        ]
        out += [(s, 1, Odometry(s, pose)) for s, pose in zip(ticks, self.odometry.poses, strict=True)]
        for scan in self.scans:
            covered = bisect.bisect_left(ticks, round(scan.stamp + float(scan.offsets[-1]), 9))
            if covered < len(ticks):
                out.append((ticks[covered], 2, scan))
        out.sort(key=lambda entry: entry[:2])
        for _, _, message in out:
            yield message


def simulate(room: Room, config: SimulationConfig, seed: int, *, progress: Progress | None = None) -> SimulatedRun:
    """Drive through a room and record what the sensors say; the same arguments give bit-equal messages.

    Parameters
    ----------
    room : Room
    config : SimulationConfig
    seed : int
        Varies everything that chance decides: start, speed, friction, load, odometry, lidar.
    progress : callable, optional
        Called with the fraction done, 0 to 1.

    Returns
    -------
    SimulatedRun

    Raises
    ------
    MissingExtraError
        If MuJoCo or shapely is not installed.
    """
    driven = drive(
        room, config.robot, seed, speed=config.speed, duration=config.duration, progress=_part(progress, 0.0, 0.5)
    )
    odometry = read_odometry(driven, config.robot, seed)
    ideal = cast_scans(room, driven, config.lidar, seed, progress=_part(progress, 0.5, 1.0))
    lidar = config.measuring_lidar
    return SimulatedRun(room, lidar, seed, driven, odometry, ideal, add_noise(ideal, lidar, seed))


def _part(progress: Progress | None, first: float, last: float) -> Progress | None:
    return None if progress is None else lambda done: progress(first + (last - first) * done)
