"""A thread that maps while messages come in."""

from collections.abc import Callable

from contourslam.live.session import Processed, Session
from contourslam.scan import LaserScan, Odometry


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
    """

    def __init__(
        self,
        session: Session,
        done: Callable[[Processed], None],
        *,
        clock: Callable[[], float],
        failed: Callable[[BaseException], None],
    ) -> None:
        raise NotImplementedError

    def push_odometry(self, odometry: Odometry) -> None:
        """Hand on one reading; returns at once."""
        raise NotImplementedError

    def push_scan(self, scan: LaserScan) -> None:
        """Hand on one scan; returns at once."""
        raise NotImplementedError

    def start(self) -> None:
        """Start the thread."""
        raise NotImplementedError

    def stop(self) -> None:
        """End the thread once its current scan is done, and close the session."""
        raise NotImplementedError
