"""What a robot has told of one run: kept so that it can be told again, and sent no faster than it may be."""

import math
from dataclasses import replace

from contourslam.errors import MessageError
from contourslam.fleet.facts import Answer, Status
from contourslam.fleet.wire import encode

WINDOW = 64  # reports that are sent beyond what the server has said that it has
PATIENCE = 2.0  # s after which a report that the server misses is sent again
OVERHEAD = 120  # bytes that a message costs beside its own: DDS, UDP and IP headers, a part of an acknowledgement


class Allowance:
    """Bytes that may be sent: so many a second, some seconds' worth at once; changed in place.

    Parameters
    ----------
    rate : float
        Bytes a second, `OVERHEAD` for each message included.
    saved : float
        s, for which what was not sent may be sent later.
    """

    def __init__(self, rate: float, saved: float = 4.0) -> None:
        self._rate, self._most = rate, rate * saved
        self._left, self._at = self._most, -math.inf

    def renew(self, now: float) -> None:
        """Let time pass."""
        if now > self._at:
            self._left = min(self._left + self._rate * (now - self._at), self._most)
            self._at = now

    @property
    def left(self) -> bool:
        """Whether anything may be sent; what a long message takes too much is paid off afterwards."""
        return self._left > 0.0

    def spend(self, size: int) -> None:
        """Take a message's bytes."""
        self._left -= size + OVERHEAD


class Outbox:
    """Reports of one run; changed in place.

    Attributes
    ----------
    run : int
    reports : list of bytes
        All, by their numbers; those that were acknowledged too, for a server that loses them.
    size : int
        Bytes of them.
    received : int
        As many the server has, as far as it said.
    status : Status or None
        Where the robot was last in this run.
    """

    def __init__(self, run: int) -> None:
        self.run = run
        self.reports: list[bytes] = []
        self.size = self.received = 0
        self.status: Status | None = None
        self._sent: list[float] = []  # when each was sent last
        self._missing: tuple[int, ...] = ()

    @property
    def settled(self) -> bool:
        """Whether the server has everything."""
        return self.received >= len(self.reports)

    def add(self, report: bytes) -> None:
        """Take in the next report."""
        self.reports.append(report)
        self.size += len(report)
        self._sent.append(-math.inf)

    def answered(self, answer: Answer) -> None:
        """Take in what the server has and misses; what it has lost it gets again."""
        self.received, self._missing = answer.received, answer.missing

    def news(self) -> bytes | None:
        """Give a status: by it the server sees what it misses, though no other report may come; None for none."""
        if self.status is None:
            return None
        try:
            return encode(replace(self.status, reports=len(self.reports)))
        except MessageError:  # a pose that is no number; the next one may be one
            return None

    def due(self, now: float, allowance: Allowance) -> list[bytes]:
        """Give the reports to be sent now, oldest first: those that the server misses, and those never sent."""
        out = []
        again = [n for n in self._missing if n < len(self._sent) and self._sent[n] <= now - PATIENCE]
        until = min(self.received + WINDOW, len(self.reports))
        new = [n for n in range(self.received, until) if self._sent[n] == -math.inf and n not in again]
        for number in sorted(again + new):
            if not allowance.left:
                break
            allowance.spend(len(self.reports[number]))
            self._sent[number] = now
            out.append(self.reports[number])
        return out
