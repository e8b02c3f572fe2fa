"""Driver of the YDLidar X4: commands, scans as they come, and recovery from what goes wrong with cables and power."""

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from contourslam.closing import Closing
from contourslam.robot.device_errors import (
    DeviceBaudError,
    DeviceError,
    DeviceFaultError,
    DevicePowerError,
    DeviceSilentError,
    DeviceUnpluggedError,
)
from contourslam.robot.lidar.x4_turns import TurnAssembler
from contourslam.robot.lidar.x4_watch import Watch
from contourslam.robot.serial_port import LIDAR, find_port, open_port, set_dtr
from contourslam.scan import LaserScan

BAUD = 128000
SCAN, STOP, INFO, HEALTH = (bytes([0xA5, code]) for code in (0x60, 0x65, 0x90, 0x91))
_REPLY = b"\xa5\x5a"
_BATCH = 0.015  # s of bytes read at once: fewer wake-ups, and the clock knows that they are late
_MOST_RESTARTS, _RESTART_SPAN = 3, 60.0  # more than so many in so many seconds is a supply that does not hold


@dataclass(frozen=True, slots=True)
class DeviceInfo:
    """What the lidar says of itself.

    Attributes
    ----------
    model : int
        6 is the X4.
    firmware : str
        Major and minor version.
    hardware : int
    serial_number : str
    """

    model: int
    firmware: str
    hardware: int
    serial_number: str


@dataclass(frozen=True, slots=True)
class Health:
    """The lidar's own judgement.

    Attributes
    ----------
    status : int
        0 good, 1 warning, 2 fault.
    code : int
        The maker's code for what is wrong.
    """

    status: int
    code: int


