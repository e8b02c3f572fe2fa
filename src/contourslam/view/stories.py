"""The life of each landmark while it is mapped: when it was seen, when it should have been, and how far it was off."""

import math
from collections import deque
from collections.abc import Iterable
from typing import Any

from contourslam.slam.result import ScanUpdate
from contourslam.view.moment import Sighting

KEPT = 200  # chances that are kept of each landmark, the newest
LANDMARKS = 2_000  # whose stories are kept, the newest
SEEN, MISSED, BORN = 1, 0, 2


class Stories:
    """Stories by landmark; changed in place by each scan. One thread writes while others read single stories."""

    def __init__(self) -> None:
        self._events: dict[int, deque[tuple[float, int, float, float]]] = {}

    def take(self, elapsed: float, update: ScanUpdate, look: Sighting | None) -> None:
        """Take in what a scan did to the landmarks; `look` where it looked for them."""
        if not (update.matched or update.missed or update.born):
            return
        off: dict[int, tuple[float, float]] = {}
        if look is not None:
            for i, number in enumerate(look.ids[: look.corners].tolist()):
                off[number] = (float(look.innovations[i, 0]), float(look.innovations[i, 1]))
        self._add(elapsed, update.born, BORN, {})
        self._add(elapsed, update.matched, SEEN, off)
        self._add(elapsed, update.missed, MISSED, {})

    def _add(self, elapsed: float, ids: Iterable[int], what: int, off: dict[int, tuple[float, float]]) -> None:
        for number in ids:
            events = self._events.get(number)
            if events is None:
                events = self._events[number] = deque(maxlen=KEPT)
                if len(self._events) > LANDMARKS:
                    self._events.pop(next(iter(self._events)))
            events.append((elapsed, what, *off.get(number, (math.nan, math.nan))))

    def story(self, number: int) -> dict[str, Any]:
        """Give one landmark's: of each chance the time, s; what came of it; and the innovation, m."""
        for _ in range(3):
            try:
                events = list(self._events.get(number, ()))
                break
            except RuntimeError:  # another thread has added one meanwhile
                continue
        else:
            events = []
        columns = list(zip(*events, strict=True)) or [(), (), (), ()]
        return {"times": columns[0], "what": columns[1], "dx": columns[2], "dy": columns[3]}
