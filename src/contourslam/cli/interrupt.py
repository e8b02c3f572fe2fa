"""Ctrl-C or `kill` ends the work between two items, not in the middle of one: what is done is whole and kept."""

import os
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from types import FrameType, TracebackType
from typing import Generic, Self, TypeVar

from contourslam.errors import ContourslamError

T = TypeVar("T")

INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 + SIGINT, as shells have it."""
_ASKING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Interrupt:
    """Inside this context Ctrl-C, `kill` or a closing terminal only ask to stop; Ctrl-C after that stops at once."""

    def __init__(self) -> None:
        self.requested = False

    def __enter__(self) -> Self:
        self._previous = {
            number: signal.signal(number, self._ask)
            for number in _ASKING
            if number == signal.SIGINT or signal.getsignal(number) is not signal.SIG_IGN  # as nohup wants it
        }
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, previous in self._previous.items():
            signal.signal(number, previous)

    def or_after(self, seconds: float | None) -> Callable[[], bool]:
        """Give what says whether to stop: after Ctrl-C, or once so many seconds from now are over; None for never."""
        until = None if seconds is None else time.monotonic() + seconds
        return lambda: self.requested or (until is not None and time.monotonic() > until)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.requested:
            if number == signal.SIGINT:  # a shell or a supervisor may send the others twice, and means it once
                raise KeyboardInterrupt
            return
        self.requested = True
        try:
            # Not print: a handler may run in the middle of another print.
            os.write(2, b"\ncontourslam: stopping, keeping what is done; Ctrl-C again stops at once\n")
            closed = number not in (signal.SIGINT, signal.SIGTERM) and os.isatty(2)
        except OSError:
            closed = True
        if closed:  # a word to a terminal that is no more would end the work in its middle
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


class UntilStopped(Generic[T]):
    """The messages of a recording until it ends or Ctrl-C is pressed; says afterwards why there were no more.

    Parameters
    ----------
    messages : iterable
        What is read.
    interrupt : Interrupt
        Asked before each message is handed on.

    Attributes
    ----------
    interrupted : bool
        Ctrl-C ended the reading.
    error : ContourslamError or None
        The damage that ended it.
    """

    def __init__(self, messages: Iterable[T], interrupt: Interrupt) -> None:
        self._messages = messages
        self._interrupt = interrupt
        self.interrupted = False
        self.error: ContourslamError | None = None

    def __iter__(self) -> Iterator[T]:
        try:
            for message in self._messages:
                if self._interrupt.requested:
                    self.interrupted = True
                    return
                yield message
        except ContourslamError as error:
            self.error = error
            raise
