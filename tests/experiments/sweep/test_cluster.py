"""A real Dask scheduler and real workers, processes of their own, that are killed: no row is lost or doubled."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from contourslam.experiments.sweep import engine
from contourslam.experiments.sweep.store import Store, read_results

BIN = Path(sys.executable).parent
ENVIRONMENT = os.environ | {
    "NUMBA_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "DASK_DISTRIBUTED__LOGGING__DISTRIBUTED": "critical",
}
LIMIT = 120.0  # s


def wait_for(what: Callable[[], bool], process: subprocess.Popen | None = None) -> None:
    """Wait until something holds; a process that must live meanwhile is watched."""
    until = time.monotonic() + LIMIT
    while not what():
        assert time.monotonic() < until, "it never came"
        assert process is None or process.poll() is None, "it ended early"
        time.sleep(0.02)


class Cluster:
    """A scheduler and workers, each a process of its own."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._made = 0
        self.scheduler = self._start_scheduler()
        self.workers: list[subprocess.Popen] = []

    def _start(self, *words: str) -> subprocess.Popen:
        self._made += 1
        with (self._folder / f"process_{self._made}.txt").open("w") as log:
            return subprocess.Popen([BIN / "dask", *words], stdout=log, stderr=log, env=ENVIRONMENT, cwd=self._folder)

    def _start_scheduler(self) -> subprocess.Popen:
        address = self._folder / "scheduler.json"
        address.unlink(missing_ok=True)
        started = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(address)
        )
        wait_for(lambda: address.exists() and address.read_text().endswith("}"), started)
        self.address = json.loads(address.read_text())["address"]
        return started

    def add_worker(self, *words: str) -> None:
        """Start one more worker, without a nanny that would start it again."""
        plain = ("worker", self.address, "--no-nanny", "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1")
        self.workers.append(self._start(*plain, *words))

    def kill_worker(self, which: int) -> None:
        """Kill a worker as the system does where memory runs out."""
        worker = self.workers.pop(which)
        worker.kill()
        worker.wait()

    def restart_scheduler(self) -> None:
        """Kill the scheduler, wait until its workers have gone, and start another."""
        self.scheduler.kill()
        self.scheduler.wait()
        for worker in self.workers:
            worker.wait(LIMIT)
        self.workers.clear()
        self.scheduler = self._start_scheduler()

    def close(self) -> None:
        """End every process."""
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    found = Cluster(tmp_path)
    yield found
    found.close()


