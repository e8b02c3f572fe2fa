"""What stands in a room: boxes and round columns in 3-D, and furniture made of them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError

Colour = tuple[float, float, float]

WOOD: Colour = (0.66, 0.47, 0.30)
PINE: Colour = (0.80, 0.65, 0.46)
DARK_WOOD: Colour = (0.42, 0.29, 0.20)
WHITE: Colour = (0.90, 0.90, 0.88)
GREY: Colour = (0.55, 0.57, 0.60)
STEEL: Colour = (0.36, 0.42, 0.50)
CARTON: Colour = (0.78, 0.63, 0.42)
FABRIC: Colour = (0.28, 0.40, 0.52)
RED: Colour = (0.70, 0.27, 0.22)
GREEN: Colour = (0.30, 0.48, 0.28)
CLAY: Colour = (0.72, 0.42, 0.30)


@dataclass(frozen=True, slots=True)
class Box:
    """A box that stands upright; lengths in m, `yaw_deg` counter-clockwise in degrees.

    Attributes
    ----------
    x, y : float
        Middle of the footprint in the world frame.
    length, width : float
        Extent along the box's own x and y axis.
    top, bottom : float
        Heights above the floor between which there is matter.
    """

    x: float
    y: float
    length: float
    width: float
    top: float
    yaw_deg: float = 0.0
    bottom: float = 0.0
    colour: Colour = WOOD

    def __post_init__(self) -> None:
        if min(self.length, self.width) <= 0 or self.top <= self.bottom:
            raise ConfigError(f"a box needs a positive length, width and height, got {self!r}")

    def footprint(self) -> NDArray[np.float64]:
        """Return its four vertices in the world frame, shape (4, 2), m, counter-clockwise."""
        half = 0.5 * np.array([self.length, self.width])
        local = half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        return np.array([place(self.x, self.y, self.yaw_deg, px, py) for px, py in local])


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A round column that stands upright, clear of everything else; lengths in m as in :class:`Box`."""

    x: float
    y: float
    radius: float
    top: float
    bottom: float = 0.0
    colour: Colour = WHITE

    def __post_init__(self) -> None:
        if self.radius <= 0 or self.top <= self.bottom:
            raise ConfigError(f"a cylinder needs a positive radius and height, got {self!r}")


Piece = Box | Cylinder


def place(x: float, y: float, yaw_deg: float, px: float, py: float) -> tuple[float, float]:
    """World position of the point (px, py) of a thing that stands at (x, y), turned by yaw."""
    # Right angles exactly: a cupboard along a wall must touch it, not miss it by a rounding error.
    quarter, rest = divmod(yaw_deg, 90.0)
    cos, sin = math.cos(math.radians(rest)), math.sin(math.radians(rest))
    for _ in range(int(quarter) % 4):
        cos, sin = -sin, cos
    return x + cos * px - sin * py, y + sin * px + cos * py


def _part(at: tuple[float, float, float], px: float, py: float, *size: float, bottom: float, colour: Colour) -> Box:
    """Build a box of a thing that stands at x, y, yaw (m, m, degrees)."""
    length, width, top = size
    x, y = place(*at, px, py)
    return Box(x, y, length, width, top, at[2], bottom, colour)


def table(
    x: float,
    y: float,
    length: float,
    width: float,
    yaw_deg: float = 0.0,
    *,
    height: float = 0.74,
    leg: float = 0.05,
    colour: Colour = WOOD,
) -> tuple[Box, ...]:
    """Return a top on four square legs: a lidar near the floor sees the legs only."""
    at, dx, dy = (x, y, yaw_deg), (length - leg) / 2, (width - leg) / 2
    legs = [(sx * dx, sy * dy) for sx in (-1, 1) for sy in (-1, 1)]
    return (
        _part(at, 0, 0, length, width, height, bottom=height - 0.04, colour=colour),
        *(_part(at, px, py, leg, leg, height - 0.04, bottom=0.0, colour=colour) for px, py in legs),
    )


def chair(x: float, y: float, yaw_deg: float, colour: Colour = DARK_WOOD) -> tuple[Box, ...]:
    """Return a chair whose back is on the side of its negative x axis."""
    at = (x, y, yaw_deg)
    return (
        *table(x, y, 0.42, 0.42, yaw_deg, height=0.45, leg=0.04, colour=colour),
        _part(at, -0.19, 0, 0.04, 0.42, 0.90, bottom=0.45, colour=colour),
    )


