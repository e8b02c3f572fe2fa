"""Serial ports: which there are, and opening one with errors that say what to try."""

import errno
import os
from dataclasses import dataclass
from typing import Any

from contourslam.errors import MissingExtraError
from contourslam.robot.device_errors import DeviceBusyError, DeviceError, DeviceNotFoundError, DevicePermissionError

_NO_MODEM_LINES = (errno.ENOTTY, errno.EINVAL)  # what a pseudo-terminal answers when asked for DTR


def _serial() -> Any:
    try:
        import serial
    except ImportError as error:
        raise MissingExtraError("pyserial is not installed; run: pip install 'contourslam[robot]'") from error
    return serial


@dataclass(frozen=True, slots=True)
class SerialPart:
    """A part of the robot that hangs on a serial port.

    Attributes
    ----------
    name : str
        What a message calls it.
    usb : tuple of (int, int)
        Vendor and product of the USB bridges on its board.
    """

    name: str
    usb: tuple[tuple[int, int], ...]


LIDAR = SerialPart("lidar", ((0x10C4, 0xEA60),))
"""The X4's board has a CP2102."""
BASE = SerialPart("base", ((0x2341, 0x0042), (0x2341, 0x0010), (0x2A03, 0x0042), (0x1A86, 0x7523)))
"""An Arduino Mega 2560, or one of its copies with a CH340."""


def list_ports() -> list[tuple[str, str, tuple[int, int] | None]]:
    """List the serial ports: name, what the system calls it, and its USB vendor and product.

    Raises
    ------
    MissingExtraError
        If pyserial is not installed.
    """
    _serial()
    from serial.tools import list_ports as tools

    found = sorted(tools.comports(), key=lambda port: str(port.device))
    return [(p.device, p.description, None if p.vid is None else (p.vid, p.pid)) for p in found]


def _there_are(part: SerialPart) -> str:
    ports = ", ".join(f"{name} ({what})" if what and what != "n/a" else name for name, what, _ in list_ports())
    if ports:
        return f"the ports there are: {ports}"
    return f"there is no serial port at all: plug the {part.name}'s USB cable in"


def find_port(part: SerialPart) -> str:
    """Find the port of a part: the only one with its bridge, or else the only port that is not known as another part's.

    Raises
    ------
    DeviceNotFoundError
        If there is none, or more than one.
    """
    ports = list_ports()
    others = {usb for other in (LIDAR, BASE) if other is not part for usb in other.usb}
    likely = [name for name, _, usb in ports if usb in part.usb] or [n for n, _, usb in ports if usb not in others]
    if len(likely) == 1:
        return likely[0]
    there = _there_are(part)
    if likely:
        raise DeviceNotFoundError(f"more than one port could be the {part.name}'s: choose one with --port; {there}")
    raise DeviceNotFoundError(f"no {part.name} was found: {there}")


def open_port(part: SerialPart, name: str, baud: int) -> Any:
    """Open a port for this process alone, with its DTR line down where it has one (the X4's motor hangs on it).

    Parameters
    ----------
    part : SerialPart
    name : str
    baud : int
        Bits a second.

    Returns
    -------
    serial.Serial
        Reads wait 0.1 s at the most, writes 1 s.

    Raises
    ------
    DeviceNotFoundError, DevicePermissionError, DeviceBusyError
        With what to try.
    DeviceError
        For any other reason.
    """
    serial = _serial()
    port = serial.Serial(baudrate=baud, timeout=0.1, write_timeout=1.0, exclusive=True)
    port.port, port.dtr = name, False
    try:
        port.open()
    except (OSError, ValueError) as error:  # SerialException is an OSError
        number = getattr(error, "errno", None)
        if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
            raise DeviceNotFoundError(f"{name}: there is no such port; {_there_are(part)}") from error
        if number in (errno.EACCES, errno.EPERM):
            raise DevicePermissionError(f"{name}: {join_group(name)}") from error
        if number in (errno.EBUSY, errno.EAGAIN):
            raise DeviceBusyError(f"{name}: another program holds the port; end it (see `fuser {name}`)") from error
        raise DeviceError(f"{name}: cannot be opened as a serial port at {baud} baud ({error})") from error
    return port


def join_group(name: str) -> str:
    """Say how a user comes by the right to open a device."""
    try:
        import grp

        group = grp.getgrgid(os.stat(name).st_gid).gr_name  # noqa: PTH116, a device's name is no path to us
    except (ImportError, OSError, KeyError):
        group = "dialout"
    return (
        f"may not be opened by this user, only by the group {group}; run `sudo usermod -aG {group} $USER`, "
        "log out and in again"
    )


def set_dtr(port: Any, up: bool) -> bool:
    """Set the line that the X4's motor hangs on; whether the port has one."""
    try:
        port.dtr = up
    except OSError as error:
        if error.errno in _NO_MODEM_LINES:
            return False
        raise
    return True
