"""How the server looks for joints: in charts that are never far behind, with sights that are bounded."""

import math

import numpy as np

from contourslam.fleet.common import CommonMap
from contourslam.fleet.facts import KeyframeFact, RelationFact
from contourslam.fleet.runs import Run
from contourslam.fleet.server_search import LAG, Search
from contourslam.joining.chart import WAY


def grow(run: Run, count: int) -> None:
    """Drive on along a corridor, 0.4 m a keyframe."""
    for number in range(len(run.keyframes), len(run.keyframes) + count):
        along = np.linspace(-3.0, 3.0, 12)
        walls = [np.column_stack([along, 0 * along + side, 0 * along, 0 * along - side]) for side in (-1.0, 1.0)]
        points = np.concatenate(walls).astype(np.float32)
        seen, where = np.zeros((0, 13), np.float32), np.array([0.4 * number, 0.0, 0.0])
        run.take(KeyframeFact(number, 0.5 * number, where, 0.0, points, seen))
        if number:
            moved = np.array([0.4, 0.0, 0.0])
            run.take(RelationFact(number - 1, number, moved, 1e4 * np.eye(3), math.nan, False))


def test_robots_that_meet_late_in_long_drives_are_looked_for_where_they_meet() -> None:
    far, near = Run("far", 1), Run("near", 1)
    there, here = CommonMap(1, [far]), CommonMap(2, [near])
    search, where = Search(), {far: there, near: here}
    grow(far, 300)
    there.advance()
    lacking = []
    for _ in range(10):
        grow(far, 5)
        there.advance()
        grow(near, 10)
        here.advance()
        search.hear(here, [there])
        while len(search):
            search.step(where)
            lacking.append(len(there) - len(search._draw(there).chart.frames))
    assert max(lacking) < LAG  # a tenth of it would be 30
    assert 0.4 * LAG < WAY
    assert lacking.count(0) > len(lacking) // 6  # and again and again nothing at all
