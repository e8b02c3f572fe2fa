"""Rooms that look alike as buildings do: bare ones, one that is its own half turn, one plan furnished twice."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError
from contourslam.experiments.relocalisation import BODY, HEIGHT
from contourslam.simulation.pieces import Box, Piece
from contourslam.simulation.room import Room, free_space

BARE, TURNING = (9.0, 6.0), (10.0, 7.0)  # m
ROUND = ((1.0, 1.0), (0.9, 0.12), (0.88, 0.85), (0.15, 0.9), (0.12, 0.2), (0.5, 0.12))  # ways, as parts of a room
TALL = 2.3  # m; what is higher is part of the building


def bare_room() -> Room:
    """Draw an empty room of four walls, with a way round it."""
    return _room("bare", BARE, ())


def half_turn_room(seed: int) -> Room:
    """Draw a room that looks the same after half a turn, with a way round it.

    Parameters
    ----------
    seed : int
        Of its furniture.
    """
    chance, (length, width) = np.random.default_rng([seed, 180]), TURNING
    pieces: list[Piece] = []
    for x, y in ((0.3, 3.2), (3.6, 6.6), (4.2, 2.9)):
        long, wide, turn = chance.uniform((0.4, 0.3, -40.0), (1.0, 0.6, 40.0)).tolist()
        x, y = x + chance.uniform(-0.2, 0.2), y + chance.uniform(-0.2, 0.2)
        pieces += [Box(x, y, long, wide, 1.5, turn), Box(length - x, width - y, long, wide, 1.5, turn + 180.0)]
    return _room("half_turn", TURNING, tuple(pieces))


def _room(name: str, size: tuple[float, float], pieces: tuple[Piece, ...]) -> Room:
    length, width = size
    way = tuple((x * length, y * width) for x, y in ROUND[1:])
    return Room(name, "a room to be taken for another", ((0.0, 0.0), (length, 0.0), size, (0.0, width)), pieces, way)


def furnished_anew(room: Room, share: float, seed: int) -> Room:
    """The same walls with other furniture, clear of the room's route.

    Parameters
    ----------
    room : Room
    share : float
        Of the pieces of furniture that make place for others, elsewhere.
    seed : int
    """
    import shapely

    chance = np.random.default_rng([seed, 70])
    corners = np.array(room.outline)
    low, high = corners.min(axis=0) + 0.5, corners.max(axis=0) - 0.5
    route = shapely.LineString([*room.route, room.route[0]]).buffer(BODY + 0.15)

    def other(piece: Box) -> Box:
        while True:
            (x, y), size = chance.uniform(low, high).tolist(), chance.uniform((0.4, 0.3), (1.6, 0.7))
            new = replace(
                piece, x=x, y=y, length=float(size[0]), width=float(size[1]), yaw_deg=float(chance.uniform(-90.0, 90.0))
            )
            if not route.intersects(shapely.Polygon(new.footprint())):
                return new

    while True:
        chosen: NDArray[np.bool_] = chance.random(len(room.pieces)) < share
        pieces = tuple(
            other(piece) if new and isinstance(piece, Box) and piece.bottom < HEIGHT < piece.top < TALL else piece
            for piece, new in zip(room.pieces, chosen.tolist(), strict=True)
        )
        changed = replace(room, pieces=pieces)
        try:
            free_space(changed, HEIGHT)
        except ConfigError:  # against a column
            continue
        return changed
