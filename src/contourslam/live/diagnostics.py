"""The state of live use in a few lines: what is well, what is not, and what to do about it."""

from dataclasses import dataclass, field
from enum import IntEnum


class Level(IntEnum):
    """How bad it is; the numbers are those of ROS."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One thing watched.

    Attributes
    ----------
    level : Level
    name : str
        "scans", "odometry", "latency", "clock", "map", "consistency" or "saving".
    message : str
        One line: what is the matter, and what to do.
    values : dict of str to str
        Figures, with their units.
    """

    level: Level
    name: str
    message: str
    values: dict[str, str] = field(default_factory=dict)