def sofa(x: float, y: float, length: float, yaw_deg: float = 0.0, colour: Colour = FABRIC) -> tuple[Box, ...]:
    """Return a sofa 0.9 m deep whose back is on the side of its negative y axis."""
    at, depth = (x, y, yaw_deg), 0.9
    return (
        _part(at, 0, 0, length, depth, 0.40, bottom=0.0, colour=colour),
        _part(at, 0, -depth / 2 + 0.1, length, 0.2, 0.80, bottom=0.40, colour=colour),
        *(
            _part(at, s * (length / 2 - 0.09), 0.1, 0.18, depth - 0.2, 0.58, bottom=0.40, colour=colour)
            for s in (-1, 1)
        ),
    )


def shelves(x: float, y: float, length: float, depth: float, yaw_deg: float = 0.0) -> tuple[Box, ...]:
    """Return shelves with books above a closed base; the back is on the side of the negative y axis."""
    at, top = (x, y, yaw_deg), 1.9
    boards = [_part(at, 0, 0, length, depth, h + 0.03, bottom=h, colour=WOOD) for h in (0.85, 1.2, 1.55, top)]
    sides = [_part(at, s * (length / 2 - 0.015), 0, 0.03, depth, top, bottom=0.5, colour=WOOD) for s in (-1, 1)]
    spread = ((-0.30, 0.30, RED), (0.02, 0.22, FABRIC), (0.31, 0.24, GREEN))
    books = [
        _part(at, m * length, -0.03, w * length, depth * 0.7, h + 0.25, bottom=h, colour=c)
        for h, (m, w, c) in zip((0.53, 0.88, 1.23, 1.58) * 3, spread * 4, strict=True)
    ]
    back = _part(at, 0, -depth / 2 + 0.01, length, 0.02, top, bottom=0.5, colour=DARK_WOOD)
    return (_part(at, 0, 0, length, depth, 0.5, bottom=0.0, colour=WOOD), *boards, *sides, back, *books)


def plant(x: float, y: float, radius: float = 0.17) -> tuple[Cylinder, ...]:
    """Return a plant in a round pot."""
    crown = [(0.75, 0.06), (1.15, 1.5 * radius), (1.35, radius)]
    bottoms = (0.35, 0.70, 1.15)
    parts = (Cylinder(x, y, r, top, b, GREEN) for (top, r), b in zip(crown, bottoms, strict=True))
    return (Cylinder(x, y, radius, 0.35, 0.0, CLAY), *parts)


def partition(
    start: tuple[float, float],
    end: tuple[float, float],
    height: float,
    *doors: tuple[float, float],
    thickness: float = 0.12,
) -> tuple[Box, ...]:
    """Return an inner wall between two points with gaps for doors.

    Parameters
    ----------
    start, end : tuple of float
        Ends of its middle line, m.
    height : float
        m; above a door the wall goes on from 2.0 m.
    *doors : tuple of float
        Middle of each gap along the wall from `start`, and its width, m.
    thickness : float
        m.
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    length, at = math.hypot(dx, dy), (start[0], start[1], round(math.degrees(math.atan2(dy, dx)), 9))
    edges = [0.0, *(s + side * width / 2 for s, width in sorted(doors) for side in (-1, 1)), length]
    spans = [(a, b, 0.0) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    lintels = [(a, b, 2.0) for a, b in zip(edges[1:-1:2], edges[2:-1:2], strict=True)]
    return tuple(
        _part(at, (a + b) / 2, 0, b - a, thickness, height, bottom=h, colour=WHITE) for a, b, h in (*spans, *lintels)
    )


def door(hinge: tuple[float, float], yaw_deg: float, width: float = 0.9) -> Box:
    """Return a door leaf 4 cm thick that reaches from its hinge in the direction `yaw_deg`."""
    return _part((*hinge, yaw_deg), width / 2, 0, width, 0.04, 2.0, bottom=0.01, colour=DARK_WOOD)


def desk(x: float, y: float, yaw_deg: float = 0.0) -> tuple[Box, ...]:
    """Return a desk 1.5 m long with drawers under its right end, a screen on it and a chair before it."""
    at = (x, y, yaw_deg)
    chair_x, chair_y = place(*at, -0.2, -0.55)
    return (
        *table(x, y, 1.5, 0.75, yaw_deg, colour=PINE),
        _part(at, 0.50, 0, 0.42, 0.60, 0.60, bottom=0.0, colour=GREY),
        _part(at, -0.1, 0.2, 0.55, 0.04, 1.15, bottom=0.80, colour=STEEL),
        _part(at, -0.1, 0.2, 0.10, 0.10, 0.80, bottom=0.74, colour=STEEL),
        *chair(chair_x, chair_y, yaw_deg + 80.0, FABRIC),
    )
