"""SLAM as a robot would run it: readings go in as they come, a pose with covariance comes out of every scan."""

import matplotlib.pyplot as plt
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
    stamps, errors, sigmas = [], [], []
    for message in run.messages():
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        elif isinstance(message, LaserScan):
            update = slam.push_scan(message)
            sigma = np.sqrt(np.diag(update.covariance))
            off = update.pose - run.truth(np.array([update.stamp]))[0]
            stamps.append(update.stamp)
            errors.append(off)
            sigmas.append(sigma)
            if round(10 * message.stamp) % 50 == 0:
                x, y, theta = update.pose
                print(
                    f"{update.stamp:5.1f} s: x {x:6.3f} ± {sigma[0]:.3f} m, y {y:6.3f} ± {sigma[1]:.3f} m, "
                    f"heading {theta:6.3f} ± {sigma[2]:.4f} rad, {len(update.matched)} landmarks, "
                    f"off by {np.hypot(*off[:2]):.3f} m"
                )
    print(f"map: {len(slam.corner_map().ids)} corners, {len(slam.wall_map().ids)} walls")
    draw(np.array(stamps), np.array(errors), np.array(sigmas))


def draw(stamps: np.ndarray, errors: np.ndarray, sigmas: np.ndarray) -> None:
    """Error of each coordinate inside two of its own standard deviations, as the filter states them."""
    errors[:, 2] = (errors[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    _, rows = plt.subplots(3, 1, figsize=(8.0, 5.5), sharex=True, layout="constrained")
    for i, name in enumerate(("x, mm", "y, mm", "heading, mrad")):
        rows[i].fill_between(stamps, -2e3 * sigmas[:, i], 2e3 * sigmas[:, i], color="tab:blue", alpha=0.2, label="±2σ")
        rows[i].plot(stamps, 1e3 * errors[:, i], color="tab:blue", linewidth=1.0, label="error")
        rows[i].set(ylabel=name, xlim=(stamps[0], stamps[-1]))
    rows[0].legend(loc="upper right", ncols=2)
    rows[2].set_xlabel("time, s")
    plt.show()


if __name__ == "__main__":
    main()
