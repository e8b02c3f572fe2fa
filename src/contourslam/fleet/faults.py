"""What robots told that cannot be used, and what went wrong with it: kept for people, the newest last."""

import threading
from dataclasses import dataclass

MOST = 1000


@dataclass(frozen=True, slots=True)
class Fault:
    """Something that a robot told and that cannot be used, or that was wrong with what was kept.

    Attributes
    ----------
    robot : str
        Empty for what was kept.
    run : int
    text : str
        What, and what was done about it.
    """

    robot: str
    run: int
    text: str


class Faults:
    """The newest faults, each once; from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: dict[Fault, None] = {}

    def note(self, text: str, robot: str = "", run: int = 0) -> None:
        """Take in what is wrong."""
        fault = Fault(robot, run, text)
        with self._lock:
            self._kept.pop(fault, None)
            self._kept[fault] = None
            if len(self._kept) > MOST:
                del self._kept[next(iter(self._kept))]

    def all(self) -> tuple[Fault, ...]:
        """Give them, the newest last."""
        with self._lock:
            return tuple(self._kept)


def briefly(error: Exception) -> str:
    """Give an error of the mathematics beneath, of any length, in a part of a line."""
    return " ".join(str(error).split())[:200]
