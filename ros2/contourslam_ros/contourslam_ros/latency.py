"""Time from a scan's coming to its pose's going, as the node itself sees it."""

import threading
from collections import deque

import numpy as np

from contourslam.live.diagnostics import Diagnostic, Level

KEPT = 1000


class Latencies:
    """The last latencies; may be added to from another thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: deque[float] = deque(maxlen=KEPT)

    def add(self, seconds: float) -> None:
        """Add one, s."""
        with self._lock:
            self._kept.append(seconds)

    def diagnostic(self) -> Diagnostic:
        """Say how long it took, from the middleware's having the scan to the pose handed to it."""
        with self._lock:
            kept = np.array(self._kept)
        if not len(kept):
            return Diagnostic(Level.OK, "publication", "no pose has been published yet")
        half, most, worst = np.percentile(kept, [50, 99, 100]) * 1e3
        values = {
            "scans": str(len(kept)),
            "median (ms)": f"{half:.2f}",
            "99th percentile (ms)": f"{most:.2f}",
            "longest (ms)": f"{worst:.2f}",
        }
        return Diagnostic(Level.OK, "publication", f"from scan received to pose published {half:.1f} ms", values)
