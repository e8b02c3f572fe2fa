"""Whether a message is the next of its stream, and when time has run back."""

import math
from dataclasses import dataclass
from enum import Enum, auto

from contourslam.live.events import Source, TimeJump


class Verdict(Enum):
    """What a message is in its stream."""

    NEXT = auto()
    REPEATED = auto()
    OUT_OF_ORDER = auto()
    BEFORE_JUMP = auto()


@dataclass(slots=True)
class _Stream:
    newest: float = -math.inf
    epoch: int = 0
    strayed: float = math.nan


class Timeline:
    """The stamps of two streams whose clocks should be one; changed in place by every message.

    A message far behind the one before it is held for a stray. A second one that follows the stray, with none from the
    old time between them, shows that time ran back: two senders on one topic, or a wild stamp, do not. The other stream
    then follows with its first message that lies nearer to the new time than to its own old one.

    Parameters
    ----------
    jump_back : float
        Less than this is mere disorder, s.
    patience : float
        How long, on the caller's clock, the other stream may stay in the old time before it is taken to have a clock of
        its own, s.

    Attributes
    ----------
    jump : TimeJump or None
        What the last call of :meth:`judge` found.
    """

    def __init__(self, jump_back: float, patience: float) -> None:
        self._jump_back, self._patience = jump_back, patience
        self._streams: dict[Source, _Stream] = {"scan": _Stream(), "odometry": _Stream()}
        self._jumped_at = -math.inf
        self.jump: TimeJump | None = None

    def judge(self, source: Source, stamp: float, now: float) -> tuple[Verdict, float]:
        """Say what a message is, and how far it lies behind the newest of its stream, s.

        Parameters
        ----------
        source : "scan" or "odometry"
        stamp : float
            s.
        now : float
            On the caller's clock, s.
        """
        self.jump = None
        stream = self._streams[source]
        other = self._streams["odometry" if source == "scan" else "scan"]
        behind = stream.newest - stamp
        if stream.epoch < other.epoch:
            if abs(stamp - other.newest) <= max(abs(behind), self._jump_back):
                stream.newest, stream.epoch, stream.strayed = stamp, other.epoch, math.nan
                return Verdict.NEXT, 0.0
            if now - self._jumped_at <= self._patience:
                stream.newest = max(stream.newest, stamp)
                return Verdict.BEFORE_JUMP, stamp - other.newest
            stream.epoch = other.epoch
        if behind >= self._jump_back:
            if not stamp > stream.strayed:
                stream.strayed = stamp
                return Verdict.OUT_OF_ORDER, behind
            self.jump = TimeJump(source, stream.newest, stamp, now)
            self._jumped_at = now
            stream.newest, stream.epoch, stream.strayed = stamp, stream.epoch + 1, math.nan
            return Verdict.NEXT, 0.0
        stream.strayed = math.nan
        if behind > 0.0:
            return Verdict.OUT_OF_ORDER, behind
        if behind == 0.0:
            return Verdict.REPEATED, 0.0
        stream.newest = stamp
        return Verdict.NEXT, 0.0
