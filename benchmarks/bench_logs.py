"""Relation error of the filter on real logs, for each detector, corners only and with walls, beside raw odometry.

Logs are looked for in ../shared/data, or in the folder that the variable LOGS names; each folder in it that holds a log
(*.log.xz, *.clf.xz) and *.relations.xz is measured, a log without relations is only replayed.
"""

import os
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.evaluation.relations import relation_errors
from contourslam.recordings import open_recording, read_relations
from contourslam.scan import Odometry
from contourslam.slam import replay
from table import ROOT, Table, publish


def rows_of(folder: Path) -> list[list[object]]:
    """Replay one folder's log through every detector."""
    log = next(path for pattern in ("*.log*", "*.clf*") for path in folder.glob(pattern))
    recording = open_recording(log)
    messages = list(recording.messages())
    wheels = [message for message in messages if isinstance(message, Odometry)]
    odometry = np.array([o.stamp for o in wheels]), np.array([o.pose for o in wheels])
    relations = next((read_relations(path) for path in folder.glob("*.relations*")), None)
    raw = relation_errors(*odometry, *relations).translation_summary.mean if relations else None
    rows: list[list[object]] = []
    for name in DETECTORS:
        for walls in (False, True):
            config = Config(detector=name)
            config = replace(config, slam=replace(config.slam, walls=walls))
            start = time.perf_counter()
            result = replay(messages, config, lidar_mount=recording.lidar_mount)
            elapsed = time.perf_counter() - start
            error = relation_errors(result.stamps, result.poses, *relations, *odometry) if relations else None
            summary = error and error.translation_summary
            rows.append(
                [
                    folder.name,
                    name,
                    "with walls" if walls else "corners only",
                    summary.mean if summary else "-",
                    summary.median if summary else "-",
                    raw if raw is not None else "-",
                    "yes" if result.complete else "NO",
                    len(result.stamps) / elapsed,
                ]
            )
            print(*rows[-1], file=sys.stderr)
    return rows


def main() -> None:
    logs = Path(os.environ.get("LOGS", ROOT.parent / "shared" / "data"))
    folders = sorted({path.parent for pattern in ("*/*.log*", "*/*.clf*") for path in logs.glob(pattern)})
    if not folders:
        print(f"no logs in {logs}; name a folder of logs with LOGS=FOLDER")
        return
    rows = [row for folder in folders for row in rows_of(folder)]
    columns = ["log", "detector", "landmarks", "mean, m", "median, m", "raw odometry, m", "finished", "scans/s"]
    publish(Table("logs", columns, rows))


if __name__ == "__main__":
    main()
