import math
import threading

import pytest

from contourslam.view.pace import LONGEST_GAP, Pace


class Time:
    """A clock that goes on only while somebody waits."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now

    def idle(self) -> bool:
        """Work that takes a millisecond."""
        self.now += 0.001
        return True


@pytest.fixture
def clock() -> Time:
    return Time()


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0])
def test_scans_come_at_the_speed_that_was_asked_for(clock: Time, speed: float) -> None:
    pace = Pace(speed, clock=clock)
    for i in range(51):
        assert pace.wait(0.2 * i, clock.idle)
    assert clock.now == pytest.approx(10.0 / speed, abs=0.02)
    assert not pace.pressed


def test_as_fast_as_possible_waits_for_nothing_and_says_that_it_is_pressed(clock: Time) -> None:
    pace = Pace(math.inf, clock=clock)
    assert all(pace.wait(float(i), clock.idle) for i in range(1000))
    assert clock.now == 0.0
    assert pace.pressed


def test_one_who_is_too_slow_does_not_rush_afterwards(clock: Time) -> None:
    pace = Pace(1.0, clock=clock)
    pace.wait(0.0, clock.idle)
    clock.now = 100.0  # the mapping took that long
    pace.wait(0.2, clock.idle)
    pace.wait(0.4, clock.idle)
    assert clock.now == pytest.approx(100.2, abs=0.01)


def test_a_pause_of_the_recording_is_passed_over(clock: Time) -> None:
    pace = Pace(1.0, clock=clock)
    pace.wait(0.0, clock.idle)
    pace.wait(LONGEST_GAP + 3600.0, clock.idle)
    assert clock.now < 1.0


def test_steps_are_counted_and_let_through_one_scan_each(clock: Time) -> None:
    pace = Pace(1.0, paused=True)
    passed: list[float] = []

    def work() -> None:
        for i in range(100):
            if not pace.wait(float(i), lambda: False):
                return
            passed.append(float(i))

    worker = threading.Thread(target=work)
    pace.step()
    pace.step()
    worker.start()
    worker.join(0.3)
    assert passed == [0.0, 1.0]
    pace.hurry(5.5)
    worker.join(0.3)
    assert passed == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert pace.paused
    pace.stop()
    worker.join(5.0)
    assert not worker.is_alive()
    assert len(passed) == 6


def test_the_speed_may_change_at_any_time(clock: Time) -> None:
    pace = Pace(1.0, clock=clock)
    pace.wait(0.0, clock.idle)
    pace.wait(1.0, clock.idle)
    pace.set_speed(100.0)
    pace.wait(2.0, clock.idle)
    assert clock.now == pytest.approx(1.01, abs=0.01)
    assert pace.reached() == pytest.approx(2.0 / 1.01, rel=0.1)
