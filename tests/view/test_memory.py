import numpy as np
import pytest

from contourslam.view.knots import LANE_COLUMNS, Knot
from contourslam.view.memory import Memory
from contourslam.view.moment import Moment, Trace


def moment(index: int, points: int = 100) -> Moment:
    trace = Trace(np.zeros((points, 2), np.float32), np.array([0, points], np.int32), np.array([False]))
    return Moment(index, 0.1 * index, 0.0, trace, np.zeros(3), None, ())


def knot(index: int) -> Knot:
    return Knot(index, np.zeros(7, np.float32), np.zeros((1, LANE_COLUMNS), np.float32), np.zeros((3, 2), np.int16))


def test_every_moment_is_found_at_its_time() -> None:
    memory = Memory(1)
    assert memory.at(1.0) is None
    for i in range(50):
        memory.add(moment(i))
    assert [memory.at(t).index for t in (-1.0, 0.0, 0.1001, 2.549, 99.0)] == [0, 0, 1, 25, 49]
    at = memory.at(2.0)
    assert [memory.beside(at, by).index for by in (-100, -1, 1, 100)] == [0, at.index - 1, at.index + 1, 49]


def test_memory_stays_within_its_budget_and_keeps_the_whole_span() -> None:
    memory = Memory(1, moments=20_000)
    for i in range(5000):
        memory.add(moment(i))
        assert memory.newest.index == i
        assert sum(m.bytes for m in memory._moments) <= 20_000
    kept = [m.index for m in memory._moments]
    assert kept[0] == 0
    assert kept[-1] > 4000
    assert len(set(np.diff(kept))) == 1  # evenly
    assert memory.at(500.0).index == 4999


def test_maps_are_found_as_they_were_at_a_time_and_stay_within_their_budget() -> None:
    memory = Memory(2, maps=3000)
    for i in range(100):
        memory.add_map(0, float(i), i, bytes(100))
        memory.add_map(1, float(i), i, bytes(100))
        assert memory.map_at(0, 1e9).elapsed == i
    for lane in (0, 1):
        assert 20.0 < memory.map_at(lane, 50.0).elapsed <= 50.0
    assert memory.map_at(1, -1.0).elapsed < 20.0  # the first there is
    assert sum(len(m.message) for maps in memory._maps for m in maps) <= 3000


def test_where_knots_are_given_up_pages_are_told_to_ask_anew() -> None:
    memory = Memory(1, knots=10)
    for i in range(10):
        assert not memory.add_knot(knot(2 * i))
    assert memory.knots_until(7) == 4
    memory.add_map(0, 1.0, 10, b"x")
    assert memory.add_knot(knot(20))
    assert memory.epoch == 1
    assert memory.map_at(0, 1.0) is None  # its path was that of knots that are gone
    assert memory.knot_scans().tolist() == [0, 4, 8, 12, 16, 20]


def test_events_are_numbered_for_good_and_the_oldest_are_forgotten() -> None:
    memory = Memory(1)
    for i in range(4000):
        memory.add_event(float(i), "loop", str(i))
    following, events = memory.events(3990)
    assert following == 4000
    assert [event["text"] for event in events] == [str(i) for i in range(3990, 4000)]
    assert len(memory.events(0)[1]) <= 2000


@pytest.mark.parametrize("by", [1, 5])
def test_stepping_on_from_the_newest_stays_there(by: int) -> None:
    memory = Memory(1)
    memory.add(moment(0))
    assert memory.beside(memory.newest, by) is memory.newest
