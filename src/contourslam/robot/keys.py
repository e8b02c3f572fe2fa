"""Driving by the keys of a plain terminal, which tells of keys that are held only by repeating them."""

import os
import select
import sys
import termios
import time
import tty
from collections.abc import Callable
from contextlib import suppress
from types import TracebackType
from typing import Any, Self, TextIO

from contourslam.errors import ConfigError

DEAD_MAN = 0.7
"""s after the last key; terminals wait up to 0.66 s until they begin to repeat one."""
_ARROWS = {b"A": "w", b"B": "s", b"C": "d", b"D": "a"}
_AHEAD = {"w": 1.0, "q": 1.0, "e": 1.0, "s": -1.0}
_LEFT = {"a": 1.0, "q": 0.6, "d": -1.0, "e": -0.6}
HELP = "arrows or w a s d drive, q and e in a curve, space stops, x ends"


class KeyDriver:
    """Turns keys into a twist, which falls to zero :data:`DEAD_MAN` seconds after the last one; changed by each key.

    Parameters
    ----------
    speed : float
        m/s.
    turn_rate : float
        rad/s.
    clock : callable
        s.

    Attributes
    ----------
    ended : bool
        The key that ends was pressed.
    """

    def __init__(self, speed: float, turn_rate: float, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._speed, self._turn_rate, self._clock = speed, turn_rate, clock
        self._v: tuple[float, float] = (0.0, -1e9)  # share of the speed, and when it was wanted
        self._omega: tuple[float, float] = (0.0, -1e9)
        self._rest = b""
        self.ended = False

    def press(self, data: bytes) -> None:
        """Take what the terminal sent."""
        data, self._rest = self._rest + data, b""
        at = 0
        while at < len(data):
            if data[at : at + 1] == b"\x1b":
                if len(data) - at < 3:
                    self._rest = data[at:]
                    return
                if data[at + 1 : at + 2] in (b"[", b"O"):
                    self._key(_ARROWS.get(data[at + 2 : at + 3], ""))
                    at += 3
                    continue
            self._key(chr(data[at]).lower())
            at += 1

    def _key(self, key: str) -> None:
        now = self._clock()
        if key == " ":
            self._v = self._omega = (0.0, now)
        self.ended |= key == "x"
        if key in _AHEAD:
            self._v = _AHEAD[key], now
            if key in "ws" and key not in _LEFT and now - self._omega[1] > 0.2:
                self._omega = 0.0, now
        if key in _LEFT:
            self._omega = _LEFT[key], now
            if key in "ad" and now - self._v[1] > 0.2:
                self._v = 0.0, now

    def twist(self) -> tuple[float, float]:
        """Speed ahead (m/s) and turn rate (rad/s) that are wanted now."""
        now = self._clock()
        v, omega = (share if now - when < DEAD_MAN else 0.0 for share, when in (self._v, self._omega))
        return self._speed * v, self._turn_rate * omega


class Keyboard:
    """A terminal that hands keys on as they are pressed; a context manager that sets it back.

    Parameters
    ----------
    stream : TextIO, optional
        Standard input by default.

    Raises
    ------
    ConfigError
        If it is no terminal.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        stream = stream or sys.stdin
        if not stream.isatty():
            raise ConfigError("keys need a terminal; run it in one, or give a --route")
        self._number = stream.fileno()
        self._before: list[Any] | None = None

    def __enter__(self) -> Self:
        self._before = termios.tcgetattr(self._number)
        tty.setcbreak(self._number)  # Ctrl-C stays what it is
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None:
            with suppress(termios.error):  # the terminal has closed
                termios.tcsetattr(self._number, termios.TCSADRAIN, self._before)

    def pressed(self) -> bytes:
        """Give what was pressed since the last call; returns at once."""
        return os.read(self._number, 64) if select.select([self._number], [], [], 0.0)[0] else b""
