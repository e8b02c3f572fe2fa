"""How the server looks for joints: in charts that are never far behind, with sights that are bounded."""

import math

import numpy as np
import pytest

from contourslam.fleet import server_search
from contourslam.fleet.common import CommonMap
from contourslam.fleet.facts import KeyframeFact, RelationFact
from contourslam.fleet.runs import Run
from contourslam.fleet.server_search import CAREFUL, LAG, Search
from contourslam.joining.chart import WAY
from contourslam.joining.joint import Evidence, Joint, Tie
from contourslam.joining.verdict import hurdle


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


@pytest.mark.parametrize(("agreeing", "careful"), [(70.0, True), (40.0, False)])
def test_who_asks_again_and_again_joins_only_what_is_far_from_doubtful(
    monkeypatch: pytest.MonkeyPatch, agreeing: float, careful: bool
) -> None:
    runs = Run("one", 1), Run("other", 1)
    commons = tuple(CommonMap(number, [run]) for number, run in enumerate(runs, 1))
    for run, common in zip(runs, commons, strict=True):
        grow(run, 30)
        common.advance()
    evidence = Evidence(0, 10, agreeing, 0.0, 20.0, 0.3)
    assert hurdle(evidence) < 1.0  # two maps that are asked about once would be joined
    assert (hurdle(evidence) < CAREFUL) == careful
    found = Joint(np.zeros(3), (Tie(3, 4, np.zeros(3), 1e-4 * np.eye(3)),), evidence, "search")
    monkeypatch.setattr(server_search, "decide", lambda *_: found)
    joined = Search()._decide(*commons, [])
    assert (joined is not None) == careful
