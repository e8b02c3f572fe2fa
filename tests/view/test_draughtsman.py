"""When maps are drawn."""

import numpy as np

from contourslam.view.draughtsman import LONGEST, REST, Draughtsman
from contourslam.view.memory import Memory


class DearLane:
    """One whose map takes long to draw, on a clock of its own."""

    at_rest = True

    def __init__(self, took: float) -> None:
        self.now, self.took, self.drawn = 0.0, took, 0

    def draw(self, knots):
        self.now += self.took
        self.drawn += 1
        return {"corner_ids": np.zeros(0, np.int32)}


def test_a_map_that_takes_long_is_drawn_as_seldom_as_that_asks_for() -> None:
    lane = DearLane(0.3)
    draughtsman = Draughtsman([lane], Memory(1), lambda: lane.now)  # type: ignore[list-item] # as much as is asked for
    drawn_at = []
    while lane.now < 60.0:
        draughtsman.want(0, False, True)
        if draughtsman.work(lane.now, idle=False):
            drawn_at.append(lane.now)
        lane.now += 0.01
    pauses = np.diff(drawn_at) - lane.took
    assert abs(pauses[0] - REST * LONGEST) < 0.02  # the first one waits for kernels
    assert (abs(pauses[1:] - REST * 0.3) < 0.02).all() and len(pauses) == 5
