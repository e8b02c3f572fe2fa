"""How far the pages are behind the mapping."""

from collections import deque
from typing import Any

import numpy as np

KEPT = 300  # frames, the newest


class Lag:
    """Learns from each frame that a page has drawn.

    Attributes
    ----------
    pages : int
        Open now.
    """

    def __init__(self) -> None:
        self._rows: deque[tuple[float, float]] = deque(maxlen=KEPT)
        self.pages = 0

    def count(self, on_the_way: float, waited: float) -> None:
        """Count a frame: from its sending to its drawing, and from its scan's pose to its sending, s."""
        self._rows.append((on_the_way, waited))

    def summary(self) -> dict[str, Any]:
        """Give the median and the greatest of both together, ms; null before the first frame."""
        if not self._rows:
            return {"median": None, "most": None}
        total = 1e3 * np.array(self._rows).sum(axis=1)
        return {"median": float(np.median(total)), "most": float(total.max())}
