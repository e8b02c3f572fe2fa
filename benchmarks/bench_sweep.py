"""How much faster a sweep is on two processes than on one; and a sweep whose workers and scheduler are killed.

Both are of simulated drives. The second has a scheduler and two workers as processes of their own: workers are killed
at random moments, and halfway the scheduler too.
"""

import json
import os
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from contourslam.evaluation.extras import require
from contourslam.experiments.sweep.store import Store, read_results
from table import Table, publish

SPEED = """name = "speed"
[simulation]
rooms = "furnished_room"
noise = [0.0, 0.02]
seeds = 32
duration = 60.0
"""
KILLED = """name = "killed"
detectors = ["wu", "matched_filter"]
[simulation]
rooms = "furnished_room"
noise = [0.0, 0.01, 0.02, 0.03, 0.04]
beams = [180, 360]
seeds = 10
duration = 2.0
"""
RUNS, KILLS, SEED = 200, 10, 1
DASK = str(Path(sys.executable).with_name("dask"))
LIMIT = 300.0  # s


def sweep(folder: Path, text: str, *words: str) -> tuple[list[str], Path]:
    """Give the command of a sweep, and where its results go."""
    experiment, results = folder / "experiment.toml", folder / "results"
    folder.mkdir(exist_ok=True)
    experiment.write_text(text)
    command = [sys.executable, "-m", "contourslam", "sweep", str(experiment), "-o", str(results), "--json", *words]
    return command, results


def timed(folder: Path, processes: int) -> tuple[int, float]:
    """Runs that were done, and how long the whole command took, s."""
    command, _ = sweep(folder / str(processes), SPEED, "--jobs", str(processes))
    begun = time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
    return int(json.loads(done.stdout)["now"]), time.perf_counter() - begun


def until(what: Callable[[], bool]) -> None:
    """Wait for something."""
    end = time.monotonic() + LIMIT
    while not what():
        if time.monotonic() > end:
            raise SystemExit("it never came")
        time.sleep(0.02)


def until_rows(results: Path, count: int) -> None:
    """Wait for so many rows."""
    until(lambda: len(list(results.glob("parts/*"))) >= count)


class Cluster:
    """A scheduler and two workers with nannies, which start again those that are killed."""

    def __init__(self, folder: Path) -> None:
        self._log = (folder / "cluster.txt").open("a")
        place = folder / "scheduler.json"
        place.unlink(missing_ok=True)
        local = ("--host", "127.0.0.1", "--no-dashboard")
        self.scheduler = self._start("scheduler", *local, "--port", "0", "--scheduler-file", str(place))
        until(lambda: place.exists() and place.read_text().endswith("}"))
        self.address = str(json.loads(place.read_text())["address"])
        two = ("--nworkers", "2", "--nthreads", "1")
        self.nannies = self._start("worker", self.address, *local, *two)

    def _start(self, *words: str) -> "subprocess.Popen[bytes]":
        return subprocess.Popen([DASK, *words], stdout=self._log, stderr=self._log)

    def kill_a_worker(self, chance: random.Random) -> None:
        """Kill one of the workers that are connected."""
        with require("distributed", "sweep").Client(self.address, set_as_default=False) as client:
            os.kill(chance.choice(sorted(client.run(os.getpid).values())), 9)

    def close(self) -> None:
        """Kill the scheduler; the nannies end their workers and themselves."""
        self.scheduler.kill()
        self.scheduler.wait()
        self.nannies.terminate()
        self.nannies.wait()
        self._log.close()


def killed(folder: Path) -> list[list[object]]:
    """Sweep under fire, and count."""
    chance = random.Random(SEED)
    moments = sorted(chance.sample(range(5, RUNS - 15), KILLS))
    finished: dict[str, str] = {}
    before: dict[str, int] = {}
    results = folder / "results"
    for part in (moments[: KILLS // 2], moments[KILLS // 2 :]):
        cluster = Cluster(folder)
        command, results = sweep(folder, KILLED, "--scheduler", cluster.address)
        with (folder / "said.txt").open("a") as said:
            process = subprocess.Popen(command, stdout=said, stderr=said)
        for moment in part:
            until_rows(results, moment)
            cluster.kill_a_worker(chance)
        if not finished:  # the first half ends with the scheduler
            cluster.scheduler.kill()
            process.wait(LIMIT)
            cluster.close()
            finished, before = Store(str(results)).status(), Store(str(results)).starts()
        else:
            process.wait(LIMIT)
            cluster.close()
    keys = read_results(str(results)).column("key").to_pylist()
    statuses = read_results(str(results)).column("status").to_pylist()
    after = Store(str(results)).starts()
    repeated = sum(after[key] > before[key] for key in finished)
    return [
        ["workers killed", KILLS],
        ["runs", RUNS],
        ["rows", len(keys)],
        ["rows that are there twice", len(keys) - len(set(keys))],
        ["rows that failed", statuses.count("failed")],
        ["runs finished when the scheduler was killed", len(finished)],
        ["of these, begun again", repeated],
        ["runs begun, all together", sum(after.values())],
    ]


def main() -> None:
    with tempfile.TemporaryDirectory() as place:
        times = {processes: timed(Path(place), processes) for processes in (1, 2)}
        rows: list[list[object]] = [
            [processes, runs, seconds, runs / seconds, times[1][1] / seconds]
            for processes, (runs, seconds) in times.items()
        ]
        publish(Table("sweep", ["processes", "runs", "s", "runs a second", "times as fast as one"], rows))
        folder = Path(place) / "killed"
        folder.mkdir()
        publish(Table("sweep_killed", ["a sweep under fire", "count"], killed(folder)))


if __name__ == "__main__":
    main()
