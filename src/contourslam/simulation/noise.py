"""From ideal ranges to measured ones."""

import numpy as np

from contourslam.scan import LaserScan
from contourslam.simulation.chance import NOISE, stream
from contourslam.simulation.config import LidarModel
from contourslam.simulation.lidar import IdealScan


def add_noise(scans: tuple[IdealScan, ...], lidar: LidarModel, seed: int) -> tuple[LaserScan, ...]:
    """Measure ideal scans: Gaussian range noise, drop-outs, range limits.

    The same seed draws the same noise, scaled: sweeping `sigma_range` changes nothing but the size of the errors.

    Parameters
    ----------
    scans : tuple of IdealScan
    lidar : LidarModel
    seed : int

    Returns
    -------
    tuple of LaserScan
    """
    chance = stream(seed, NOISE)
    return tuple(measure(scan, lidar, chance) for scan in scans)


def measure(scan: IdealScan, lidar: LidarModel, chance: np.random.Generator) -> LaserScan:
    """Measure one ideal scan, the next that the lidar takes."""
    count, grazing = len(scan.ranges), np.radians(lidar.grazing_deg)
    # All draws are made whether used or not, so that one setting does not change the noise of another.
    errors, luck, glance = chance.standard_normal(count), chance.random(count), chance.random(count)
    with np.errstate(invalid="ignore"):
        ranges = scan.ranges + np.maximum(lidar.sigma_range, lidar.sigma_relative * scan.ranges) * errors
    lost = (luck < lidar.drop_rate) | (scan.incidences < glance * grazing)
    kept = ~lost & (ranges >= lidar.range_min) & (ranges <= lidar.range_max)
    ranges = np.where(kept, ranges, lidar.no_return)
    return LaserScan(scan.stamp, scan.angles, ranges, scan.offsets, lidar.range_min, lidar.range_max)
