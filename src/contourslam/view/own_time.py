"""CPU time of one task among many in a thread."""

import time
import types
from collections.abc import Callable, Coroutine, Generator
from functools import partial
from typing import Any


@types.coroutine
def counted(
    work: Coroutine[Any, Any, None], count: Callable[[float], None], clock: Callable[[], float] = time.thread_time
) -> Generator[Any, Any, None]:
    """Await some work, and count what its own steps take, not what other tasks do while it waits.

    Parameters
    ----------
    work : coroutine
    count : callable
        Called after each step with its CPU time, s.
    clock : callable
        That of the thread, s.
    """
    step: Callable[[], Any] = partial(work.send, None)
    while True:
        began = clock()
        try:
            awaited = step()
        except StopIteration:
            return
        finally:
            count(clock() - began)
        try:
            yield awaited
        except BaseException as error:  # it is the work's own: a cancellation, say
            step = partial(work.throw, error)
        else:
            step = partial(work.send, None)
