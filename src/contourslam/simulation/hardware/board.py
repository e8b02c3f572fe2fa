"""The Arduino Mega of the base, simulated: its real firmware in simavr, in lock step with the robot around it."""

import contextlib
import json
import struct
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from contourslam.closing import Closing
from contourslam.errors import ContourslamError

AT_REST = (0, 0, 0, 0, 0, 9807, 0, 0, 0)
_REQUEST = struct.Struct("<Iii9hHH")
_REPLY = struct.Struct("<QhhH")


class BoardError(ContourslamError):
    """The simulated board cannot start, or its firmware has crashed."""


@dataclass(frozen=True, slots=True)
class BoardStep:
    """What the board has done in a step.

    Attributes
    ----------
    duty : tuple of int
        What the motor driver gives the left and the right motor at the end of the step, per mille, ahead is positive.
    sent : bytes
        What UART0 has sent.
    cycles : int
        Cycles of the chip since it was switched on, 16 million a second.
    """

    duty: tuple[int, int]
    sent: bytes
    cycles: int


@dataclass(frozen=True, slots=True)
class BoardFigures:
    """How busy the chip was, over its whole run.

    Attributes
    ----------
    cycles, asleep, in_interrupts : int
        Cycles in all, those the chip slept, and those inside of interrupts.
    longest_interrupt : int
        Cycles of the longest one.
    resets : int
        How often the chip was reset by its own watchdog.
    """

    cycles: int
    asleep: int
    in_interrupts: int
    longest_interrupt: int
    resets: int


class SimulatedBoard(Closing):
    """An Arduino Mega that executes a firmware, in a process of its own.

    Parameters
    ----------
    board : Path
        Program built from ``firmware/mega/simulator`` by ``make firmware``.
    firmware : Path
        ELF file for the ATmega2560.
    options : tuple of str
        Of that program: ``--imu none`` and the like.

    Raises
    ------
    BoardError
        If a file is missing, or the firmware crashes.
    """

    def __init__(self, board: Path, firmware: Path, options: tuple[str, ...] = ()) -> None:
        for path in (board, firmware):
            if not path.is_file():
                raise BoardError(f"{path} is not there: run make firmware (firmware/mega/README.md says what it needs)")
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 - closed in close()
        command = [str(board.absolute()), *options, str(firmware)]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=self._said)
        self._position = (0, 0)
        self._rest = 0.0
        self.figures: BoardFigures | None = None

    def step(
        self,
        seconds: float,
        ticks: tuple[int, int] | None = None,
        imu: tuple[int, ...] = AT_REST,
        battery_mv: int = 7400,
        received: bytes = b"",
    ) -> BoardStep:
        """Let time pass.

        Parameters
        ----------
        seconds : float
            How long; fractions of a microsecond are kept for the next step.
        ticks : tuple of int, optional
            Positions that the left and the right encoder reach by the end of the step, in ticks from where they were
            when the board was switched on; edges are spread evenly. Without it the wheels stand.
        imu : tuple of int, optional
            Gyro (1/4096 rad/s), accelerometer (mm/s²) and compass (0.1 µT), x, y and z of each, in the base frame.
        battery_mv : int, optional
            Voltage of the battery, mV.
        received : bytes, optional
            What the computer sends; the line carries 11520 bytes a second, and what is more waits.

        Raises
        ------
        BoardError
            If the firmware has crashed.
        """
        self._position = self._position if ticks is None else ticks
        micros = seconds * 1e6 + self._rest
        self._rest = micros - round(micros)
        request = _REQUEST.pack(round(micros), *self._position, *imu, battery_mv, len(received))
        cycles, left, right, count = _REPLY.unpack(self._exchange(request + received))
        return BoardStep((left, right), self._read(count), cycles)

    def close(self) -> None:
        """Switch the board off; ``figures`` is there afterwards."""
        if self._process.stdin is None or self._process.stdin.closed:
            return
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        said = self._words()
        self._said.close()
        if self._process.returncode == 0:
            self.figures = BoardFigures(**json.loads(said.splitlines()[-1]))

    def _exchange(self, request: bytes) -> bytes:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(request)
            self._process.stdin.flush()
        except BrokenPipeError:
            raise self._failure() from None
        return self._read(_REPLY.size)

    def _read(self, count: int) -> bytes:
        assert self._process.stdout is not None
        data = self._process.stdout.read(count)
        if len(data) < count:
            raise self._failure()
        return data

    def _failure(self) -> BoardError:
        self._process.wait()
        return BoardError(self._words().strip() or f"the simulated board ended with {self._process.returncode}")

    def _words(self) -> str:
        self._said.seek(0)
        return self._said.read().decode(errors="replace")
