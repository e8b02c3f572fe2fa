"""The way that a robot shall go: points along it, and the turn that leads back to it (pure pursuit, Coulter 1992)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.nearest import unreadable

Floats = NDArray[np.float64]
SPACING = 0.01
"""Between two points of a way, m."""
_LEAST = 200  # points


def sample_route(waypoints: Sequence[tuple[float, float]], *, closed: bool = True) -> Floats:
    """Points a centimetre apart along a way.

    Parameters
    ----------
    waypoints : sequence of (float, float)
        m.
    closed : bool
        The last leads back to the first.

    Returns
    -------
    ndarray, shape (n, 2)
        m.
    """
    corners = np.array([*waypoints, *waypoints[: int(closed)]], dtype=np.float64)
    reached = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    along = np.linspace(0.0, reached[-1], max(int(reached[-1] / SPACING), _LEAST), endpoint=not closed)
    return np.stack([np.interp(along, reached, corners[:, 0]), np.interp(along, reached, corners[:, 1])], axis=1)


def wanted_twist(
    pose: tuple[float, float, float], target: tuple[float, float], cruise: float, turn_limit: float
) -> tuple[float, float]:
    """Forward (m/s) and turning speed (rad/s) along the circle from a pose (x, y, heading) through a target (m)."""
    dx, dy = target[0] - pose[0], target[1] - pose[1]
    bearing = (math.atan2(dy, dx) - pose[2] + math.pi) % (2 * math.pi) - math.pi
    if abs(bearing) > math.pi / 2:  # the route goes on behind: turn on the spot
        return 0.0, math.copysign(turn_limit, bearing)
    curvature = 2.0 * math.sin(bearing) / max(math.hypot(dx, dy), 0.1)
    v = min(cruise, turn_limit / max(abs(curvature), 1e-6))
    return v, v * curvature


def gently(now: float, wanted: float, most: float) -> float:
    """Go from one value towards another, by no more than `most`."""
    return now + min(max(wanted - now, -most), most)


@dataclass(frozen=True, slots=True)
class Route:
    """A way to drive, as a file has it.

    Attributes
    ----------
    waypoints : tuple of (float, float)
        In the frame of the map, which begins where the robot starts, x ahead; m.
    closed : bool
        Drive it lap after lap.

    Raises
    ------
    ConfigError
        If there are fewer than two waypoints, or a number is not finite.
    """

    waypoints: tuple[tuple[float, float], ...]
    closed: bool = False

    def __post_init__(self) -> None:
        if len(self.waypoints) < 2:
            raise ConfigError(f"a route needs at least two waypoints, got {len(self.waypoints)}")
        if not all(math.isfinite(value) for point in self.waypoints for value in point):
            raise ConfigError("a route has a waypoint that is not finite")
        if all(point == self.waypoints[0] for point in self.waypoints):
            raise ConfigError("all waypoints of the route are the same")


def load_route(path: Path) -> Route:
    """Read a route: YAML with ``waypoints`` (x and y of each, m) and perhaps ``closed: true``, or CSV with x and y.

    Raises
    ------
    ConfigError
        If the file is missing or holds no route; the message says where.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(unreadable(path, error)) from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: is no text ({error})") from error
    try:
        return _from_csv(text) if path.suffix.lower() == ".csv" else _from_yaml(text)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def _from_csv(text: str) -> Route:
    points = []
    for number, line in enumerate(text.splitlines(), 1):
        words = [word.strip() for word in line.split("#")[0].split(",")]
        if words == [""] or (number == 1 and words[:2] == ["x", "y"]):
            continue
        points.append(_point(words, f"line {number}"))
    return Route(tuple(points))


def _from_yaml(text: str) -> Route:
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    try:
        content: Any = YAML(typ="safe", pure=True).load(text)
    except (YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"is not valid YAML ({' '.join(str(error).split())})") from error
    if not isinstance(content, dict) or not isinstance(content.get("waypoints"), list):
        raise ConfigError("holds no list of waypoints; write `waypoints: [[0, 0], [2, 0], [2, 1.5]]`")
    unknown = sorted(str(name) for name in content.keys() - {"waypoints", "closed"})
    if unknown or not isinstance(content.get("closed", False), bool):
        raise ConfigError(
            f"{', '.join(unknown) or 'closed'} is not known; there are waypoints and closed: true or false"
        )
    points = [_point(entry, f"waypoint {number}") for number, entry in enumerate(content["waypoints"], 1)]
    return Route(tuple(points), content.get("closed", False))


def _point(entry: Any, place: str) -> tuple[float, float]:
    try:
        x, y = (float(value) for value in entry)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{place} must be two numbers, x and y in m, got {entry!r}") from error
    return x, y
