from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from mega_bench import Bench, Motor

from contourslam.robot.base.messages import IMPOSSIBLE_STEP, REFUSED, WATCHDOG, Drive, State

STEP = 0.01
MINUTES = 10


def test_in_ten_minutes_no_tick_and_no_frame_is_lost_or_repeated(bench: Callable[..., Bench]) -> None:
    mega, motors = bench(), (Motor(friction=20.0), Motor(gain=7.0))
    chance = np.random.default_rng(6)
    mega.run(0.1, step=STEP)
    mega.heard.clear()
    said, sent, places = [], [], []
    wanted, next_command, next_turn = Drive(0, 0), mega.time, mega.time
    while mega.time < 60 * MINUTES:
        send = b""
        if mega.time >= next_turn:  # as a robot in a room: ahead, turning, back
            wanted = Drive(*chance.integers(-5000, 5000, 2).tolist())
            next_turn += float(chance.uniform(0.3, 3.0))
        if mega.time >= next_command:
            send = mega.frame(wanted)
            sent.append(mega.sequence)
            next_command += float(chance.uniform(0.02, 0.05))  # 20 to 50 a second
        done = mega.step(STEP, send, (motors[0].ticks, motors[1].ticks))
        for motor, duty in zip(motors, done.duty, strict=True):
            motor.step(STEP, duty)
        places.append((mega.time, *mega.ticks))
        said += [received for _, received in mega.heard]
        mega.heard.clear()
    mega.run(0.04, step=STEP)
    states = [received.message for received in said if isinstance(received.message, State)]

    assert len(said) == len(states)
    assert all((after.sequence - before.sequence) % 256 == 1 for before, after in pairwise(said))
    assert mega.decoder.refused.total() == 0
    assert all(after.time_us - before.time_us == 20_000 for before, after in pairwise(states))
    assert not any(state.flags & (REFUSED | IMPOSSIBLE_STEP | WATCHDOG) for state in states)

    # Positions are known at the ends of the steps and go evenly between; the base's clock began a moment after ours.
    times, left, right = np.array(places).T
    began = 600e-6
    at = np.array([state.time_us for state in states]) * 1e-6 + began
    inside = (at > times[0]) & (at < times[-1])
    ticks = np.array([state.ticks for state in states])
    for side, positions in enumerate((left, right)):
        assert np.abs(ticks[:, side] - np.interp(at, times, positions))[inside].max() <= 3.0
        assert np.abs(np.diff(positions)).sum() > 500_000
    assert mega.state().ticks == mega.ticks

    # Every command was obeyed, each once, in its order.
    shown = [after.last_command for before, after in pairwise(states) if after.last_command != before.last_command]
    steps = [(after - before) % 256 for before, after in pairwise(shown)]
    assert set(steps) <= {1, 2}  # two may come between two STATEs
    assert sum(steps) == pytest.approx(len(sent), abs=3)
