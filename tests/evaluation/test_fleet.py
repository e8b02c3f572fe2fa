"""When two robots have seen the same room."""

import numpy as np
import pytest

from contourslam.evaluation.fleet import ROOM, WAY, met

TIMES = np.linspace(0.0, 40.0, 401)


def straight(begin: float, speed: float, aside: float = 0.0) -> np.ndarray:
    return np.column_stack([begin + speed * TIMES, np.full(TIMES.size, aside), np.zeros(TIMES.size)])


def test_robots_that_come_towards_each_other_have_met_once_both_have_driven_the_way_between() -> None:
    here, there = straight(0.0, 1.0), straight(40.0, -1.0)
    # Each sees 3 m ahead of where it has been, so that what both know begins to grow 1.5 s before they pass at 20 s.
    expected = 20.0 - 0.25 * ROOM + 0.5 * WAY
    assert met(here, there, (TIMES, TIMES)) == pytest.approx(expected, abs=0.3)
    assert met(there, here, (TIMES, TIMES)) == pytest.approx(expected, abs=0.3)


def test_robots_that_pass_farther_away_or_stand_still_never_meet() -> None:
    here = straight(0.0, 1.0)
    assert met(here, straight(0.0, 1.0, ROOM), (TIMES, TIMES)) == np.inf
    assert met(straight(0.0, 0.0), straight(0.0, 0.0), (TIMES, TIMES)) == np.inf