class YdlidarX4(Closing):
    """A YDLidar X4 on a serial port; a context manager that stops the lidar and its motor at the end.

    Parameters
    ----------
    port : str, optional
        Such as ``/dev/ttyUSB0``; by default the only one that could be it.
    baud : int
        Bits a second; the X4 has 128000.
    timeout : float
        Time without bytes, or without a good packet, after which something is wrong, s.
    patience : float
        How long a port that has gone is waited for, s; 0 gives up at once.
    clock : callable
        Host time, s.

    Attributes
    ----------
    turns : TurnAssembler
        Counters of packets, failures and turns.
    restarts, reconnections : int
        How often the lidar had to be told again to scan, and the port was opened anew.
    unheard : int
        Of these commands, how many in a row brought no packet.
    motor_line : bool
        Whether the port has the line that switches the motor.

    Raises
    ------
    DeviceError
        One of its kinds, when the port cannot be opened.
    MissingExtraError
        If pyserial is not installed.
    """

    def __init__(
        self,
        port: str | None = None,
        *,
        baud: int = BAUD,
        timeout: float = 1.0,
        patience: float = 30.0,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._wanted, self._baud, self._timeout, self._patience, self._clock = port, baud, timeout, patience, clock
        self.turns = TurnAssembler()
        self.restarts = self.reconnections = 0
        self.unheard = 0
        self.motor_line = True
        self._restarted: deque[float] = deque(maxlen=_MOST_RESTARTS + 1)
        self.name = ""
        self._port: Any = None
        self._open()

    def _open(self) -> None:
        self.name = self._wanted or find_port(LIDAR)
        self._port = open_port(LIDAR, self.name, self._baud)

    def info(self) -> DeviceInfo:
        """Ask for model, versions and serial number; ends a scan that runs.

        Raises
        ------
        DeviceSilentError, DeviceBaudError, DeviceUnpluggedError
            If no answer comes.
        """
        content = self._ask(INFO, 0x04, 20)
        number = "".join(str(digit) if digit < 10 else f"{digit:02x}" for digit in content[4:])
        return DeviceInfo(content[0], f"{content[2]}.{content[1]}", content[3], number)

    def health(self) -> Health:
        """Ask how it is; ends a scan that runs.

        Raises
        ------
        DeviceSilentError, DeviceBaudError, DeviceUnpluggedError
            If no answer comes.
        """
        content = self._ask(HEALTH, 0x06, 3)
        return Health(content[0], int.from_bytes(content[1:], "little"))

    def start(self) -> None:
        """Switch the motor and the scan on.

        Raises
        ------
        DeviceFaultError
            If the lidar reports a fault.
        DeviceSilentError, DeviceBaudError, DeviceUnpluggedError
            If it does not answer.
        """
        health = self.health()
        if health.status >= 2:
            raise DeviceFaultError(
                f"{self.name}: the lidar reports fault {health.code}; take its power away for 5 s and try again"
            )
        self._begin()

    def stop(self) -> None:
        """Switch the scan and the motor off."""
        self._write(STOP)
        self._motor(False)
        self.turns.reset()

    def close(self) -> None:
        """Stop the lidar and free the port; no error, for a port that has gone is closed too."""
        if self._port is None:
            return
        with suppress(DeviceError):
            self.stop()
        with suppress(OSError):
            self._port.close()
        self._port = None

    def scans(self, stopped: Callable[[], bool] = lambda: False) -> Iterator[LaserScan]:
        """Start where needed, and yield a scan for each turn.

        A port that goes away is opened again, at first after 0.1 s, then after ever longer up to 2 s; a lidar that fell
        silent is told again to scan.

        Parameters
        ----------
        stopped : callable
            Asked some times a second; the scans end when it says so.

        Yields
        ------
        LaserScan
            Stamps are host time at the turn's first beam.

        Raises
        ------
        DeviceError
            One of its kinds: silent, wrong baud, noisy, stalled, power, unplugged, fault.
        """
        self.start()
        watch = Watch(self)
        while not stopped():
            try:
                data = self._read()
                read = self._clock()
                if data or watch.patient():
                    watch.saw(len(data))
                    yield from self.turns.feed(data, read)
                    watch.judge()
                    continue
                if len(self._restarted) > _MOST_RESTARTS:
                    raise DevicePowerError(
                        f"{self.name}: the lidar stopped {len(self._restarted)} times within a minute; its supply "
                        "dips: feed its second USB socket with 5 V and 1 A, or use a shorter cable"
                    )
                self._begin()
            except DeviceUnpluggedError:
                if not self._reconnect(stopped):
                    return
            watch = Watch(self)

    def _begin(self) -> None:
        self._motor(True)
        self.turns.reset()
        self._write(SCAN)

    def told_again(self) -> None:
        """Note that the lidar has to be told again to scan."""
        self.restarts += 1
        self.unheard += 1
        now = time.monotonic()
        while self._restarted and now - self._restarted[0] > _RESTART_SPAN:
            self._restarted.popleft()
        self._restarted.append(now)

    def _reconnect(self, stopped: Callable[[], bool]) -> bool:
        """Open the port again once it is back; False where that is no longer wanted."""
        with suppress(OSError):
            self._port.close()
        pause, until = 0.1, time.monotonic() + self._patience
        while not stopped():
            try:
                self._open()
                self.start()
                self.reconnections += 1
                return True
            except DeviceError as error:  # the rights to a new port come a moment after it, and a lidar has to boot
                if time.monotonic() + pause > until:
                    raise DeviceUnpluggedError(
                        f"{self.name}: the lidar was unplugged and has not come back within {self._patience:.0f} s; "
                        f"plug it in and start again (last: {error})"
                    ) from error
                with suppress(OSError):
                    self._port.close()
            wake = time.monotonic() + pause
            while time.monotonic() < wake and not stopped():
                time.sleep(0.02)
            pause = min(2.0 * pause, 2.0)
        return False

    def _motor(self, on: bool) -> None:
        try:
            self.motor_line = set_dtr(self._port, on)
        except OSError as error:
            raise self._gone(error) from error

    def _write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except OSError as error:
            raise self._gone(error) from error

    def _read(self) -> bytes:
        """Wait for bytes 0.1 s at the most, gather for some milliseconds, give what is there."""
        try:
            data: bytes = self._port.read(1)
            if data:
                time.sleep(_BATCH)
                data += self._port.read(self._port.in_waiting)
        except (OSError, TypeError) as error:  # pyserial has TypeErrors for a port that closes meanwhile
            raise self._gone(error) from error
        return data

    def _gone(self, error: Exception) -> DeviceUnpluggedError:
        return DeviceUnpluggedError(f"{self.name}: the port has gone ({error}); check the plug and the cable")

    def _ask(self, command: bytes, kind: int, length: int) -> bytes:
        """Send a command and wait for its answer's content."""
        self._write(STOP)
        time.sleep(0.02)  # what the lidar still has in its buffer
        try:
            self._port.reset_input_buffer()
        except Exception as error:  # termios.error is no OSError
            raise self._gone(error) from error
        head = _REPLY + length.to_bytes(4, "little") + bytes([kind])
        until, kept, received, asked = time.monotonic() + self._timeout, b"", 0, 0.0
        while time.monotonic() < until:
            if time.monotonic() - asked > 0.4 * self._timeout:  # a damaged command or answer: ask again
                asked = time.monotonic()
                self._write(command)
            data = self._read()
            kept, received = (kept + data)[-4096:], received + len(data)
            at = kept.find(head)
            if at >= 0 and len(kept) >= at + len(head) + length:
                return kept[at + len(head) : at + len(head) + length]
        raise self.no_answer(received)

    def no_answer(self, received: int) -> DeviceError:
        """Make the error for a lidar of which nothing can be understood."""
        if not received:
            return DeviceSilentError(
                f"{self.name}: no data within {self._timeout:g} s; check the lidar's power and that this is its port"
            )
        return DeviceBaudError(
            f"{self.name}: {received} bytes came at {self._baud} baud and none make sense; the X4 has {BAUD} baud: "
            "check --baud, and that this port is the lidar's"
        )

    @property
    def timeout(self) -> float:
        """Time without bytes, or without a good packet, after which something is wrong, s."""
        return self._timeout
