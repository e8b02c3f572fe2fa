"""One live session as a robot runs it, in a process with nothing else in it: give it figures.json, messages, what.

What is "ekf" (the paper's filter), "filter" (with walls and contour matching), "graph", or "localize"; then a map file,
which "graph" writes and "localize" reads. ``pi_drive.py record MESSAGES`` simulates the drive and writes the messages.
"""

import json
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

BEAMS = 500


def record(file: Path) -> None:
    """Two laps of the furnished room with a YDLidar X4 at 10 turns a second: 500 beams a scan."""
    import numpy as np

    from contourslam.scan import LaserScan, Odometry
    from contourslam.simulation.config import YDLIDAR_X4, SimulationConfig
    from contourslam.simulation.rooms import ROOMS
    from contourslam.simulation.simulate import simulate

    lidar = replace(YDLIDAR_X4, turn_rate=10.0, turn_rate_wobble=0.0)
    run = simulate(ROOMS["furnished_room"], SimulationConfig(lidar=lidar), seed=1)
    with file.open("wb") as out:
        np.save(out, run.lidar_mount)
        for message in run.messages():
            if isinstance(message, Odometry):
                np.save(out, np.array([message.stamp, *message.pose]))
            elif isinstance(message, LaserScan):
                assert len(message.ranges) == BEAMS
                np.save(out, np.array([[message.stamp] * BEAMS, message.angles, message.offsets, message.ranges]))


def main() -> None:
    if sys.argv[1] == "record":
        record(Path(sys.argv[2]))
        return
    sys.modules["scipy"] = None  # type: ignore[assignment]  # Numba loads it where it is; the core does not need it
    figures, file, what = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    map_file = Path(sys.argv[4]) if len(sys.argv) > 4 and sys.argv[4] else None
    most = int(sys.argv[5]) if len(sys.argv) > 5 else sys.maxsize

    import numpy as np

    from contourslam.config import Config, LiveConfig, SlamConfig
    from contourslam.live.session import Session
    from contourslam.live.start import localization, mapping
    from contourslam.scan import LaserScan, Odometry

    def messages() -> Iterator[LaserScan | Odometry]:
        while True:
            try:
                row = np.load(stream)
            except EOFError:
                return
            if row.ndim == 1:
                yield Odometry(float(row[0]), row[1:])
            else:
                yield LaserScan(float(row[0, 0]), row[1], row[3], row[2], 0.12, 10.0)

    if what == "graph":
        import gtsam  # noqa: F401  # so that loading it is not counted as work on the first scan
    serving = Config(slam=SlamConfig(walls=True, contour_matching=True))
    config = {"ekf": Config(), "graph": replace(serving, back_end="graph")}.get(what, serving)
    with file.open("rb") as stream:
        mount = np.load(stream)
        session: Session
        if what == "localize":
            assert map_file is not None
            session = localization(config, LiveConfig(), map_file, lidar_mount=mount)
        else:
            session = mapping(config, LiveConfig(), lidar_mount=mount)
        loaded = time.process_time()
        cpu: list[float] = []
        ready = math.nan
        for message in messages():
            start = time.process_time()
            if isinstance(message, Odometry):
                session.push_odometry(message, message.stamp)
            else:
                session.push_scan(message, message.stamp)
            done = session.poll(message.stamp)
            spent = time.process_time() - start
            if not done:
                if cpu:
                    cpu[-1] += spent  # what the readings between two scans take is counted with the scan
                continue
            cpu.append(spent)
            if len(cpu) == 1:
                ready = time.process_time()
            if len(cpu) == most:
                break
        corners, walls = session.corner_map(), session.wall_map()
        if what == "graph" and map_file is not None:
            session.save(map_file)
        session.close()
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    memory = {name: int(status[name].split()[0]) / 1000 for name in ("VmHWM", "VmRSS", "RssAnon")}
    times = np.array(cpu[50:])  # past what the beginning alone takes
    figures.write_text(
        json.dumps(
            {
                "scans": len(cpu),
                "landmarks": len(corners.positions) + len(walls.normals),
                "loading": loaded,
                "first_scan": cpu[0],
                "ready": ready,
                "mean": float(times.mean()),
                "p99": float(np.quantile(times, 0.99)),
                "slowest": max(cpu[1:]),
                "memory": memory,
            }
        )
    )


if __name__ == "__main__":
    main()
