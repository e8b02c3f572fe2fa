"""What wraps after half an hour and more: the clock is set to just before."""

import subprocess
from collections.abc import Callable
from itertools import pairwise

import pytest
from mega_bench import BUILD, Bench, Motor

from contourslam.robot.base.messages import Drive

STEP = 0.001


def address(name: str) -> int:
    """Where the firmware keeps a variable."""
    listing = subprocess.run(["avr-nm", BUILD / "mega.elf"], capture_output=True, text=True, check=True).stdout
    (found,) = [line.split()[0] for line in listing.splitlines() if name in line]
    return int(found, 16) & 0xFFFF


@pytest.mark.parametrize("wrap", [2**31, 2**32], ids=["half_microseconds", "microseconds"])
def test_neither_the_speed_nor_the_watchdog_sees_the_clock_wrap(bench: Callable[..., Bench], wrap: int) -> None:
    mega, motors = (
        bench("--poke", f"0.2,{address('time_us')},{wrap - 1_000_000}"),
        (Motor(), Motor()),
    )
    mega.run(0.3)
    states = len(mega.states())
    for count in range(2000):
        send = mega.frame(Drive(2600, -150)) if count % 50 == 0 else b""
        mega.step(STEP, send, (motors[0].ticks, motors[1].ticks))
        for motor, duty in zip(motors, mega.duty, strict=True):
            motor.step(STEP, duty)
        if count > 500:
            assert motors[0].speed == pytest.approx(2600, rel=0.05)
            assert motors[1].speed == pytest.approx(-150, rel=0.1)
    times = [state.time_us for state in mega.states()[states:]]
    assert (
        min(times) < 2_000_000 + wrap % 2**32 < max(times) + 2**32 if wrap == 2**32 else max(times) > wrap > min(times)
    )
    assert all((after - before) % 2**32 == 20_000 for before, after in pairwise(times))


def test_the_watchdog_strikes_across_a_wrap(bench: Callable[..., Bench]) -> None:
    mega = bench("--poke", f"0.2,{address('time_us')},{2**31 - 200_000}")
    mega.run(0.25)
    mega.run(0.29, Drive(3000, 3000), step=STEP)
    assert mega.duty != (0, 0)
    mega.run(0.02, step=STEP)
    assert mega.duty == (0, 0)
