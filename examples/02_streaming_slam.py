"""SLAM as a robot would run it: readings go in as they come, a pose with covariance comes out of every scan."""

import numpy as np

from contourslam.config import Config, SlamConfig
from contourslam.scan import LaserScan, Odometry
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import simulate
from contourslam.slam import ContourSlam


def main() -> None:
    run = simulate(ROOMS["furnished_room"], SimulationConfig(duration=30.0), seed=1)
    slam = ContourSlam(Config(slam=SlamConfig(walls=True)), initial_pose=run.initial_pose, lidar_mount=run.lidar_mount)
    for message in run.messages():
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            update = slam.push_scan(message)
            if round(10 * message.stamp) % 50 == 0:
                x, y, theta = update.pose
                sigma = np.sqrt(np.diag(update.covariance))
                error = np.hypot(*(update.pose - run.truth(np.array([update.stamp]))[0])[:2])
                print(
                    f"{update.stamp:5.1f} s: x {x:6.3f} ± {sigma[0]:.3f} m, y {y:6.3f} ± {sigma[1]:.3f} m, "
                    f"heading {theta:6.3f} ± {sigma[2]:.4f} rad, {len(update.matched)} landmarks, off by {error:.3f} m"
                )
    print(f"map: {len(slam.corner_map().ids)} corners, {len(slam.wall_map().ids)} walls")


if __name__ == "__main__":
    main()
