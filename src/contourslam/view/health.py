"""How all is, as pages get it: asked twice a second however many pages there are, and told where it changes."""

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from contourslam.live.diagnostics import Diagnostic, Level

PERIOD = 0.5  # s
QUIET = 5.0  # s that something must be better until that is told: what comes and goes is told once
WORDS = {Level.OK: "ok", Level.WARN: "warning", Level.ERROR: "error"}


class Health:
    """Diagnostics, newest first asked; any thread may ask.

    Parameters
    ----------
    ask : callable
        Gives the diagnostics; it must not wait.
    tell : callable
        Called with "trouble" or "well", and a line, where something goes wrong, changes its kind, or is well again.
    clock : callable
    """

    def __init__(
        self,
        ask: Callable[[], Sequence[Diagnostic]],
        tell: Callable[[str, str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._ask, self._tell, self._clock = ask, tell, clock
        self._asking = threading.Lock()
        self._asked = -1e9
        self._known: tuple[Diagnostic, ...] = ()
        self._began: dict[str, Diagnostic] = {}  # of what is wrong, the words that it began with
        self._better: dict[str, float] = {}  # of what is wrong, since when it is less so, or not at all

    def look(self) -> tuple[Diagnostic, ...]:
        """Give how all is, half a second old at most."""
        if self._clock() >= self._asked + PERIOD and self._asking.acquire(blocking=False):
            try:
                self._known, self._asked = tuple(self._ask()), self._clock()
                self._compare()
            finally:
                self._asking.release()
        return self._known

    def rows(self) -> list[dict[str, Any]]:
        """Give it as plain values."""
        return [
            {"level": WORDS[d.level], "name": d.name, "message": d.message, "values": d.values} for d in self.look()
        ]

    @property
    def trouble(self) -> str:
        """What is wrong, in the words that it began with, for its figures change all the time; empty for nothing."""
        began = list(self._began.values())
        return "; ".join(d.message for d in began if d.level is Level.ERROR)

    def _compare(self) -> None:
        now = self._clock()
        for new in self._known:
            before = self._began.get(new.name)
            known = Level.OK if before is None else before.level
            if new.level >= known:
                self._better.pop(new.name, None)
            if new.level == known or (new.level < known and now < self._better.setdefault(new.name, now) + QUIET):
                continue
            self._better.pop(new.name, None)
            if new.level is Level.OK:
                del self._began[new.name]
                self._tell("well", f"{new.name}: well again")
            else:
                self._began[new.name] = new
                self._tell("trouble", f"{new.name}: {new.message}")
