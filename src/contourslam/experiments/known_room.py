"""What a simulated run makes known besides its messages: the true room, the true poses, and the bound they give."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contourslam.config import Config, MotionConfig
from contourslam.evaluation.cramer_rao import CramerRaoBound, ScanModel, cramer_rao_bound
from contourslam.evaluation.ground_truth import GroundTruth
from contourslam.simulation.config import LidarModel
from contourslam.simulation.room import Room
from contourslam.simulation.simulate import SimulatedRun

Floats = NDArray[np.float64]

LEAST_SIGMA = 0.002
"""Range noise that the pipeline is told at least, m: no real lidar is better, and no line fit is exact."""


WHEELS = MotionConfig(
    forward_per_sqrt_m=0.01,
    lateral_per_sqrt_m=0.003,
    turn_per_sqrt_m_deg=0.3,
    turn_per_sqrt_rad_deg=0.6,
    clock_sigma=0.001,
)
"""Odometry noise of the simulated robot: radius and base known to 1 %, 0.6 degrees after a turn of 1 rad; one clock."""


def told(config: Config, lidar: LidarModel) -> Config:
    """Tell the pipeline what the data sheets say: the lidar's noise, range and place, and how good the wheels are.

    Where the configuration sets an odometry noise of its own, that one stays.

    Parameters
    ----------
    config : Config
    lidar : LidarModel

    Returns
    -------
    Config
    """
    sheet = replace(
        config.lidar,
        sigma_range=max(lidar.sigma_range, LEAST_SIGMA),
        max_range=lidar.range_max,
        mount_x=lidar.mount_x,
        mount_y=0.0,
        mount_yaw=0.0,
    )
    slam = replace(config.slam, motion=WHEELS) if config.slam.motion == MotionConfig() else config.slam
    return replace(config, lidar=sheet, slam=slam)


def true_room(room: Room, height: float) -> GroundTruth:
    """Outline and corners of a room at a height (m) above the floor.

    Raises
    ------
    MissingExtraError
        If shapely is not installed.
    """
    corners = room.corners(height)
    return GroundTruth(
        room.segments(height),
        room.circles(height),
        corners.positions,
        corners.directions,
        corners.openings,
        corners.convex,
    )


def localisation_bound(run: SimulatedRun, config: Config) -> CramerRaoBound | None:
    """Cramér-Rao bound of localisation in the known room along a run that starts at a known pose.

    Parameters
    ----------
    run : SimulatedRun
    config : Config
        Its motion noise is the odometry's.

    Returns
    -------
    CramerRaoBound or None
        None for a lidar without noise, which leaves nothing to bound.
    """
    sigma = run.lidar.sigma_range
    if sigma <= 0.0 or not run.scans:
        return None
    height = run.lidar.mount_height
    model = ScanModel(run.scans[0].angles, sigma, tuple(run.lidar_mount.tolist()), run.lidar.range_max)
    poses = run.truth(np.array([scan.stamp for scan in run.scans]))
    return cramer_rao_bound(
        run.room.segments(height), run.room.circles(height), poses, model, config.slam.motion, np.zeros((3, 3))
    )
