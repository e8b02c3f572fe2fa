"""A room as a description: walls, what stands in it, the way through; outlines and corners as a lidar sees them."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError, MissingExtraError
from contourslam.simulation.pieces import Box, Cylinder, Piece

Floats = NDArray[np.float64]
_STRAIGHT = 0.01  # rad; a vertex that turns by less is no corner but a seam between two pieces in line
_GRID = 1e-6  # m; pieces that miss each other by a rounding error touch


@dataclass(frozen=True, slots=True)
class TrueCorners:
    """Corners of a room at one height, one row each, in the world frame.

    Attributes
    ----------
    positions : ndarray, shape (c, 2)
        m.
    directions : ndarray, shape (c,)
        Bisector of the two sides, pointing into the angle they enclose, rad in (-pi, pi].
    openings : ndarray, shape (c,)
        Angle between the two sides, in (0, pi), rad.
    convex : ndarray of bool, shape (c,)
        True where matter fills the angle (the edge of a box), false where free space does (the corner of a room).
    sides : ndarray, shape (c,)
        Length of the shorter of the two sides, m.
    """

    positions: Floats
    directions: Floats
    openings: Floats
    convex: NDArray[np.bool_]
    sides: Floats


@dataclass(frozen=True, slots=True)
class Room:
    """A room, all of it: walls, furniture and the lap a robot drives. World frame, m.

    Attributes
    ----------
    name, description : str
        Key in :data:`~contourslam.simulation.rooms.ROOMS`; one line for people.
    outline : tuple of (x, y)
        Inner faces of the walls, counter-clockwise, so that free space lies on the left.
    pieces : tuple of Box or Cylinder
        What stands in it. Boxes may touch or overlap each other and the walls; cylinders stand clear.
    route : tuple of (x, y)
        Waypoints of one lap; the last leads back to the first. The robot starts at the first, facing the second.
    wall_height : float
        m.
    loops : tuple of tuples of (x, y)
        Laps of several robots at once, in turns, that keep to the right of each other; all drive `route` where there
        are none.

    Raises
    ------
    ConfigError
        If the outline is not a counter-clockwise polygon or the route has fewer than three waypoints.
    """

    name: str
    description: str
    outline: tuple[tuple[float, float], ...]
    pieces: tuple[Piece, ...]
    route: tuple[tuple[float, float], ...]
    wall_height: float = 2.4
    loops: tuple[tuple[tuple[float, float], ...], ...] = ()

    def __post_init__(self) -> None:
        if len(self.route) < 3:
            raise ConfigError(f"room {self.name}: the route needs at least three waypoints, got {len(self.route)}")
        x, y = np.array(self.outline, dtype=np.float64).reshape(-1, 2).T
        if len(x) < 3 or np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) <= 0:
            raise ConfigError(f"room {self.name}: the outline must be a polygon listed counter-clockwise")

    @property
    def start(self) -> Floats:
        """Pose at the first waypoint, facing the second: x (m), y (m), heading (rad), shape (3,)."""
        (x, y), (next_x, next_y) = self.route[:2]
        return np.array([x, y, np.arctan2(next_y - y, next_x - x)])

    def segments(self, height: float) -> Floats:
        """Straight outlines of all matter at a height, as seen from the free space the robot can reach.

        Parameters
        ----------
        height : float
            Above the floor, m.

        Returns
        -------
        ndarray, shape (s, 2, 2)
            First and last point of each, m; going from the first to the last, free space lies on the left.

        Raises
        ------
        ConfigError
            If a cylinder touches other matter, or the robot would start inside matter.
        MissingExtraError
            If shapely is not installed.
        """
        rings = _free_rings(self, height)
        return np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings])

    def circles(self, height: float) -> Floats:
        """Round outlines at a height, shape (k, 3): x, y of the centre and radius, m."""
        found = [(p.x, p.y, p.radius) for p in _standing_at(self, height) if isinstance(p, Cylinder)]
        return np.array(found, dtype=np.float64).reshape(-1, 3)

    def corners(self, height: float) -> TrueCorners:
        """Corners of the outlines at a height; round pieces have none. Parameters and errors as :meth:`segments`."""
        from contourslam.geometry.angles import wrap  # here, since it loads Numba and a list of rooms shall be cheap

        rings = _free_rings(self, height)
        points = np.concatenate(rings)
        back = np.concatenate([np.roll(ring, 1, axis=0) - ring for ring in rings])
        ahead = np.concatenate([np.roll(ring, -1, axis=0) - ring for ring in rings])
        lengths = np.stack([np.hypot(*back.T), np.hypot(*ahead.T)])
        direction_back, direction_ahead = np.arctan2(back[:, 1], back[:, 0]), np.arctan2(ahead[:, 1], ahead[:, 0])
        # With free space on the left, a left turn has free space in its angle and a right turn has matter in it.
        turn = wrap(direction_back - direction_ahead)
        return TrueCorners(
            points, wrap(direction_ahead + turn / 2), np.abs(turn), np.asarray(turn < 0), np.min(lengths, axis=0)
        )


def _standing_at(room: Room, height: float) -> list[Piece]:
    return [piece for piece in room.pieces if piece.bottom < height < piece.top]


def free_space(room: Room, height: float) -> Any:
    """Free space at a height that is connected with the robot's start, as a shapely polygon without the cylinders.

    Parameters and errors as :meth:`Room.segments`.
    """
    try:
        import shapely
    except ImportError as error:
        raise MissingExtraError("rooms need shapely: pip install 'contourslam[simulation]'") from error
    pieces = _standing_at(room, height)
    boxes = shapely.union_all([shapely.Polygon(piece.footprint()) for piece in pieces if isinstance(piece, Box)])
    free = shapely.set_precision(shapely.Polygon(room.outline).difference(boxes), _GRID)
    for piece in pieces:
        if isinstance(piece, Cylinder) and not free.contains(shapely.Point(piece.x, piece.y).buffer(piece.radius)):
            raise ConfigError(f"room {room.name}: the cylinder at ({piece.x}, {piece.y}) must stand clear of the rest")
    for part in shapely.get_parts(free):
        if part.contains(shapely.Point(room.route[0])):
            return part
    raise ConfigError(f"room {room.name}: the robot would start inside matter, at {room.route[0]}")


@lru_cache(maxsize=64)
def _free_rings(room: Room, height: float) -> tuple[Floats, ...]:
    """Boundary of the free space, each ring shape (n, 2) without seams, free space on its left."""
    from contourslam.geometry.angles import wrap

    free = free_space(room, height)
    rings = []
    for ring, outer in [(free.exterior, True), *((hole, False) for hole in free.interiors)]:
        points = np.array(ring.coords, dtype=np.float64)[:-1]
        points = points if ring.is_ccw == outer else points[::-1]
        before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
        turn = wrap(np.arctan2(after[:, 1], after[:, 0]) - np.arctan2(before[:, 1], before[:, 0]))
        kept = points[np.abs(turn) > _STRAIGHT]
        kept.flags.writeable = False
        rings.append(kept)
    return tuple(rings)
