"""Pieces of a sweep: runs that share a drive go to a worker together, which keeps the row of each once it is over.

What is in this module runs on the workers.
"""

import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import groupby, pairwise

from contourslam.errors import ContourslamError
from contourslam.experiments.sweep.rows import FAILED, done_row, failed_row
from contourslam.experiments.sweep.runs import Run
from contourslam.experiments.sweep.store import Store
from contourslam.experiments.sweep.versions import LIBRARIES, program

TRIES = 3
"""How often a run may end its worker before it counts as failed."""
TOPIC = "contourslam-sweep"
"""What workers tell of the runs that are over."""
_PIECES = 4  # per process, at least: else the last ones leave the others idle

_stopped: set[str] = set()


class WorkerDiedError(ContourslamError):
    """A run ended its worker again and again."""


@dataclass(frozen=True, slots=True)
class Task:
    """Some runs of one drive.

    Attributes
    ----------
    session : str
        Of the sweep that they are done for.
    program : str
        With which they were planned.
    url : str
        Where their rows go.
    runs : tuple of Run
    """

    session: str
    program: str
    url: str
    runs: tuple[Run, ...]


def pieces(runs: Sequence[Run], processes: int) -> list[tuple[Run, ...]]:
    """Make the runs of each drive a piece of work, or several where the drives are too few to keep all processes busy.

    A drive that is cut is simulated, or read, by each process that gets a part of it.

    Parameters
    ----------
    runs : sequence of Run
        Those of one drive side by side.
    processes : int

    Returns
    -------
    list of tuple of Run
    """
    drives = [sorted(group, key=lambda run: run.order) for _, group in groupby(runs, key=lambda run: run.drive.shared)]
    wanted = -(-_PIECES * processes // max(len(drives), 1))
    cut: list[tuple[Run, ...]] = []
    for together in drives:
        count = min(wanted, len(together))
        bounds = [round(i * len(together) / count) for i in range(count + 1)]
        cut += [tuple(together[a:b]) for a, b in pairwise(bounds)]
    return cut


def do_task(task: Task) -> None:
    """Do the runs of a task that are not done, one after the other.

    Parameters
    ----------
    task : Task

    Raises
    ------
    ContourslamError
        If this worker has another program than the sweep was planned with, or a row cannot be kept.
    """
    from distributed import get_worker

    worker = get_worker()
    if program() != task.program:
        raise ContourslamError(other_program(worker.address, program(), task.program))

    def tell(key: str, status: str) -> None:
        worker.log_event(TOPIC, {"session": task.session, "key": key, "status": status})

    do_runs(task, tell)


def do_runs(task: Task, tell: Callable[[str, str], None]) -> None:
    """Do as :func:`do_task`, in this process and without Dask.

    Parameters
    ----------
    task : Task
    tell : callable
        Called with key and status of each run that is over.
    """
    store = Store(task.url)
    for run in task.runs:
        if task.session in _stopped:
            break
        if store.status_of(run.key) is None:
            tell(run.key, _do(run, store, task.session))


def dask_setup(worker: object) -> None:
    """Leave Ctrl-C to the process that started this worker; Dask calls this as the worker starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def stop(session: str) -> None:
    """Have the tasks of a session end after the run that they are at."""
    _stopped.add(session)


def other_program(worker: str, its: str, ours: str) -> str:
    """Say that a worker runs another program than this one."""
    same = its.rpartition(".")[0] == ours.rpartition(".")[0]
    what = f"other libraries (of {', '.join(LIBRARIES)})" if same else f"contourslam {its}"
    return f"{worker} has {what} and the sweep was started with {ours}; install the same on both"


def _do(run: Run, store: Store, session: str) -> str:
    from contourslam.experiments.sweep.work import measure

    tries = store.begin(session, run.key)
    started, begun = datetime.now(UTC), time.perf_counter()
    if tries > TRIES:
        died = WorkerDiedError(f"its worker died {TRIES} times at it; was there enough memory?")
        store.write_row(failed_row(run, died, started=started, seconds=0.0, tries=TRIES))
        return FAILED
    try:
        metrics = measure(run)
    except Exception as error:  # whatever it is, it is this run's alone
        seconds = time.perf_counter() - begun
        store.write_row(failed_row(run, error, started=started, seconds=seconds, tries=tries))
        return FAILED
    seconds = time.perf_counter() - begun
    row = done_row(run, metrics, started=started, seconds=seconds, tries=tries)
    store.write_row(row)
    return str(row["status"])
