from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from mega_bench import Bench

from contourslam.robot.base.messages import IMPOSSIBLE_STEP, Drive

SETTLED = 0.03


@pytest.mark.parametrize("speeds", [(20_000, 20_000), (-20_000, 20_000), (20_000, -7_001), (-20_000, -20_000)])
def test_20000_edges_a_second_of_each_wheel_are_counted_without_loss(
    bench: Callable[..., Bench], speeds: tuple[int, int]
) -> None:
    mega = bench()
    mega.run(0.5)  # until the IMU is read too
    for tenth in range(1, 21):
        mega.step(0.1, mega.frame(Drive(2600, -2600)), (speeds[0] * tenth // 10, speeds[1] * tenth // 10))
    mega.run(SETTLED)
    assert mega.state().ticks == (2 * speeds[0], 2 * speeds[1])
    assert not any(state.flags & IMPOSSIBLE_STEP for state in mega.states())


def test_ticks_are_those_of_the_time_that_they_carry(bench: Callable[..., Bench]) -> None:
    mega = bench()
    mega.run(0.1)
    for _ in range(200):
        left, right = mega.ticks
        mega.step(0.001, ticks=(left + 20, right - 7))
    moving = [state for state in mega.states() if 0 < state.ticks[0] < 4000]
    assert len(moving) >= 8
    for before, after in pairwise(moving):
        assert after.time_us - before.time_us == 20_000
        assert after.ticks[0] - before.ticks[0] == pytest.approx(400, abs=1)
        assert after.ticks[1] - before.ticks[1] == pytest.approx(-140, abs=1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_reversing_loses_nothing(bench: Callable[..., Bench], seed: int) -> None:
    chance = np.random.default_rng(seed)
    mega = bench()
    mega.run(0.05)
    for _ in range(400):
        seconds = float(chance.uniform(0.0005, 0.02))
        left, right = chance.integers(-int(20_000 * seconds), int(20_000 * seconds), 2, endpoint=True).tolist()
        mega.step(seconds, ticks=(mega.ticks[0] + left, mega.ticks[1] + right))
    wanted = mega.ticks
    mega.run(SETTLED)
    assert mega.state().ticks == wanted
    assert not any(state.flags & IMPOSSIBLE_STEP for state in mega.states())


@pytest.mark.parametrize("direction", [1, -1])
def test_an_impossible_step_is_flagged_once_and_counted_in_the_wheels_direction(
    bench: Callable[..., Bench], direction: int
) -> None:
    mega = bench()
    mega.run(0.05)
    mega.step(0.01, ticks=(10 * direction, 0))
    mega.step(1e-6, ticks=(12 * direction, 0))  # both channels before the interrupt can look
    mega.step(0.01, ticks=(20 * direction, 0))
    mega.run(SETTLED)
    assert mega.state().ticks == (20 * direction, 0)
    assert [bool(state.flags & IMPOSSIBLE_STEP) for state in mega.states()].count(True) == 1


def test_at_20000_edges_a_second_most_of_the_time_is_left(bench: Callable[..., Bench]) -> None:
    mega = bench()
    mega.run(0.5)
    for tenth in range(1, 51):
        mega.step(0.1, mega.frame(Drive(10_000, 10_000)), (1000 * tenth, 1000 * tenth))
    mega.board.close()
    figures = mega.board.figures
    assert figures is not None
    assert figures.in_interrupts < 0.2 * figures.cycles
    assert figures.asleep > 0.6 * figures.cycles
    assert figures.longest_interrupt < 16 * 25  # 25 us, half of the time between edges
