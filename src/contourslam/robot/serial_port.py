"""Serial ports: which there are, and opening one with errors that say what to try."""

import errno
import os
from typing import Any

from contourslam.errors import MissingExtraError
from contourslam.robot.lidar_errors import LidarBusyError, LidarError, LidarNotFoundError, LidarPermissionError

_NO_MODEM_LINES = (errno.ENOTTY, errno.EINVAL)  # what a pseudo-terminal answers when asked for DTR


def _serial() -> Any:
    try:
        import serial
    except ImportError as error:
        raise MissingExtraError("pyserial is not installed; run: pip install 'contourslam[robot]'") from error
    return serial


def list_ports() -> list[tuple[str, str, bool]]:
    """List the serial ports: name, what the system calls it, and whether it is the kind of bridge on the X4's board.

    Raises
    ------
    MissingExtraError
        If pyserial is not installed.
    """
    _serial()
    from serial.tools import list_ports as tools

    found = sorted(tools.comports(), key=lambda port: str(port.device))
    return [(port.device, port.description, (port.vid, port.pid) == (0x10C4, 0xEA60)) for port in found]


def _there_are() -> str:
    ports = ", ".join(f"{name} ({what})" if what and what != "n/a" else name for name, what, _ in list_ports())
    return f"the ports there are: {ports}" if ports else "there is no serial port at all: plug the lidar's USB board in"


def find_port() -> str:
    """Find the port of the lidar: the only one with a CP2102 bridge, or else the only port.

    Raises
    ------
    LidarNotFoundError
        If there is none, or more than one.
    """
    ports = list_ports()
    likely = [name for name, _, bridge in ports if bridge] or [name for name, _, _ in ports]
    if len(likely) == 1:
        return likely[0]
    if likely:
        raise LidarNotFoundError(f"more than one port could be the lidar's: choose one with --port; {_there_are()}")
    raise LidarNotFoundError(f"no lidar was found: {_there_are()}")


def open_port(name: str, baud: int) -> Any:
    """Open a port for this process alone, with the motor's line (DTR) down where the port has one.

    Parameters
    ----------
    name : str
    baud : int
        Bits a second.

    Returns
    -------
    serial.Serial
        Reads wait 0.1 s at the most, writes 1 s.

    Raises
    ------
    LidarNotFoundError, LidarPermissionError, LidarBusyError
        With what to try.
    LidarError
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
            raise LidarNotFoundError(f"{name}: there is no such port; {_there_are()}") from error
        if number in (errno.EACCES, errno.EPERM):
            raise LidarPermissionError(f"{name}: {_join_group(name)}") from error
        if number in (errno.EBUSY, errno.EAGAIN):
            raise LidarBusyError(f"{name}: another program holds the port; end it (`fuser {name}` names it)") from error
        raise LidarError(f"{name}: cannot be opened as a serial port at {baud} baud ({error})") from error
    return port


def _join_group(name: str) -> str:
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
