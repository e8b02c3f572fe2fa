"""Surfaces that stand around one thing, and the lids on such things."""

import numpy as np
from numpy.typing import NDArray

from contourslam.scene.floor import rectangles
from contourslam.scene.surface import FLAT, Surface

Floats = NDArray[np.float64]

_CONVEX, _MEETS = 0.1, 0.12  # sine of the turn, m
_CELL = 0.02  # m
_DEEPEST = 1.2  # m from the front of a thing to the wall behind it


def bodies(surfaces: tuple[Surface, ...]) -> list[list[int]]:
    """Find the surfaces that meet in corners around matter: the sides of one thing.

    Returns
    -------
    list of list of int
        Each upright surface is in one of them.
    """
    upright = [n for n, s in enumerate(surfaces) if s.kind not in FLAT]
    group = {n: n for n in upright}
    for a in upright:
        for b in upright:
            first, second = surfaces[a], surfaces[b]
            turn = first.across[0] * second.across[1] - first.across[1] * second.across[0]
            if turn > _CONVEX and np.hypot(*(first.segment[1] - second.segment[0])) < _MEETS:
                old, new = group[b], group[a]
                group = {n: new if number == old else number for n, number in group.items()}
    return [[n for n in upright if group[n] == number] for number in sorted(set(group.values()))]


def lids(surfaces: tuple[Surface, ...], full: float) -> tuple[Surface, ...]:
    """Lay lids on things that do not reach up to the full height; what is under them is not seen from above.

    A thing of which two sides are seen is taken for a box, and one of which only the front is for as deep as the way
    to the wall behind.

    Parameters
    ----------
    surfaces : tuple of Surface
        With the heights that they really have.
    full : float
        Height of the walls, m.

    Returns
    -------
    tuple of Surface
        "top-of-" and the name of the longest side.
    """
    found = []
    for group in bodies(surfaces):
        sides = [surfaces[n] for n in group if surfaces[n].kind in ("wall", "contour")]
        top = max((side.height for side in sides), default=full)
        if top > full - 0.05:
            continue
        longest = max(sides, key=lambda side: side.width)
        outline = _outline(sides, surfaces)
        if outline is not None:
            found.append(_lid(longest, outline, top))
    return tuple(found)


def _outline(sides: list[Surface], surfaces: tuple[Surface, ...]) -> Floats | None:
    """Corners of a thing as seen from above, shape (n, 2)."""
    ends = np.concatenate([side.segment for side in sides])
    if len(sides) == 1:
        depths = [_depth(end, sides[0], surfaces) for end in ends]
        depth = min((d for d in depths if d is not None), default=None)
        return None if depth is None else np.concatenate([ends, ends - depth * sides[0].normal[:2]])
    if len(sides) == 2:
        first, second = sides if np.hypot(*(sides[0].segment[1] - sides[1].segment[0])) < _MEETS else sides[::-1]
        corner = 0.5 * (first.segment[1] + second.segment[0])
        return np.concatenate([ends, [first.segment[0] + second.segment[1] - corner]])
    return ends


def _depth(end: Floats, side: Surface, surfaces: tuple[Surface, ...]) -> float | None:
    """How far behind one end of a front a wall stands that faces as the front does, m."""
    nearest = None
    for wall in surfaces:
        if wall.kind not in ("wall", "behind") or wall is side or float(wall.normal @ side.normal) < 0.9:
            continue
        distance = float((end - wall.segment[0]) @ wall.normal[:2])
        u = float((end - wall.segment[0]) @ wall.across[:2])
        if 0.05 < distance < _DEEPEST and -0.1 < u < wall.width + 0.1:
            nearest = distance if nearest is None else min(nearest, distance)
    return nearest


def _lid(side: Surface, outline: Floats, top: float) -> Surface:
    """A flat surface at a height, its lower edge along a side."""
    import cv2

    into = -side.normal
    local = np.stack([(outline - side.segment[0]) @ side.across[:2], (outline - side.segment[0]) @ into[:2]], axis=1)
    low = local.min(axis=0)
    columns, rows = (max(int(n), 1) for n in np.ceil((local.max(axis=0) - low) / _CELL))
    hull = cv2.convexHull(((local - low) / _CELL * 16 - 8).astype(np.int32))
    inside = np.zeros((rows, columns), np.uint8)
    cv2.fillPoly(inside, [np.asarray(hull)], 1, shift=4)
    origin = np.append(side.segment[0], top) + low[0] * side.across + low[1] * into
    parts = _CELL * rectangles(inside.astype(np.bool_))
    return Surface(f"top-of-{side.name}", "top", origin, side.across, into, columns * _CELL, rows * _CELL, parts)
