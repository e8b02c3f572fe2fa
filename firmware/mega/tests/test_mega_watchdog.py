from collections.abc import Callable

import pytest
from mega_bench import Bench, framed

from contourslam.robot.base.messages import WATCHDOG, Ack, Drive, Hello, HelloReply, Stop, Tune

ON_THE_LINE = 16 * 10 / 115200  # a DRIVE
STEADY = Tune(0.0, 0.0, 0.0, 0.125)  # these wheels stand: what is given them shall not grow until they count as stalled


def test_the_motors_stop_300_ms_after_the_last_drive_and_not_before(bench: Callable[..., Bench]) -> None:
    mega = bench()
    mega.run(0.1)
    mega.run(0.05, STEADY)
    for _ in range(5):
        mega.run(0.29, Drive(3000, -3000), step=0.001)  # late, but never too late
        assert min(map(abs, mega.duty)) > 0
    mega.step(0.001, mega.frame(Drive(3000, -3000)))
    since = 0.001 - ON_THE_LINE
    while mega.duty != (0, 0):
        mega.step(0.0005)
        since += 0.0005
    assert 0.3 <= since < 0.307
    mega.run(0.03)
    assert mega.state().flags & WATCHDOG
    assert mega.state().duty == (0, 0)


@pytest.mark.parametrize(
    "other",
    [Hello(), Tune(0.1, 1.0, 0.0, 0.125), framed(1, 9, b"\0" * 7), b"\x12\x34\0"],
    ids=["HELLO", "TUNE", "short", "noise"],
)
def test_nothing_but_a_drive_keeps_the_motors_running(bench: Callable[..., Bench], other: Hello | Tune | bytes) -> None:
    mega = bench()
    mega.run(0.1)
    mega.run(0.05, Drive(3000, 3000))
    for _ in range(6):
        mega.run(0.05, other)
    assert mega.duty == (0, 0)
    assert mega.state().flags & WATCHDOG


@pytest.mark.parametrize("command", [Drive(1000, 1000), Stop()], ids=["DRIVE", "STOP"])
def test_a_command_clears_the_watchdogs_flag(bench: Callable[..., Bench], command: Drive | Stop) -> None:
    mega = bench()
    mega.run(0.1)
    mega.run(0.4, Drive(3000, 3000))
    assert mega.state().flags & WATCHDOG
    mega.run(0.05, command)
    assert not mega.state().flags & WATCHDOG
    assert (mega.duty != (0, 0)) == isinstance(command, Drive)


def test_stop_stops_at_once_and_is_acknowledged(bench: Callable[..., Bench]) -> None:
    mega = bench()
    mega.run(0.1)
    mega.run(0.1, Drive(3000, 3000))
    assert mega.duty != (0, 0)
    stop = mega.frame(Stop())
    said = mega.run(0.002, stop, step=0.001)
    assert mega.duty == (0, 0)
    said += mega.run(0.4)
    assert Ack(mega.sequence, 0) in said
    assert mega.duty == (0, 0)
    assert not mega.state().flags & WATCHDOG


def test_before_any_command_the_motors_stand(bench: Callable[..., Bench]) -> None:
    mega = bench()
    mega.run(1.0)
    assert all(state.duty == (0, 0) and not state.flags & WATCHDOG for state in mega.states())
    (greeting,) = mega.said()
    assert isinstance(greeting, HelloReply)
    assert greeting.reset_cause == 1


@pytest.mark.parametrize("boot_loader", [[], ["--boot-loader"]], ids=["bare", "behind_a_boot_loader"])
def test_a_loop_that_hangs_has_its_motors_off_and_starts_anew(
    bench: Callable[..., Bench], boot_loader: list[str]
) -> None:
    mega = bench("--hang-at", "1.0", *boot_loader)
    mega.run(0.1)
    mega.run(0.05, STEADY)
    while mega.time < 1.0:
        mega.run(0.05, Drive(3000, 3000))
    assert mega.duty != (0, 0)
    mega.run(0.14, Drive(3000, 3000))
    assert mega.duty == (0, 0)
    before = len(mega.said())
    mega.run(0.4)
    (greeting,) = mega.said()[before:]
    assert isinstance(greeting, HelloReply)
    assert greeting.reset_cause & 8
    assert mega.state().time_us < 600_000
    mega.run(0.1, Drive(3000, 3000))
    assert mega.duty != (0, 0)
    mega.board.close()
    assert mega.board.figures is not None
    assert mega.board.figures.resets == 1
