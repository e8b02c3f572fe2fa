import math

import numpy as np
import pytest

from contourslam.view.cursor import Cursor
from contourslam.view.memory import Memory
from contourslam.view.moment import Moment, Trace
from contourslam.view.pace import Pace
from contourslam.view.requests import Request

NOTHING = Trace(np.zeros((0, 2), np.float32), np.zeros(1, np.int32), np.zeros(0, np.bool_))


@pytest.fixture
def memory() -> Memory:
    """One of a hundred scans, ten a second."""
    memory = Memory(1)
    for i in range(100):
        memory.add(Moment(i, 0.1 * i, 0.0, NOTHING, np.zeros(3), None, ()))
    return memory


def test_it_follows_the_newest_until_it_is_drawn_back(memory: Memory) -> None:
    cursor = Cursor(memory, Pace())
    assert cursor.moment() is memory.newest
    cursor.obey(Request("seek", 3.05), ended=False)
    assert cursor.moment().index == 30
    cursor.obey(Request("follow"), ended=False)
    assert cursor.moment() is memory.newest


def test_what_was_drawn_back_goes_on_at_the_speed_until_it_has_caught_up(memory: Memory) -> None:
    cursor = Cursor(memory, Pace(2.0))
    cursor.obey(Request("seek", 3.0), ended=False)
    cursor.advance(1.0)
    assert cursor.at == pytest.approx(5.0)
    cursor.advance(60.0)
    assert cursor.at is None


def test_paused_it_stays(memory: Memory) -> None:
    pace = Pace()
    cursor = Cursor(memory, pace)
    cursor.obey(Request("seek", 3.0), ended=False)
    cursor.obey(Request("pause"), ended=False)
    cursor.advance(60.0)
    assert cursor.at == 3.0
    assert pace.paused


def test_to_look_beyond_what_is_mapped_has_it_mapped(memory: Memory) -> None:
    pace = Pace(paused=True)
    cursor = Cursor(memory, pace)
    cursor.obey(Request("seek", 20.0), ended=False)
    assert pace.hurries_to == 20.0
    assert cursor.moment() is memory.newest
    assert pace.wait(19.9, lambda: False)


def test_steps_go_back_through_what_was_and_on_through_what_comes(memory: Memory) -> None:
    pace = Pace()
    cursor = Cursor(memory, pace)
    cursor.obey(Request("step", -1.0), ended=False)
    assert cursor.moment().index == 98
    assert pace.paused
    cursor.obey(Request("step", -10.0), ended=False)
    assert cursor.moment().index == 88
    cursor.obey(Request("step", 10.0), ended=False)
    cursor.obey(Request("step", 1.0), ended=False)
    assert cursor.at is None
    cursor.obey(Request("step", 1.0), ended=False)  # at the newest: one more is mapped
    assert pace.wait(10.0, lambda: pytest.fail("it waits"))


def test_to_play_from_the_end_is_to_begin_again(memory: Memory) -> None:
    cursor = Cursor(memory, Pace(math.inf))
    cursor.obey(Request("play"), ended=True)
    assert cursor.moment().index == 0


def test_of_a_robot_a_page_holds_nothing_but_what_it_shows(memory: Memory) -> None:
    held, other = Cursor(memory, None), Cursor(memory, None)
    newest = memory.newest
    held.obey(Request("pause"), ended=False)
    memory.add(Moment(100, 10.0, 0.0, NOTHING, np.zeros(3), None, ()))
    held.advance(60.0)
    assert held.moment() is newest and held.pace.paused
    assert other.moment() is memory.newest and not other.pace.paused
    held.obey(Request("step", -10.0), ended=False)
    assert held.moment().index == 89
    held.obey(Request("speed", 2.0), ended=False)
    held.obey(Request("play"), ended=False)
    held.advance(0.5)
    assert held.moment().index == 99
    held.obey(Request("pause"), ended=False)
    held.obey(Request("follow"), ended=False)
    assert held.moment() is memory.newest and not held.pace.paused


def test_of_a_robot_nobody_looks_beyond_now(memory: Memory) -> None:
    cursor = Cursor(memory, None)
    cursor.obey(Request("step", -1.0), ended=False)
    assert cursor.moment().index == 98 and cursor.pace.paused
    cursor.obey(Request("step", 10.0), ended=False)
    assert cursor.moment() is memory.newest and cursor.pace.paused  # it is held there
    cursor.obey(Request("seek", 500.0), ended=False)
    assert cursor.at is None and not cursor.pace.paused
