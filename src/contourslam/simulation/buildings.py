"""Office floors of any size, drawn from a seed: corridors that look alike, rooms behind doors, furniture."""

from dataclasses import dataclass

import numpy as np

from contourslam.errors import ConfigError
from contourslam.simulation.blocks import STOREY, Block, Plan
from contourslam.simulation.pieces import GREY, Box, Piece
from contourslam.simulation.room import Room
from contourslam.simulation.ways import Doorway, Junction, Stretch, first_lap

_CORRIDORS, _BLOCKS, _MARGIN = (2.0, 2.2, 2.4), (9.6, 10.8, 12.0, 14.4), 4.6  # m, of which sizes are drawn
_CLOSED_OFF = 0.15  # share of the corridor stretches
_MOST_CORRIDORS = 40


@dataclass(frozen=True, slots=True)
class Building:
    """An office floor, with what a driver knows of it.

    Attributes
    ----------
    room : Room
        Its walls and furniture; the route goes once round the first block and into a room on the way.
    junctions : dict
        Where corridors cross: (x, y) in m by (column, row).
    stretches : dict
        The doorways of each stretch of corridor that can be driven through, by the two junctions at its ends, the
        western or southern first.
    """

    room: Room
    junctions: dict[Junction, tuple[float, float]]
    stretches: dict[Stretch, tuple[Doorway, ...]]


def office_building(corridors: int = 4, seed: int = 0) -> Building:
    """Draw an office floor.

    Parameters
    ----------
    corridors : int
        How many corridors run in each direction, about 14 m apart; from 2 to 40.
    seed : int
        The same seed gives the same building.

    Returns
    -------
    Building

    Raises
    ------
    ConfigError
        If the number of corridors is out of bounds.
    """
    if not 2 <= corridors <= _MOST_CORRIDORS:
        raise ConfigError(f"office_building: corridors must be 2 to {_MOST_CORRIDORS}, got {corridors!r}")
    chance = np.random.default_rng([seed, corridors])
    columns, rows = _bands(corridors, chance), _bands(corridors, chance)
    junctions = {
        (i, j): ((columns[i][1] + columns[i + 1][0]) / 2, (rows[j][1] + rows[j + 1][0]) / 2)
        for i in range(corridors)
        for j in range(corridors)
    }
    stretches: dict[Stretch, tuple[Doorway, ...]] = dict.fromkeys(_stretches(corridors), ())
    closed = _closed_off(list(stretches), chance)
    plans: dict[tuple[float, int], Plan] = {}
    pieces: list[Piece] = []
    for c, (x0, x1) in enumerate(columns):
        for r, (y0, y1) in enumerate(rows):
            block = Block((x0, x1, y0, y1), _sides(c, r, corridors), closed, plans, chance)
            pieces += block.pieces
            for stretch, doorways in block.doorways.items():
                stretches[stretch] += doorways
    for stretch in closed:
        pieces.append(_fire_door(junctions[stretch[0]], junctions[stretch[1]]))
        del stretches[stretch]
    width, depth = columns[-1][1], rows[-1][1]
    room = Room(
        name="office_building",
        description=f"{width:.0f} x {depth:.0f} m office floor: {corridors} by {corridors} corridors, rooms, furniture",
        outline=((0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)),
        pieces=tuple(pieces),
        route=first_lap(junctions, stretches),
        wall_height=STOREY,
    )
    return Building(room, junctions, stretches)


def _bands(corridors: int, chance: np.random.Generator) -> list[tuple[float, float]]:
    """From where to where the blocks between the corridors reach along one axis, m."""
    at, found = 0.0, []
    for index in range(corridors + 1):
        size = _MARGIN if index in (0, corridors) else float(chance.choice(_BLOCKS))
        found.append((round(at, 6), round(at + size, 6)))
        at += size + float(chance.choice(_CORRIDORS))
    return found


def _stretches(corridors: int) -> list[Stretch]:
    along = [((i, j), (i + 1, j)) for i in range(corridors - 1) for j in range(corridors)]
    return along + [((j, i), (j, i + 1)) for i in range(corridors - 1) for j in range(corridors)]


def _closed_off(stretches: list[Stretch], chance: np.random.Generator) -> list[Stretch]:
    """Some stretches whose fire doors are shut; every junction keeps two ways out and can be reached."""
    ways: dict[Junction, set[Junction]] = {}
    for a, b in stretches:
        ways.setdefault(a, set()).add(b)
        ways.setdefault(b, set()).add(a)
    closed: list[Stretch] = []
    for index in chance.permutation(len(stretches)).tolist():
        a, b = stretches[index]
        # The first block's lap stays open: it is the room's route.
        if len(closed) >= _CLOSED_OFF * len(stretches) or max(*a, *b) <= 1:
            continue
        if min(len(ways[a]), len(ways[b])) < 3:
            continue
        ways[a].remove(b)
        ways[b].remove(a)
        if _reached(ways) < len(ways):
            ways[a].add(b)
            ways[b].add(a)
        else:
            closed.append((a, b))
    return closed


def _reached(ways: dict[Junction, set[Junction]]) -> int:
    seen, waiting = {(0, 0)}, [(0, 0)]
    while waiting:
        for following in ways[waiting.pop()] - seen:
            seen.add(following)
            waiting.append(following)
    return len(seen)


def _fire_door(a: tuple[float, float], b: tuple[float, float]) -> Box:
    """A shut door across a corridor, halfway between two junctions; it reaches into the walls."""
    yaw_deg = 0.0 if a[0] == b[0] else 90.0
    return Box((a[0] + b[0]) / 2, (a[1] + b[1]) / 2, max(_CORRIDORS) + 2 * 0.04, 0.08, STOREY, yaw_deg, colour=GREY)


def _sides(c: int, r: int, corridors: int) -> dict[str, Stretch | None]:
    """The stretch of corridor along each side of a block: None beside the end of a corridor; no entry at the facade."""
    inside_c, inside_r = 1 <= c < corridors, 1 <= r < corridors
    found: dict[str, Stretch | None] = {}
    if r > 0:
        found["south"] = ((c - 1, r - 1), (c, r - 1)) if inside_c else None
    if r < corridors:
        found["north"] = ((c - 1, r), (c, r)) if inside_c else None
    if c > 0:
        found["west"] = ((c - 1, r - 1), (c - 1, r)) if inside_r else None
    if c < corridors:
        found["east"] = ((c, r - 1), (c, r)) if inside_r else None
    return found
