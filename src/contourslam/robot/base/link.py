"""The serial line to the Mega: opened, greeted, read and written, with errors that say what to try."""

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from contourslam.robot.base.messages import Hello, HelloReply, Message
from contourslam.robot.base.protocol import BAUD, VERSION, Decoder, Received, encode
from contourslam.robot.device_errors import (
    DeviceBaudError,
    DeviceError,
    DeviceNoisyError,
    DeviceSilentError,
    DeviceUnpluggedError,
    DeviceVersionError,
)
from contourslam.robot.serial_port import BASE, find_port, open_port

BOOT = 4.0
"""s within which a Mega that was reset must have spoken; its boot loader takes up to 2 s of them."""
_ASK = 0.05  # s between two HELLOs
_WAIT = 0.02  # s that a read waits for bytes
_SPEAKS = 0.1  # s; a base from which nothing came for longer may be in its boot loader


class MegaLink:
    """Frames to and from a Mega; :meth:`read` is for one thread, :meth:`send` for any.

    Parameters
    ----------
    port : str or None
        By default the only one that could be it.

    Attributes
    ----------
    name : str
        Of the port.
    decoder : Decoder
        Its counters.
    """

    def __init__(self, port: str | None) -> None:
        self._wanted = port
        self.name = port or "the base"
        self.decoder = Decoder()
        self._port: Any = None
        self._sequence = 0
        self._lock = threading.Lock()

    def open(self, stopped: Callable[[], bool] = lambda: False) -> HelloReply:
        """Open the port, wait until the Mega has booted, and have it say who it is.

        Parameters
        ----------
        stopped : callable
            Ends the waiting when it says so.

        Raises
        ------
        DeviceError
            One of its kinds: not found, permission, busy; silent, wrong baud, noisy, another version.
        """
        self.name = self._wanted or find_port(BASE)
        self._port = open_port(BASE, self.name, BAUD)
        try:
            self._port.timeout = _WAIT
            self.decoder.reset()
            reply = self._greet(stopped)
        except BaseException:
            self.close()
            raise
        if reply.protocol != VERSION:
            self.close()
            raise self._version(f"version {reply.protocol}")
        return reply

    def _greet(self, stopped: Callable[[], bool]) -> HelloReply:
        """Ask until the base answers, but only while it speaks: a boot loader that hears bytes waits for a program."""
        decoder = self.decoder
        received, refused, good = decoder.received, decoder.refused.copy(), decoder.good
        until, heard, asked = time.monotonic() + BOOT, 0.0, 0.0
        while (now := time.monotonic()) < until and not stopped():
            data = self.read()
            heard = time.monotonic() if data else heard
            for frame in decoder.feed(data):
                if isinstance(frame.message, HelloReply):
                    return frame.message
            if decoder.good > good and now - heard < _SPEAKS and now - asked > _ASK:
                asked = now
                self.send(Hello())
        bad = decoder.refused - refused
        if decoder.received == received:
            raise self.silent(BOOT)
        if decoder.good > good:
            if bad["length"] + bad["type"]:
                raise self._version("another version")
            raise DeviceSilentError(
                f"{self.name}: the base speaks but does not answer; check the wire that goes to its RX, and the cable"
            )
        raise DeviceBaudError(
            f"{self.name}: {decoder.received - received} bytes came at {BAUD} baud and none make sense: check that "
            "this port is the base's, and flash its firmware: make -C firmware/mega flash"
        )

    def read(self) -> bytes:
        """Wait for bytes 20 ms at the most, give what is there.

        Raises
        ------
        DeviceUnpluggedError
            If the port has gone.
        """
        try:
            data: bytes = self._port.read(1)
            if data:
                data += self._port.read(self._port.in_waiting)
        except (OSError, TypeError) as error:  # pyserial has TypeErrors for a port that closes meanwhile
            raise self._gone(error) from error
        return data

    def take(self, data: bytes) -> list[Received]:
        """Decode bytes that were read."""
        return self.decoder.feed(data)

    def send(self, message: Message) -> int:
        """Send a frame and give its sequence; a zero before it ends what noise may have begun.

        Raises
        ------
        DeviceUnpluggedError
            If the port has gone.
        """
        with self._lock:
            sequence, self._sequence = self._sequence, (self._sequence + 1) % 256
            port = self._port
            if port is None:
                raise self._gone(OSError("it is closed"))
            try:
                port.write(b"\0" + encode(message, sequence))
            except (OSError, TypeError) as error:  # a write that times out is an OSError, too
                raise self._gone(error) from error
        return sequence

    def close(self) -> None:
        """Free the port; no error, for a port that has gone is closed too."""
        port, self._port = self._port, None
        if port is not None:
            with suppress(Exception):
                port.close()

    def silent(self, seconds: float) -> DeviceError:
        """Make the error for a base from which nothing comes."""
        return DeviceSilentError(
            f"{self.name}: no data within {seconds:.0f} s; check the base's power and that this is its port, and flash "
            "its firmware if it has none: make -C firmware/mega flash"
        )

    def noisy(self, seconds: float) -> DeviceError:
        """Make the error for a base of which nothing arrives undamaged."""
        return DeviceNoisyError(
            f"{self.name}: bytes come, but not one sound frame for {seconds:.0f} s; check the cable and its distance "
            "from the motors"
        )

    def _version(self, spoken: str) -> DeviceError:
        return DeviceVersionError(
            f"{self.name}: the base's firmware speaks {spoken} of the protocol, and this program version {VERSION}; "
            "flash the firmware again: make -C firmware/mega flash"
        )

    def _gone(self, error: Exception) -> DeviceUnpluggedError:
        return DeviceUnpluggedError(f"{self.name}: the port has gone ({error}); check the plug and the cable")
