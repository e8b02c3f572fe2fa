"""What happened to messages on their way to the map, as plain data."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from contourslam.scan import LaserScan, Odometry

Source = Literal["scan", "odometry"]


class Reason(StrEnum):
    """Why a message was not used, or a scan not as well as it could have been."""

    ODOMETRY_MISSING = "no odometry has ever come"
    ODOMETRY_STOPPED = "the odometry has stopped"
    ODOMETRY_LATE = "the odometry did not come in time"
    CLOCKS_DIFFER = "the odometry is stamped at another time"
    TOO_SLOW = "the map is not made as fast as scans come"
    OUT_OF_ORDER = "stamped before the one before"
    REPEATED = "stamped like the one before"
    REPLACED = "gave way to a later one with its stamp"
    BEFORE_JUMP = "from before time ran back"
    PAUSED = "paused"
    REFUSED = "not a valid message"
    FAILED = "could not be mapped"

    @property
    def loses(self) -> bool:
        """Whether the message is lost; else it was used without what is missing."""
        return self not in WITHOUT_ODOMETRY


WITHOUT_ODOMETRY = (
    Reason.ODOMETRY_MISSING, Reason.ODOMETRY_STOPPED, Reason.ODOMETRY_LATE, Reason.CLOCKS_DIFFER
)  # fmt: skip
"""Reasons for which a scan is mapped all the same, its motion guessed."""


@dataclass(frozen=True, slots=True)
class Incident:
    """One message that was not used, or a scan that was used without its odometry.

    Attributes
    ----------
    source : "scan" or "odometry"
    reason : Reason
    stamp : float
        Of the message, s; NaN where it had none.
    now : float
        On the caller's clock, s.
    delay : float
        By how much something was late, s: the odometry behind the scan's last beam, or silent; the stamp behind the one
        before it; for a scan that was dropped after it had waited, how long.
    detail : str
        What is wrong with it, where the reason does not say.
    """

    source: Source
    reason: Reason
    stamp: float
    now: float
    delay: float
    detail: str = ""

    @property
    def lost(self) -> bool:
        """Whether the message is lost."""
        return self.reason.loses

    @property
    def message(self) -> str:
        """One line for people."""
        done = "dropped" if self.lost else "mapped without odometry"
        by = (
            f" by {1e3 * self.delay:.0f} ms"
            if 0.0 < self.delay < 10.0
            else f" by {self.delay:.1f} s"
            if self.delay
            else ""
        )
        detail = f" ({self.detail})" if self.detail else ""
        return f"{self.source} at {self.stamp:.3f} s {done}: {self.reason.value}{by}{detail}"


@dataclass(frozen=True, slots=True)
class Released:
    """A scan whose turn it is; scans come out in the order of their stamps.

    Attributes
    ----------
    scan : LaserScan
    readings : tuple of Odometry
        What came since the scan before, ascending: to be pushed first.
    arrived, now : float
        When it came and when it was released, on the caller's clock, s.
    without : Incident or None
        Why it is released without odometry up to its last beam; None where it has it.
    """

    scan: LaserScan
    readings: tuple[Odometry, ...]
    arrived: float
    now: float
    without: Incident | None


@dataclass(frozen=True, slots=True)
class TimeJump:
    """Time ran back: a recording began again, a simulation was reset, or a clock was set.

    Attributes
    ----------
    source : "scan" or "odometry"
        Which of the two showed it first.
    before, after : float
        The newest stamp until then, and the first after, s.
    now : float
        On the caller's clock, s.
    """

    source: Source
    before: float
    after: float
    now: float
