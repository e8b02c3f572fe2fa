"""What can go wrong with a part of the robot on its port, each by its own name, with what to try in its message."""

from contourslam.errors import ContourslamError


class DeviceError(ContourslamError):
    """A part of the robot cannot be used."""


class DeviceNotFoundError(DeviceError):
    """There is no such port, or none that could be the part's; the message lists the ports there are."""


class DevicePermissionError(DeviceError):
    """The port may not be opened; the message names the group to join."""


class DeviceBusyError(DeviceError):
    """Another program holds the port."""


class DeviceSilentError(DeviceError):
    """Not a byte arrives."""


class DeviceBaudError(DeviceError):
    """Bytes arrive, and none of them make sense: wrong speed, or another device."""


class DeviceNoisyError(DeviceError):
    """What arrives fails its checksum too often."""


class LidarStalledError(DeviceError):
    """The lidar's samples arrive, but its head does not turn."""


class DevicePowerError(DeviceError):
    """The part starts anew again and again: its supply dips."""


class DeviceUnpluggedError(DeviceError):
    """The port has gone and has not come back."""


class DeviceFaultError(DeviceError):
    """The part itself reports a fault."""


class DeviceVersionError(DeviceError):
    """The part's firmware speaks another version of the protocol."""