def experiment(folder: Path, runs: int, **own: str) -> Path:
    """An experiment of so many short runs of two drives, and of one more for each detector of one's own."""
    path = folder / "experiment.toml"
    noise = [round(0.001 * i, 3) for i in range(runs // 4)]
    places = "\n".join(f'{name} = "{place}"' for name, place in own.items())
    path.write_text(
        f'name = "killed"\ndetectors = ["wu", "matched_filter"]\n[own_detectors]\n{places}\n'
        f'[simulation]\nrooms = "furnished_room"\nduration = 1.0\nseeds = 2\n[[sweep]]\nnoise = {noise}\n'
        + "".join(f'[[sweep]]\ndetectors = "{name}"\nseeds = 1\n' for name in own)
    )
    return path


@pytest.fixture
def command(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen]]:
    """Starts a sweep, in which warnings are errors."""
    started: list[subprocess.Popen] = []

    def start(path: Path, results: Path, *words: str) -> subprocess.Popen:
        line = [sys.executable, "-W", "error", "-m", "contourslam", "sweep", path, "-o", results, "--json", *words]
        with (tmp_path / "said").open("w") as out, (tmp_path / "complained").open("w") as complaints:
            started.append(
                subprocess.Popen(line, stdout=out, stderr=complaints, env=ENVIRONMENT, start_new_session=True)
            )
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.wait()


def ended(process: subprocess.Popen, folder: Path) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of the latest sweep."""
    code = process.wait(LIMIT)
    return code, (folder / "said").read_text(), (folder / "complained").read_text()


def rows(results: Path) -> int:
    return len(list(results.glob("parts/*.done.parquet")))


def test_a_scheduler_and_a_worker_that_are_killed_lose_no_row_double_none_and_repeat_no_finished_run(
    cluster, command, tmp_path
):
    path, results = experiment(tmp_path, 40), tmp_path / "results"
    cluster.add_worker()
    sweep = command(path, results, "--scheduler", cluster.address)
    wait_for(lambda: rows(results) >= 6, sweep)
    cluster.restart_scheduler()
    code, _, complaint = ended(sweep, tmp_path)
    assert code == 1
    assert complaint.splitlines()[1:] == [f"contourslam: error: {engine._LOST}"]
    store = Store(str(results))
    finished, before = store.status(), store.starts()
    assert 6 <= len(finished) < 30
    cluster.add_worker()
    cluster.add_worker()
    sweep = command(path, results, "--scheduler", cluster.address)
    wait_for(lambda: rows(results) > len(finished) + 3, sweep)
    cluster.kill_worker(random.Random(7).randrange(2))
    code, said, complaint = ended(sweep, tmp_path)
    assert code == 0, complaint
    assert json.loads(said) | {"done": 40, "now": 40 - len(finished), "complete": True} == json.loads(said)
    after = store.starts()
    assert {key: after[key] for key in finished} == {key: before[key] for key in finished}
    # No more was begun again than what the killed had in hand.
    assert len(after) == 40 and sum(after.values()) <= 42
    table = read_results(str(results))
    assert table.num_rows == len(set(table.column("key").to_pylist())) == 40
    assert set(table.column("status").to_pylist()) == {"done"}


def test_the_whole_command_killed_goes_on_where_it_was_and_a_run_that_kills_its_worker_becomes_a_row(command, tmp_path):
    (tmp_path / "deadly.py").write_text("import os\n\n\ndef Deadly(adapted):\n    os.kill(os.getpid(), 9)\n")
    path, results = experiment(tmp_path, 12, deadly="deadly.py:Deadly"), tmp_path / "results"
    sweep = command(path, results, "--jobs", "1")
    wait_for(lambda: rows(results) >= 3, sweep)
    sweep.kill()  # its scheduler is a part of it, and its workers end without it
    sweep.wait()
    finished = Store(str(results)).status()
    before = Store(str(results)).starts()
    code, said, complaint = ended(command(path, results, "--jobs", "1"), tmp_path)
    found = json.loads(said)
    assert (code, found["done"], found["complete"]) == (1, 12, True), complaint
    assert [(failed["run"], failed["error_type"]) for failed in found["failed"]] == [
        ("deadly, default, furnished_room, seed 0, noise 0.01 m, 500 beams", "WorkerDiedError")
    ]
    after = Store(str(results)).starts()
    assert {key: after[key] for key in finished} == {key: before[key] for key in finished}


def test_ctrl_c_lets_the_runs_at_hand_end_and_keeps_what_is_done(command, tmp_path):
    path, results = experiment(tmp_path, 40), tmp_path / "results"
    sweep = command(path, results, "--jobs", "1")
    wait_for(lambda: rows(results) >= 2, sweep)
    os.killpg(sweep.pid, signal.SIGINT)  # as a terminal sends it, to the workers too
    code, said, complaint = ended(sweep, tmp_path)
    assert code == 130
    assert complaint.endswith("interrupted; what is done is kept, and the same command goes on from there\n")
    store = Store(str(results))
    assert json.loads(said)["done"] == len(store.status()) < 40
    assert store.starts() == dict.fromkeys(store.status(), 1)


def test_a_worker_of_another_version_is_refused_before_anything_is_run(cluster, command, tmp_path):
    (tmp_path / "other.py").write_text(
        "from contourslam.experiments.sweep import versions\n\n\n"
        "def dask_setup(worker):\n    versions.program.__wrapped__.__code__ = (lambda: '0.0.0+other').__code__\n"
        "    versions.program.cache_clear()\n"
    )
    cluster.add_worker("--preload", str(tmp_path / "other.py"))
    results = tmp_path / "results"
    code, _, complaint = ended(command(experiment(tmp_path, 4), results, "--scheduler", cluster.address), tmp_path)
    assert code == 1
    assert "has contourslam 0.0.0+other and the sweep was started with" in complaint
    assert len(complaint.splitlines()) == 2
    assert complaint.startswith(f"contourslam: connecting to {cluster.address}\n")
    assert Store(str(results)).starts() == {}
