"""A sweep on Dask: processes of this machine, or the workers of a cluster."""

import contextlib
import logging
import math
import secrets
import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from multiprocessing import resource_tracker
from typing import Any

from contourslam.errors import ConfigError, ContourslamError
from contourslam.evaluation.extras import require
from contourslam.experiments.parallel import Observer, cores
from contourslam.experiments.sweep.reach import no_scheduler, reach
from contourslam.experiments.sweep.rows import DONE, FAILED
from contourslam.experiments.sweep.runs import Run
from contourslam.experiments.sweep.store import Store
from contourslam.experiments.sweep.tasks import TOPIC, Task, do_task, other_program, pieces, stop
from contourslam.experiments.sweep.versions import program

_POLL = 0.2  # s
_PATIENCE = 30.0  # s until a worker or a scheduler is there
_LOOK = 5.0  # s between looks at whether there are workers
_NO_PROGRESS = 5  # times a task is sent again without any run of it having been begun
_LOST = "the scheduler is gone; what is done is kept, and the same command goes on from there"
_PRELOAD = "contourslam.experiments.sweep.tasks"
_ONE_THREAD = {"NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a sweep did.

    Attributes
    ----------
    done, failed : int
        Runs that were done, and that failed, now.
    complete : bool
        False where it was stopped early.
    """

    done: int
    failed: int
    complete: bool


def sweep(
    runs: Sequence[Run],
    store: Store,
    *,
    jobs: int = 0,
    scheduler: str | None = None,
    observer: Observer | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> Outcome:
    """Do runs, each row kept as soon as it is there; afterwards the rows are one table.

    Parameters
    ----------
    runs : sequence of Run
        Those to do.
    store : Store
        One that every worker can reach.
    jobs : int
        Processes of this machine; 0 for one per core.
    scheduler : str, optional
        Address of a Dask scheduler whose workers are to do it in place of these.
    observer : Observer, optional
        Told the runs that are over, and may stop the sweep.
    say : callable
        Told what people should know of the workers.

    Returns
    -------
    Outcome

    Raises
    ------
    ContourslamError
        If no worker comes, one has another program, the scheduler is lost, or a row cannot be kept.
    MissingExtraError
        If Dask is not installed.
    """
    if not runs:
        return Outcome(0, 0, True)
    if store.url.startswith("memory:"):
        raise ConfigError(f"{store.url} is seen by one process alone; choose a folder or an object store")
    observer = observer or Observer()
    if scheduler is not None:
        say(f"connecting to {scheduler}")
        if not reach(scheduler, _PATIENCE, observer.stopped):
            return Outcome(0, 0, False)
    with _client(min(jobs or cores(), len(runs)), scheduler) as client:
        if observer.stopped():
            return Outcome(0, 0, False)
        threads = _check_workers(client, scheduler)
        return _Session(client, store, observer, say).do(pieces(runs, threads))


class _Session:
    """One sweep's conversation with the scheduler."""

    def __init__(self, client: Any, store: Store, observer: Observer, say: Callable[[str], None]) -> None:
        self._client, self._store, self._observer, self._say = client, store, observer, say
        self._name = secrets.token_hex(6)
        self._over: dict[str, str] = {}
        self._woken = threading.Event()
        self._sent = 0
        self._manned, self._look = True, time.monotonic() + _LOOK

    def do(self, todo: list[tuple[Run, ...]]) -> Outcome:
        """Have all pieces done, or as many as there are until it is stopped."""
        total = sum(map(len, todo))
        self._client.subscribe_topic(TOPIC, self._hear)
        waiting = {self._submit(runs): (runs, 0) for runs in todo}
        shown, until = -1, math.inf
        while waiting and time.monotonic() < until:
            self._woken.wait(_POLL)
            self._woken.clear()
            if until == math.inf and self._observer.stopped():
                # Each worker ends after the run it is at; what waits for a worker ends as soon as it comes to one.
                self._tell_stop()
                until = time.monotonic() + _PATIENCE
            for future in [future for future in waiting if future.done()]:
                runs, idle = waiting.pop(future)
                rest = self._settle(future, runs)
                if rest and until == math.inf:
                    idle = 0 if len(rest) < len(runs) else idle + 1
                    if idle > _NO_PROGRESS:
                        raise ContourslamError("the workers die before they begin; look at their logs")
                    waiting[self._submit(rest)] = rest, idle
            self._look_for_workers()
            if len(self._over) != shown:
                shown = len(self._over)
                self._observer.progress(shown, total)
        statuses = list(self._over.values())
        return Outcome(statuses.count(DONE), statuses.count(FAILED), shown == total)

    def _submit(self, runs: tuple[Run, ...]) -> Any:
        self._sent += 1
        task = Task(self._name, program(), self._store.url, runs)
        future = self._client.submit(do_task, task, key=f"contourslam-sweep-{self._name}-{self._sent}", pure=False)
        future.add_done_callback(lambda _: self._woken.set())
        return future

    def _look_for_workers(self) -> None:
        """Say once that nobody is there to work, and once that somebody is again."""
        if time.monotonic() < self._look:
            return
        self._look = time.monotonic() + _LOOK
        try:
            there = bool(self._client.sync(self._client.scheduler.ncores, callback_timeout=_LOOK))
        except (OSError, RuntimeError):  # of a scheduler that is gone, the futures tell
            return
        if there != self._manned:
            self._manned = there
            self._say("workers are there again" if there else "no worker is left; waiting for one to come")

    def _tell_stop(self) -> None:
        try:
            self._client.run(stop, self._name)
        except OSError as error:  # no connection, or a time-out
            raise ContourslamError(_LOST) from error

    def _settle(self, future: Any, runs: tuple[Run, ...]) -> tuple[Run, ...]:
        """Book what a task did, and give the runs that are to be sent again because their worker died."""
        status = future.status
        if status == "error":
            error = future.exception()
            if not isinstance(error, require("distributed", "sweep").KilledWorker):
                raise error
        elif status != "finished":
            raise ContourslamError(_LOST)
        # Not from what it told alone: an earlier try of the task, whose worker died, may have done a part.
        found = {run.key: self._over.get(run.key) or self._store.status_of(run.key) for run in runs}
        self._over |= {key: known for key, known in found.items() if known is not None}
        return tuple(run for run in runs if found[run.key] is None) if status == "error" else ()

    def _hear(self, event: tuple[float, dict[str, str]]) -> None:
        """Learn from a worker that a run is over, long before its task is."""
        _, message = event
        if message["session"] == self._name:
            self._over[message["key"]] = message["status"]
            self._woken.set()


@contextlib.contextmanager
def _client(jobs: int, scheduler: str | None) -> Iterator[Any]:
    """Connect to a scheduler, or start one with workers in processes of this machine that nobody else can reach."""
    distributed = require("distributed", "sweep")
    for name in ("distributed", "distributed.client", "distributed.core", "distributed.comm"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what ends a sweep, it says itself
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler, timeout=_PATIENCE, set_as_default=False)
        except Exception as error:
            raise no_scheduler(scheduler, error) from error
        try:
            yield client
        finally:
            _close(client)
        return
    # A nanny starts a worker that died again, and again; the cluster must not give it up meanwhile.
    require("dask", "sweep").config.set({"distributed.deploy.lost-worker-timeout": "1 day"})
    cluster = _deaf_to_ctrl_c(lambda: distributed.LocalCluster(
        n_workers=jobs, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL, env=_ONE_THREAD, preload=_PRELOAD,
    ))  # fmt: skip
    try:
        client = distributed.Client(cluster, set_as_default=False)
        try:
            yield client
        finally:
            _close(client)
    finally:
        cluster.close(timeout=_PATIENCE)


def _deaf_to_ctrl_c(start: Callable[[], Any]) -> Any:
    """Start processes that a terminal's Ctrl-C does not reach; it reaches this one alone, meanwhile too.

    A new process has the signal mask of the thread that starts it. So it is deaf from its first moment, and not only
    from where its preload is run.
    """
    resource_tracker.ensure_running()  # the first process would start it, and that takes the mask away
    started: Future[Any] = Future()

    def run() -> None:
        if hasattr(signal, "pthread_sigmask"):  # not on Windows
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            started.set_result(start())
        except BaseException as error:
            started.set_exception(error)

    # A thread that the process does not wait for: a second Ctrl-C ends at once.
    threading.Thread(target=run, daemon=True).start()
    return started.result()


def _close(client: Any) -> None:
    """Hang up; nothing is to be said about it, and nobody waits for a scheduler that is gone."""
    with contextlib.suppress(Exception):
        client.close(timeout=2.0)


def _check_workers(client: Any, scheduler: str | None) -> int:
    """Wait for workers, refuse those with another program, and count their threads."""
    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except TimeoutError as error:
        place = scheduler or "this machine"
        raise ContourslamError(
            f"{place} has no worker after {_PATIENCE:.0f} s; start one with `dask worker {place}`"
        ) from error
    try:
        versions = client.run(program)
    except (ImportError, AttributeError) as error:
        raise ContourslamError(
            f"a worker has no contourslam of this version ({error}); install the same there"
        ) from error
    for worker, version in versions.items():
        if version != program():
            raise ContourslamError(other_program(worker, version, program()))
    return sum(client.nthreads().values())
