"""Calibration of the base from simulated drives: wheels believed 2 % wrong, found from SLAM's own trajectory.

The truth is the radius at which the simulated tyres really rolled (they creep by half a percent), and the wheel base at
which they really turned: ``contourslam.simulation.odometry.effective_wheels``, from the true poses alone.
"""

import itertools
import sys
import time
from dataclasses import replace

import numpy as np

from contourslam.config import BackEnd, Config, SlamConfig
from contourslam.replay import replay
from contourslam.robot.base.calibration import calibrate
from contourslam.robot.base.odometry import Odometer
from contourslam.robot.base.wheel_track import track_from_odometry
from contourslam.robot.config import BaseConfig
from contourslam.scan import TruePose
from contourslam.simulation.config import YDLIDAR_X4, SimulationConfig
from contourslam.simulation.odometry import effective_wheels, read_odometry
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import simulate
from table import Table, publish

SEEDS, WRONG = 5, 0.02
BACK_ENDS: tuple[BackEnd, ...] = ("graph", "ekf")


def off(back_end: BackEnd, seeds: int) -> np.ndarray:
    """Errors left and standard deviations stated, of left and right radius and base, shape (runs, 2, 3)."""
    config, rows = SimulationConfig(lidar=YDLIDAR_X4), []
    for seed in range(seeds):
        run = simulate(ROOMS["furnished_room"], config, seed)
        true = np.array(effective_wheels(run.drive))
        for radius, base in itertools.product((WRONG, -WRONG), repeat=2):
            odometry = read_odometry(run.drive, config.robot, seed, errors=(radius, base))
            wrong = replace(run, odometry=odometry)
            messages = (message for message in wrong.messages() if not isinstance(message, TruePose))
            settings = Config(back_end=back_end, slam=SlamConfig(walls=True, contour_matching=True))
            result = replay(messages, settings, lidar_mount=run.lidar_mount)
            believed = BaseConfig(
                left_radius=config.robot.wheel_radius * (1.0 + radius),
                right_radius=config.robot.wheel_radius * (1.0 + radius),
                wheel_base=config.robot.wheel_base * (1.0 + base),
            )
            track = track_from_odometry(odometry.stamps, odometry.poses, believed)
            found = calibrate(result.stamps, result.poses, track, believed, tuple(run.lidar_mount.tolist()))
            wheels = np.array([found.base.left_radius, found.base.right_radius, found.base.wheel_base])
            rows.append((wheels / true - 1.0, found.sigmas))
            print(f"{back_end}, seed {seed}: {100.0 * rows[-1][0]} % off", file=sys.stderr, flush=True)
    return np.array(rows)


def step_time() -> float:
    """CPU time of one step of the fused odometry, s."""
    odometer, ways = Odometer(BaseConfig()), np.array([0.004, 0.006])
    odometer.step(ways, 0.02, 0.38)
    begun = time.process_time()
    for _ in range(5000):
        odometer.step(ways, 0.02, 0.38)
    return (time.process_time() - begun) / 5000


def main() -> None:
    rows = []
    for back_end in BACK_ENDS:
        errors, sigmas = np.moveaxis(off(back_end, SEEDS), 1, 0)
        for k, name in enumerate(("left radius", "right radius", "wheel base")):
            rows.append(
                [
                    back_end,
                    name,
                    f"{100.0 * np.sqrt(np.mean(errors[:, k] ** 2)):.3f} %",
                    f"{100.0 * np.abs(errors[:, k]).max():.3f} %",
                    f"{100.0 * sigmas[:, k].mean():.3f} %",
                ]
            )
    publish(Table("base", ["back end", "found from 2 % wrong", "RMS error", "worst", "doubt stated"], rows))
    micro = 1e6 * step_time()
    publish(
        Table(
            "base_odometry",
            ["fused odometry", "CPU time"],
            [["one step", f"{micro:.0f} us"], ["50 a second", f"{micro / 200.0:.2f} % of a core"]],
        )
    )


if __name__ == "__main__":
    main()
