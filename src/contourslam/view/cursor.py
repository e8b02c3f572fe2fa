"""Which moment a page looks at: the newest, or an earlier one that moves on as time does."""

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
        That of all pages; None where nobody sets one, as of a robot: then the page has one of its own, and whoever
        pauses holds nothing but what the page shows.

    Attributes
    ----------
    at : float or None
        Time that is looked at, s; None for the newest, whatever comes.
    pace : Pace
    """

    def __init__(self, memory: Memory, pace: Pace | None) -> None:
        self._memory, self._shared = memory, pace is not None
        self.pace = Pace() if pace is None else pace
        self.at: float | None = None

    def moment(self) -> Moment | None:
        """Give the moment that is looked at; None before the first."""
        return self._memory.newest if self.at is None else self._memory.at(self.at)

    def advance(self, seconds: float) -> None:
        """Let so much time go by."""
        newest = self._memory.newest
        if self.at is None or newest is None or self.pace.paused:
            return
        speed = self.pace.speed
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
        newest = self._memory.newest
        if request.do == "follow":
            self._follow()
        elif request.do == "seek":
            self._seek(request.value, newest, ended=ended)
        elif request.do == "step" and newest is not None:
            self._step(int(request.value), newest)
        elif request.do == "pause":
            self._pause(newest)
        elif request.do == "play":
            if ended and (self.at is None or (newest is not None and self.at >= newest.elapsed)):
                self.at = 0.0
            self.pace.play()
        elif request.do == "speed":
            self.pace.set_speed(request.value)

    def _follow(self) -> None:
        self.at = None
        if not self._shared:
            self.pace.play()

    def _pause(self, newest: Moment | None) -> None:
        self.pace.pause()
        if not self._shared and self.at is None and newest is not None:
            self.at = newest.elapsed

    def _seek(self, time: float, newest: Moment | None, *, ended: bool) -> None:
        if newest is not None and time < newest.elapsed:
            self.at = max(time, 0.0)
        elif not self._shared:
            self._follow()
        else:
            self.at = None
            if not ended:
                self.pace.hurry(time)

    def _step(self, by: int, newest: Moment) -> None:
        looked_at = self.moment() or newest
        self.pace.pause()
        if self._shared and by > 0 and looked_at.index == newest.index:
            self.at = None
            for _ in range(by):
                self.pace.step()
            return
        then = self._memory.beside(looked_at, by)
        self.at = None if self._shared and then.index == newest.index else then.elapsed
