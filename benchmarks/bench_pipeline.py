"""Scans per second of the whole pipeline, deskew to map, at 500 beams, for each detector, on one core after warm-up."""

import time
from dataclasses import replace

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.scan import TruePose
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import simulate
from contourslam.slam import replay
from table import Table, publish

SECONDS, TURNS, TARGET = 120.0, 3, 1500


def main() -> None:
    run = simulate(ROOMS["furnished_room"], SimulationConfig(duration=SECONDS), seed=1)
    messages = [message for message in run.messages() if not isinstance(message, TruePose)]
    rows = []
    for name in DETECTORS:
        for walls in (False, True):
            config = Config(detector=name)
            config = replace(config, slam=replace(config.slam, walls=walls))
            best, stages = float("inf"), ""
            for _ in range(TURNS + 1):  # the first compiles
                start = time.perf_counter()
                result = replay(messages, config, initial_pose=run.initial_pose, lidar_mount=run.lidar_mount)
                elapsed = time.perf_counter() - start
                if elapsed < best:
                    best = elapsed
                    slowest = sorted(result.seconds.items(), key=lambda item: -item[1])[:3]
                    scans = len(result.stamps)
                    stages = ", ".join(f"{stage} {1e6 * seconds / scans:.0f}" for stage, seconds in slowest)
            rows.append([name, "with walls" if walls else "corners only", scans / best, TARGET, stages])
    publish(Table("pipeline", ["detector", "landmarks", "scans/s", "target", "slowest stages, µs a scan"], rows))


if __name__ == "__main__":
    main()
