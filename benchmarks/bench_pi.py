"""What a robot's computer pays: work per scan of 500 beams, memory of the whole process, start cold and warm.

Instructions are counted by valgrind, which a busy machine does not disturb; without it that column stays empty. The
estimates for a Raspberry Pi divide them by how many a second it is taken to do; nothing was run on one.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from contourslam.recordings.ros_encoding import Encoder
from contourslam.scan import LaserScan
from measure import measured
from run_all import ONE_CORE
from table import Table, publish

DRIVE = Path(__file__).with_name("pi_drive.py")
WHAT = {
    "ekf": "mapping, the paper's filter (corners)",
    "filter": "mapping, filter with walls and contour matching",
    "graph": "mapping, graph",
    "localize": "localising in the graph's map",
}
COUNTED = 100, 600  # scans; the instructions between are those of 500 scans
# Instructions a second of one core, assumed: a Pi 4 (Cortex-A72, 1.5 GHz) at one in two cycles, a Pi 5 (A76, 2.4 GHz)
# at one a cycle; this machine, busy with other work, did between a half and one and a half.
PI4, PI5 = 0.75e9, 2.4e9
MEMORY_TARGET = 250  # MB
# Code without AVX does about as many instructions as ARM's, and valgrind knows no AVX-512.
PLAIN = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}


def drive(folder: Path, what: str, cache: Path, *, scans: int | None = None) -> dict[str, Any]:
    """One process that maps or localises; with the largest memory of the whole of it."""
    words = [str(DRIVE), str(folder / "figures.json"), str(folder / "messages"), what, str(folder / "graph.map")]
    words += [] if scans is None else [str(scans)]
    _, peak = measured(["env", f"NUMBA_CACHE_DIR={cache}", sys.executable, *words], folder)
    found: dict[str, Any] = json.loads((folder / "figures.json").read_text())
    return found | {"peak_mb": peak / 1e6}


def instructions(folder: Path, what: str, cache: Path) -> float | None:
    """Per scan; None without valgrind."""
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        return None
    counts = []
    environment = os.environ | ONE_CORE | PLAIN | {"NUMBA_CACHE_DIR": str(cache)}
    tool = [valgrind, "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]
    for number, scans in enumerate((COUNTED[1], *COUNTED)):  # first without counting: nothing is then left to compile
        words = [str(DRIVE), str(folder / "figures.json"), str(folder / "messages"), what]
        words += [str(folder / "graph.map") if what == "localize" else "", str(scans)]
        command = [*(tool if number else []), sys.executable, *words]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        if number:
            (line,) = re.findall(r"I\s+refs:\s+([\d,]+)", done.stderr)
            counts.append(int(line.replace(",", "")))
    return (counts[1] - counts[0]) / (COUNTED[1] - COUNTED[0])


def warm_up(folder: Path, cache: Path, settings: dict[str, str]) -> tuple[float, float, int, float]:
    """CPU seconds and peak MB of ``contourslam warm-up`` with an empty cache; kernels; and the cache's size, MB."""
    environment = [f"{name}={value}" for name, value in {**settings, "NUMBA_CACHE_DIR": str(cache)}.items()]
    cpu, peak = measured(["env", *environment, sys.executable, "-m", "contourslam", "warm-up", "--json"], folder)
    kernels = json.loads((folder / "log.txt").read_text())["compiled"]
    size = sum(path.stat().st_size for path in cache.rglob("*") if path.is_file())
    return cpu, peak / 1e6, kernels, size / 1e6


def network() -> Table:
    """What drivers on the Pi send to a node elsewhere, as ROS 2 serialises it."""
    coder, beams = Encoder(), 500
    steps = np.arange(beams, dtype=np.float64)
    scan = coder.scan(LaserScan(1.0, 2 * np.pi / beams * steps, np.ones(beams), 2e-4 * steps, 0.12, 10.0), "lidar_link")
    sizes = {
        "scan, 500 beams, without intensities": (len(coder.serialize(scan)), 10),
        "scan, 500 beams, with intensities": (len(coder.serialize(scan)) + 4 * beams, 10),
        "odometry": (len(coder.serialize(coder.odometry(1.0, np.zeros(3), "odom", "base_link"))), 50),
    }
    rows = [[name, size, rate, 8e-3 * size * rate] for name, (size, rate) in sizes.items()]
    return Table("pi_network", ("message", "bytes", "a second", "kbit/s"), rows)


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run([sys.executable, str(DRIVE), "record", str(folder / "messages")], check=True)
        cold = drive(folder, "graph", folder / "cold", scans=COUNTED[0])
        native = warm_up(folder, folder / "native", {})
        plain = shutil.which("valgrind") is not None and warm_up(folder, folder / "plain", PLAIN)
        rows: list[list[object]] = []
        starts: list[list[object]] = [
            [f"contourslam warm-up ({native[2]} kernels, {native[3]:.0f} MB of cache)", native[0], "", "", native[1]],
            ["mapping, graph, cold", cold["ready"], cold["first_scan"], 1e3 * cold["slowest"], cold["peak_mb"]],
        ]
        worst = 0.0
        for what, title in WHAT.items():
            found = drive(folder, what, folder / "native")
            count = instructions(folder, what, folder / "plain") if plain else None
            estimates = ["", "", ""] if count is None else [count / 1e6, 1e3 * count / PI4, 1e3 * count / PI5]
            memory = found["memory"]
            rows.append(
                [title, 1e3 * found["mean"], 1e3 * found["p99"], *estimates, found["peak_mb"], memory["RssAnon"]]
            )
            worst = max(worst, found["peak_mb"])
            starts.append(
                [f"{title}, warm", found["ready"], found["first_scan"], 1e3 * found["slowest"], found["peak_mb"]]
            )
            print(*rows[-1], *starts[-1], sep=" | ", file=sys.stderr)
    costs = (
        *("live session", "CPU ms a scan", "99 %", "million instructions a scan", "Pi 4, ms, estimate"),
        *("Pi 5, ms, estimate", f"memory, MB (target {MEMORY_TARGET})", "of it not shared, MB"),
    )
    publish(Table("pi", costs, rows))
    columns = ("start", "CPU until the first pose, s", "first scan, CPU s", "slowest later scan, CPU ms", "memory, MB")
    publish(Table("pi_start", columns, starts))
    publish(network())
    if worst > MEMORY_TARGET:
        raise SystemExit(f"a live session takes {worst:.0f} MB, more than {MEMORY_TARGET}")


if __name__ == "__main__":
    main()
