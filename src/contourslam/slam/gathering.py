"""A run gathered from what its scans gave, one after the other, and from what the back end knows at the end."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contourslam.config import Config
from contourslam.geometry.poses import between, compose
from contourslam.slam.landmark_map import CornerMap, WallMap
from contourslam.slam.mapper import Finished
from contourslam.slam.result import Floats, OdometryReadings, RunResult, ScanUpdate


class Mapped(NamedTuple):
    """A scan that was mapped: what it gave, raw odometry at its stamp, and how many readings of it had come before."""

    update: ScanUpdate
    odometry: Floats
    readings: int


def gather(
    config: Config,
    mapped: Sequence[Mapped],
    readings: Floats,
    start: Floats,
    finished: Finished | None,
    maps: tuple[CornerMap, WallMap],
    *,
    blind: int = 0,
) -> RunResult:
    """Gather a run.

    Parameters
    ----------
    config : Config
    mapped : sequence of Mapped
        In the order of mapping.
    readings : ndarray, shape (m, 4)
        Stamp (s) and pose (m, m, rad) of every odometry reading.
    start : ndarray, shape (3,)
        Base in the world where the run starts; raw odometry is moved so that it starts there.
    finished : Finished or None
        What the back end knows of the whole drive, where it revises.
    maps : tuple of (CornerMap, WallMap)
    blind : int
        How many scans came before any odometry.

    Returns
    -------
    RunResult
    """
    updates = [scan.update for scan in mapped]
    poses = np.array([u.pose for u in updates]).reshape(-1, 3)
    covariances = np.array([u.covariance for u in updates]).reshape(-1, 3, 3)
    odometry = np.array([scan.odometry for scan in mapped]).reshape(-1, 3)
    between_scans = None
    if len(odometry):
        odometry[:blind] = odometry[min(blind, len(odometry) - 1)]  # the wheels' own origin is no motion
        origin = odometry[0]
        odometry = compose(start, between(origin, odometry))
        if len(readings) and blind < len(odometry):
            before = np.searchsorted([scan.readings for scan in mapped], np.arange(len(readings)), side="right")
            moved = compose(start, between(origin, readings[:, 1:]))
            between_scans = OdometryReadings(readings[:, 0], moved, before)
    quality = [u.quality for u in updates if u.quality is not None]
    counts = np.array([(len(u.matched), u.corners, u.walls, u.nis_dof) for u in updates], dtype=np.int64).reshape(-1, 4)
    return RunResult(
        detector=config.detector,
        stamps=np.array([u.stamp for u in updates]),
        poses=poses if finished is None else finished.poses,
        covariances=covariances if finished is None else finished.covariances,
        odometry=odometry,
        truth=None,
        nis=np.array([u.nis for u in updates]),
        nis_dof=counts[:, 3],
        matched_count=counts[:, 0],
        corner_count=counts[:, 1],
        wall_count=counts[:, 2],
        corner_map=maps[0],
        wall_map=maps[1],
        back_end=config.back_end,
        online_poses=None if finished is None else poses,
        quality=np.array(quality) if quality else None,
        loops=() if finished is None else finished.loops,
        readings=between_scans,
    )
