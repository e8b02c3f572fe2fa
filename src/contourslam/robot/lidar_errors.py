"""What can go wrong with a lidar on a serial port, each by its own name, with what to try in its message."""

from contourslam.errors import ContourslamError


class LidarError(ContourslamError):
    """A lidar cannot be used."""


class LidarNotFoundError(LidarError):
    """There is no such port, or no port that could be a lidar's; the message lists the ports there are."""


class LidarPermissionError(LidarError):
    """The port may not be opened; the message names the group to join."""


class LidarBusyError(LidarError):
    """Another program holds the port."""


class LidarSilentError(LidarError):
    """Not a byte arrives."""


class LidarBaudError(LidarError):
    """Bytes arrive, and none of them make sense: wrong speed, or another device."""


class LidarNoisyError(LidarError):
    """Packets arrived, and now too few pass their checksum."""


class LidarStalledError(LidarError):
    """Samples arrive, but the head does not turn."""


class LidarPowerError(LidarError):
    """The lidar starts anew again and again: its supply dips."""


class LidarUnpluggedError(LidarError):
    """The port has gone and has not come back."""


class LidarFaultError(LidarError):
    """The lidar itself reports a fault."""
