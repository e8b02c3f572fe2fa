"""Which moment a page looks at: the newest, or an earlier one that moves on while the replay goes on."""

import math

from contourslam.view.memory import Memory
from contourslam.view.moment import Moment
from contourslam.view.pace import Pace
from contourslam.view.requests import Request

AGAIN = 300.0  # times real time that is looked at again where the speed is "as fast as possible"


class Cursor:
    """Where a page is in time; changed in place.

    Parameters
    ----------
    memory : Memory
    pace : Pace or None

    Attributes
    ----------
    at : float or None
        Time that is looked at, s; None for the newest, whatever comes.
    """

    def __init__(self, memory: Memory, pace: Pace | None) -> None:
        self._memory, self._pace = memory, pace
        self.at: float | None = None

    def moment(self) -> Moment | None:
        """Give the moment that is looked at; None before the first."""
        return self._memory.newest if self.at is None else self._memory.at(self.at)

    def advance(self, seconds: float) -> None:
        """Let so much time go by."""
        newest = self._memory.newest
        if self.at is None or newest is None or (self._pace is not None and self._pace.paused):
            return
        speed = 1.0 if self._pace is None else self._pace.speed
        self.at += seconds * (AGAIN if math.isinf(speed) else speed)
        if self.at >= newest.elapsed:
            self.at = None

    def obey(self, request: Request, *, ended: bool) -> None:
        """Do what a page asks for, here and with the pace.

        Parameters
        ----------
        request : Request
            Others than those about time are passed over.
        ended : bool
            There will be no further moment: to play from the end is to begin again.
        """
        pace, newest = self._pace, self._memory.newest
        if request.do == "follow":
            self.at = None
        elif request.do == "seek":
            self._seek(request.value, newest, ended=ended)
        elif request.do == "step" and newest is not None:
            self._step(int(request.value), newest)
        elif pace is None:
            return
        elif request.do == "pause":
            pace.pause()
        elif request.do == "play":
            if ended and (self.at is None or (newest is not None and self.at >= newest.elapsed)):
                self.at = 0.0
            pace.play()
        elif request.do == "speed":
            pace.set_speed(request.value)

    def _seek(self, time: float, newest: Moment | None, *, ended: bool) -> None:
        if newest is not None and time < newest.elapsed:
            self.at = max(time, 0.0)
            return
        self.at = None
        if self._pace is not None and not ended:
            self._pace.hurry(time)

    def _step(self, by: int, newest: Moment) -> None:
        looked_at = self.moment() or newest
        if self._pace is not None:
            self._pace.pause()
            if by > 0 and looked_at.index == newest.index:
                self.at = None
                for _ in range(by):
                    self._pace.step()
                return
        then = self._memory.beside(looked_at, by)
        self.at = None if then.index == newest.index else then.elapsed
