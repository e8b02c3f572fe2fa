"""Real logs: raw odometry, this package and others that pip installs; accuracy, time, memory and size of the map.

Each system runs in a process of its own, with one setting for all logs; see systems.py, peers/ and, for where logs are
looked for, logs.py.
"""

import sys

import numpy as np

from contourslam.recordings import read_trajectory
from logs import Log, Track, find_logs
from measure import SystemFailedError
from systems import Cost, systems
from table import ROOT, Table, publish

COSTS = ["CPU, s", "of it mapping, s", "memory, MB", "map, kB"]
ONLINE = "trajectory_online.tum"


def rows_of(log: Log) -> list[list[object]]:
    """Run everything over one log."""
    rows = [[log.name, "raw odometry", *_accuracy(log, log.odometry), *["-"] * len(COSTS)]]
    for name, system in systems().items():
        folder = ROOT / "out" / "logs" / log.name / name.replace(", ", "_")
        folder.mkdir(parents=True, exist_ok=True)
        try:
            cost = system(log, folder)
        except SystemFailedError as error:
            rows.append([log.name, name, str(error), *["-"] * (len(rows[0]) - 3)])
            continue
        rows.append([log.name, name, *_accuracy(log, read_trajectory(folder / "trajectory.tum")), *_costs(cost)])
        if (folder / ONLINE).exists():
            online = _accuracy(log, read_trajectory(folder / ONLINE))
            rows.append([log.name, f"{name}, as known at the time", *online, *["″"] * len(COSTS)])
        print(*rows[-1], file=sys.stderr)
    return rows


def _accuracy(log: Log, track: Track) -> list[object]:
    """Give the columns of the table that the log belongs into."""
    errors, distance = log.relation_errors(track), log.distance(track)
    if errors is not None:
        moved = errors.translation_summary
        return [moved.mean, moved.median, float(np.degrees(errors.rotation_summary.mean))]
    return [distance.rmse, distance.max] if distance is not None else []


def _costs(cost: Cost) -> list[object]:
    size = "-" if cost.map_bytes is None else cost.map_bytes / 1e3
    return [cost.cpu_seconds, cost.mapping_seconds, cost.peak_bytes / 1e6, size]


def main() -> None:
    logs = find_logs()
    verified = [log for log in logs if log.relations]
    rough = [log for log in logs if log.reference and not log.relations]
    for name, chosen, columns in (
        ("logs", verified, ["mean, m", "median, m", "mean rotation, °"]),
        ("logs_rough", rough, ["RMS distance, m", "largest, m"]),
    ):
        rows = [row for log in chosen for row in rows_of(log)]
        if rows:
            publish(Table(name, ["log", "system", *columns, *COSTS], rows))


if __name__ == "__main__":
    main()
