"""small_gicp as odometry: each scan aligned to a voxel map of the recent ones, as its example for odometry does.

The example (``ScanToModelMatchingOdometry``, VGICP) is for a car, with points 0.25 m and voxels 1 m apart; a room asks
for finer ones. Its first guess is constant velocity; here it is the wheels' motion, which is better on every log.
"""

import numpy as np
import small_gicp
from handover import Drive, Result, matrix, planar, run

MAX_RANGE = 30.0  # m
POINT_SPACING = 0.1  # m
VOXEL = 0.5  # m


def slam(drive: Drive) -> Result:
    voxels = small_gicp.GaussianVoxelMap(VOXEL)
    voxels.set_lru(horizon=100, clear_cycle=10)  # the example's
    pose, wheels, poses = np.eye(4), np.eye(4), []
    for scan in drive:
        points, _ = small_gicp.preprocess_points(scan.points(MAX_RANGE), POINT_SPACING)
        before, wheels = wheels, matrix(scan.odometry)
        if voxels.size():
            guess = pose @ np.linalg.inv(before) @ wheels
            pose = small_gicp.align(voxels, points, guess).T_target_source
        voxels.insert(points, pose)
        poses.append(planar(pose))
    return np.array(poses), None


if __name__ == "__main__":
    run(slam)
