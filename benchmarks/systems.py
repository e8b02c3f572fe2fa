"""The systems that are run over the logs, each in a process of its own: ours by its command, peers by their runners.

Every system leaves ``trajectory.tum`` in its folder under out/logs, with whatever else it writes.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

from logs import Log
from measure import measured
from peer import run_peer
from table import ROOT

CONTOURSLAM = (sys.executable, "-m", "contourslam")


@dataclass(frozen=True)
class Cost:
    """What a system cost.

    Attributes
    ----------
    cpu_seconds : float
        Of the whole process: loading libraries and the log, mapping, writing.
    mapping_seconds : float
        CPU time of the mapping alone.
    peak_bytes : int
        Largest memory of the process.
    map_bytes : int or None
        Size of the map on disk, where the system keeps one.
    """

    cpu_seconds: float
    mapping_seconds: float
    peak_bytes: int
    map_bytes: int | None


System = Callable[[Log, Path], Cost]


@cache
def systems() -> dict[str, System]:
    """Give the systems by name: each runs over a log and leaves what it found in a folder."""
    options: dict[str, tuple[str, ...]] = {"EKF": ()}
    helped = subprocess.run([*CONTOURSLAM, "run", "--help"], capture_output=True, text=True, check=True).stdout
    if "--back-end" in helped:
        options = {"EKF": ("--back-end", "ekf"), "graph": ("--back-end", "graph")}
    peers = {"small_gicp": "small_gicp", "kiss-icp": "kiss_icp", "yag-slam": "yag_slam"}
    ours: dict[str, System] = {f"contourslam, {name}": partial(_ours, words) for name, words in options.items()}
    return ours | {name: partial(_peer, module) for name, module in peers.items()}


def _ours(options: tuple[str, ...], log: Log, folder: Path) -> Cost:
    relations = ("--relations", str(log.relations)) if log.relations else ()
    words = [*CONTOURSLAM, "run", str(log.path), *relations, *options, "-o", str(folder), "--overwrite", "--json"]
    for _ in range(3):
        compiled = _compiled()
        cpu_seconds, peak = measured(words, folder)
        if _compiled() == compiled:  # compiling is no part of what a run costs: one that had to is repeated
            break
    stages = json.loads((folder / "metrics.json").read_text())["seconds"]
    return Cost(cpu_seconds, sum(stages.values()), peak, (folder / "map.geojson").stat().st_size)


def _compiled() -> set[Path]:
    """Find the kernels that Numba keeps on disk."""
    place = os.environ.get("NUMBA_CACHE_DIR")
    return set((Path(place) if place else ROOT / "src").rglob("*.nbc"))


def _peer(name: str, log: Log, folder: Path) -> Cost:
    cpu_seconds, mapping_seconds, peak = run_peer(name, log, folder)
    kept = folder / "map"
    return Cost(cpu_seconds, mapping_seconds, peak, kept.stat().st_size if kept.exists() else None)
