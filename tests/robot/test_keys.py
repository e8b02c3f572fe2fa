import os
import pty
import sys
from pathlib import Path

import pytest

from contourslam.errors import ConfigError
from contourslam.robot.keys import DEAD_MAN, Keyboard, KeyDriver


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def driver() -> tuple[KeyDriver, Clock]:
    clock = Clock()
    return KeyDriver(0.3, 1.0, clock=clock), clock


@pytest.mark.parametrize(
    ("keys", "twist"),
    [
        (b"w", (0.3, 0.0)), (b"s", (-0.3, 0.0)), (b"a", (0.0, 1.0)), (b"d", (0.0, -1.0)), (b"q", (0.3, 0.6)),
        (b"e", (0.3, -0.6)), (b"\x1b[A", (0.3, 0.0)), (b"\x1bOB", (-0.3, 0.0)), (b"\x1b[C", (0.0, -1.0)),
        (b"\x1b[D", (0.0, 1.0)), (b"wwww ", (0.0, 0.0)), (b"?", (0.0, 0.0)), (b"W", (0.3, 0.0)),
        (b"\x1b[5~", (0.0, 0.0)),
    ],
)  # fmt: skip
def test_each_key_has_its_twist(keys: bytes, twist: tuple[float, float]) -> None:
    keyed, _ = driver()
    keyed.press(keys)
    assert keyed.twist() == pytest.approx(twist)


def test_the_robot_stops_a_moment_after_the_last_key() -> None:
    keyed, clock = driver()
    keyed.press(b"w")
    clock.now += DEAD_MAN - 0.01
    assert keyed.twist()[0] == 0.3
    keyed.press(b"w")
    clock.now += DEAD_MAN - 0.01
    assert keyed.twist()[0] == 0.3
    clock.now += 0.02
    assert keyed.twist() == (0.0, 0.0)


def test_an_arrow_may_come_in_pieces() -> None:
    keyed, _ = driver()
    for byte in (b"\x1b", b"[", b"A"):
        assert keyed.twist() == (0.0, 0.0)
        keyed.press(byte)
    assert keyed.twist() == (0.3, 0.0)
    assert not keyed.ended
    keyed.press(b"x")
    assert keyed.ended


def test_keys_come_from_a_terminal_as_they_are_pressed_and_it_is_set_back() -> None:
    import termios

    master, slave = pty.openpty()
    with os.fdopen(slave, "r") as stream:
        before = termios.tcgetattr(slave)
        with Keyboard(stream) as keyboard:
            assert keyboard.pressed() == b""
            os.write(master, b"w")
            seen = b""
            for _ in range(200):
                seen += keyboard.pressed()
            assert seen == b"w"  # without Enter
        assert termios.tcgetattr(slave)[3] == before[3]
    os.close(master)


def test_without_a_terminal_the_route_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with Path(os.devnull).open() as nothing:
        monkeypatch.setattr(sys, "stdin", nothing)
        with pytest.raises(ConfigError, match=r"keys need a terminal; .* --route"):
            Keyboard()
