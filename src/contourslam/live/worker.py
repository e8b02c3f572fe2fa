"""A thread that maps while messages come in."""

import threading
from collections.abc import Callable
from typing import Protocol

from contourslam.live.session import Processed, Session
from contourslam.scan import LaserScan, Odometry

LONGEST = 1.0  # s between two looks, for what must be saved
OVERDUE = 5.0  # s after which what can wait is done although scans wait


class Onlooker(Protocol):
    """Who watches the mapping. It works in the mapping's own thread, so it must be quick, and it may raise nothing."""

    def take(self, processed: Processed) -> None:
        """Take in what a scan gave; it has been handed on by then."""

    def rest(self) -> None:
        """Do what can wait: no scan does. Called at least every second in which none comes, and some where many do."""


class Worker:
    """A session with its own thread: push from anywhere, results are handed to a callable in the thread.

    Parameters
    ----------
    session : Session
    done : callable
        Called with each result, in the worker's thread.
    clock : callable
        What the session's `now` comes from: ``time.monotonic``.
    failed : callable
        Called in the worker's thread with an error that is not a known failure, with which the work ends.
    onlooker : Onlooker, optional
    """

    def __init__(
        self,
        session: Session,
        done: Callable[[Processed], None],
        *,
        clock: Callable[[], float],
        failed: Callable[[BaseException], None],
        onlooker: Onlooker | None = None,
    ) -> None:
        self._session, self._done, self._clock, self._failed = session, done, clock, failed
        self._onlooker = onlooker
        self._news = threading.Event()
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="contourslam", daemon=True)

    def push_odometry(self, odometry: Odometry) -> None:
        """Hand on one reading; returns at once."""
        self._session.push_odometry(odometry, self._clock())
        self._news.set()

    def push_scan(self, scan: LaserScan) -> None:
        """Hand on one scan; returns at once."""
        self._session.push_scan(scan, self._clock())
        self._news.set()

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread once its current scan is done, and close the session."""
        self._ending.set()
        self._news.set()
        if self._thread.is_alive():
            self._thread.join()
        self._session.close()

    def _run(self) -> None:
        rested = self._clock()
        try:
            while not self._ending.is_set():
                due = self._session.due(self._clock())
                if due is None or due > 0.0:
                    self._news.wait(LONGEST if due is None else min(due, LONGEST))
                self._news.clear()
                # One at a time, so that a pose does not wait for the scans that queue behind it.
                mapped = self._session.poll(self._clock(), at_most=1)
                for processed in mapped:
                    self._done(processed)
                if self._onlooker is not None:
                    for processed in mapped:
                        self._onlooker.take(processed)
                    now = self._clock()
                    waits = self._session.due(now) is not None  # a scan, be it for odometry, or somebody for the map
                    if not waits or now > rested + OVERDUE:
                        self._onlooker.rest()
                        rested = self._clock()
        except BaseException as error:  # nobody else hears of it in a thread
            self._failed(error)
