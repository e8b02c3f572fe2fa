"""KISS-ICP: its pipeline class, told the range of an indoor lidar; the rest follows from its own rules.

It takes no odometry. The points of a scan count as simultaneous, so there is nothing to deskew.
"""

import numpy as np
from handover import Drive, Result, planar, run
from kiss_icp.config import load_config
from kiss_icp.kiss_icp import KissICP

MAX_RANGE = 20.0  # m


def slam(drive: Drive) -> Result:
    config = load_config(None)
    config.data.max_range = MAX_RANGE
    config.data.deskew = False
    config.mapping.voxel_size = MAX_RANGE / 100.0  # what it takes by itself where no size is given
    config.registration.max_num_threads = 1
    odometry, poses = KissICP(config), []
    for scan in drive:
        odometry.register_frame(scan.points(MAX_RANGE), np.zeros(0))
        poses.append(planar(odometry.last_pose))
    return np.array(poses), None


if __name__ == "__main__":
    run(slam)
