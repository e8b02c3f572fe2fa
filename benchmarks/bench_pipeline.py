"""Scans per second of the whole pipeline, deskew to map, at 500 beams, for each detector, on one core after warm-up."""

import time
from dataclasses import replace

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.replay import replay
from contourslam.scan import TruePose
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import simulate
from table import Table, publish

SECONDS, TURNS, TARGET = 120.0, 5, 1500


def main() -> None:
    run = simulate(ROOMS["furnished_room"], SimulationConfig(duration=SECONDS), seed=1)
    messages = [message for message in run.messages() if not isinstance(message, TruePose)]
    variants = [(name, walls) for name in DETECTORS for walls in (False, True)]
    best: dict[tuple[str, bool], tuple[float, str]] = {}
    # Turn by turn through all of them, so that a slow spell of the machine does not hit one alone; the first compiles.
    for turn in range(TURNS + 1):
        for name, walls in variants:
            config = Config(detector=name)
            config = replace(config, slam=replace(config.slam, walls=walls))
            start = time.perf_counter()
            result = replay(messages, config, initial_pose=run.initial_pose, lidar_mount=run.lidar_mount)
            speed = len(result.stamps) / (time.perf_counter() - start)
            if turn > 0 and speed > best.get((name, walls), (0.0, ""))[0]:
                slowest = sorted(result.seconds.items(), key=lambda item: -item[1])[:3]
                each = ", ".join(f"{stage} {1e6 * seconds / len(result.stamps):.0f}" for stage, seconds in slowest)
                best[name, walls] = speed, each
    rows: list[list[object]] = [
        [name, "with walls" if walls else "corners only", best[name, walls][0], TARGET, best[name, walls][1]]
        for name, walls in variants
    ]
    publish(Table("pipeline", ["detector", "landmarks", "scans/s", "target", "slowest stages, µs a scan"], rows))


if __name__ == "__main__":
    main()
