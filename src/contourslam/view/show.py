"""What a server shows: all that the pages need, and nothing of where it comes from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from contourslam.view.memory import Memory
from contourslam.view.pace import Pace
from contourslam.view.painter import Painter


@dataclass(frozen=True, slots=True)
class Show:
    """A replay, or a robot that is driving.

    Attributes
    ----------
    about : mapping
        What pages are told at first, and again where the memory forgets: title, lanes, length.
    memory : Memory
    painter : Painter
    pace : Pace or None
        Lets pages pause, step and choose the speed; None where nobody can, as of a robot that is driving.
    status : callable
        Gives how all is, as plain values; called from the server's thread.
    story : callable
        Given a lane and a landmark, gives its life.
    """

    about: Mapping[str, Any]
    memory: Memory
    painter: Painter
    pace: Pace | None
    status: Callable[[], Mapping[str, Any]]
    story: Callable[[int, int], Mapping[str, Any]]
