"""Independent pieces of work on several processes, with progress, that can be stopped and keep what is done."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from contourslam.errors import ContourslamError

A = TypeVar("A")
B = TypeVar("B")

_POLL = 0.2  # s


def cores() -> int:
    """How many cores of the machine are lent to this process."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True, slots=True)
class Observer:
    """Who watches a long piece of work.

    Attributes
    ----------
    progress : callable
        Told the steps done and the steps in all, each time the first changes.
    stopped : callable
        Asked between steps whether to stop early and keep what is done.
    """

    progress: Callable[[int, int], None] = lambda done, total: None
    stopped: Callable[[], bool] = lambda: False


class Step(Protocol):
    """What a piece of work calls after each of its steps; false means: stop here and return what there is."""

    def __call__(self) -> bool:
        """Count one step, and tell whether to go on."""
        ...


def each(
    work: Callable[[A, Step], B], items: Sequence[A], *, steps: int, jobs: int, observer: Observer | None = None
) -> Iterator[B]:
    """Do a piece of work on each item and give the results in the order of the items.

    Ctrl-C, too, stops the work at the next step; what is done by then is given.

    Parameters
    ----------
    work : callable
        A function of its module (other processes must find it), called with an item and a `Step`.
    items : sequence
        What to work on.
    steps : int
        How many steps an item takes, for the progress.
    jobs : int
        Processes to use; 1 works in this one.
    observer : Observer, optional

    Yields
    ------
    result
        One per item begun; after a stop, those of later items are missing and the last may be incomplete.

    Raises
    ------
    ContourslamError
        If a process dies (most often: no memory left), or as `work` raises.
    """
    observer = observer or Observer()
    if min(jobs, len(items)) <= 1:
        yield from _in_turn(work, items, steps, observer)
    else:
        yield from _side_by_side(work, items, steps, min(jobs, len(items)), observer)


def _in_turn(work: Callable[[A, Step], B], items: Sequence[A], steps: int, observer: Observer) -> Iterator[B]:
    done = 0

    def step() -> bool:
        nonlocal done
        done += 1
        observer.progress(done, steps * len(items))
        return not observer.stopped()

    for item in items:
        if observer.stopped():
            return
        try:
            result = work(item, step)
        except KeyboardInterrupt:
            return
        yield result


def _side_by_side(
    work: Callable[[A, Step], B], items: Sequence[A], steps: int, jobs: int, observer: Observer
) -> Iterator[B]:
    # Spawn, not fork: the parent may run threads (Numba's, matplotlib's) that a forked child would find frozen.
    context = multiprocessing.get_context("spawn")
    counter, stop = context.Value("i", 0), context.Event()
    with ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=(counter, stop)) as pool:
        waiting: list[Future[B | None]] = [pool.submit(_one, work, item) for item in items]
        pending = set(waiting)
        told = 0
        try:
            while pending:
                try:
                    pending = wait(pending, timeout=_POLL, return_when=FIRST_COMPLETED).not_done
                except KeyboardInterrupt:  # the first one asks the workers to stop and hand in what they have
                    if stop.is_set():
                        raise
                    stop.set()
                if counter.value != told:
                    told = counter.value
                    observer.progress(told, steps * len(items))
                if observer.stopped():
                    stop.set()
            results = [future.result() for future in waiting]
        except BrokenProcessPool as error:
            raise ContourslamError("a worker process died; was there enough memory? Try fewer jobs") from error
        finally:
            stop.set()  # after an error the others end at their next step
            pool.shutdown(wait=True, cancel_futures=True)
    yield from (result for result in results if result is not None)


_counter: Any = None
_stop: Any = None


def _begin(counter: Any, stop: Any) -> None:
    """Set up a worker: the parent alone answers Ctrl-C, and tells the workers by the event."""
    global _counter, _stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _counter, _stop = counter, stop


def _step() -> bool:
    with _counter.get_lock():
        _counter.value += 1
    return not _stop.is_set()


def _one(work: Callable[[A, Step], B], item: A) -> B | None:
    return None if _stop.is_set() else work(item, _step)
