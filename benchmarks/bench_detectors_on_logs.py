"""Relation error of the EKF on real logs, for each detector, corners only and with walls, beside raw odometry.

See logs.py for where logs are looked for; one without relations is only replayed.
"""

import sys
import time
from dataclasses import replace

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.replay import replay
from logs import Log, find_logs
from table import Table, publish


def rows_of(log: Log) -> list[list[object]]:
    """Replay one log through every detector."""
    raw = log.relation_errors(log.odometry)
    rows: list[list[object]] = []
    for name in DETECTORS:
        for walls in (False, True):
            config = Config(detector=name)
            config = replace(config, slam=replace(config.slam, walls=walls))
            start = time.perf_counter()
            result = replay(log.messages, config, lidar_mount=log.recording.lidar_mount)
            elapsed = time.perf_counter() - start
            error = log.relation_errors((result.stamps, result.poses))
            rows.append(
                [
                    log.name,
                    name,
                    "with walls" if walls else "corners only",
                    error.translation_summary.mean if error else "-",
                    error.translation_summary.median if error else "-",
                    raw.translation_summary.mean if raw else "-",
                    "yes" if result.complete else "NO",
                    len(result.stamps) / elapsed,
                ]
            )
            print(*rows[-1], file=sys.stderr)
    return rows


def main() -> None:
    rows = [row for log in find_logs() for row in rows_of(log)]
    columns = ["log", "detector", "landmarks", "mean, m", "median, m", "raw odometry, m", "finished", "scans/s"]
    if rows:
        publish(Table("detectors_on_logs", columns, rows))


if __name__ == "__main__":
    main()
