"""Seconds from the shell to the answer of ``contourslam --help``, and what the interpreter alone takes."""

import subprocess
import sys
import time

from table import Table, publish

RUNS = 10


def seconds(*arguments: str) -> float:
    """Median of some runs, after one that fills the disk's cache."""
    times = []
    for _ in range(RUNS + 1):
        start = time.perf_counter()
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
        times.append(time.perf_counter() - start)
    return sorted(times[1:])[RUNS // 2]


def main() -> None:
    rows = [
        ["contourslam --help", seconds("-m", "contourslam", "--help"), "0.3"],
        ["contourslam run --help", seconds("-m", "contourslam", "run", "--help"), ""],
        ["python -c pass", seconds("-c", "pass"), ""],
    ]
    publish(Table("startup", ["command", "median, s", "target, s"], rows))


if __name__ == "__main__":
    main()
