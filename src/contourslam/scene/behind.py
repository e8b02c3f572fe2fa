"""Walls that go on behind furniture: what nothing can see past, between two walls that lie in line or meet beyond."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.scene.occlusion import visible
from contourslam.scene.surface import Surface, upright

Floats = NDArray[np.float64]

_LONGEST, _SHORTEST = 4.0, 0.1  # m
_OFFSET, _TURN = 0.06, math.radians(6.0)  # two walls that are in line
_NEAR = 0.6  # m
_CORNER = math.radians(60.0)  # the least turn of two walls that meet behind
_APART = 0.08  # m between the places on the way that are looked from, and on the wall that is looked at
_CLEAR = 0.05  # m


def walls_behind(surfaces: tuple[Surface, ...], heights: list[float | None], poses: Floats) -> tuple[Surface, ...]:
    """Close the gaps between walls that are hidden from everywhere on the way: the lidar saw nothing there.

    A gap into which the robot could look stays open.

    Parameters
    ----------
    surfaces : tuple of Surface
    heights : list of (float or None)
        As found; a wall that is cut is furniture and closes nothing.
    poses : ndarray, shape (n, 3)
        The way of the base.

    Returns
    -------
    tuple of Surface
        "behind-0" and so on, as high as the lower of the two walls that they join.
    """
    whole = whole_walls(surfaces, heights)
    blocks = np.array([[*s.segment.ravel(), 1.0] for s in surfaces if s.kind != "floor"])
    eyes = _thinned(poses)
    found: list[tuple[float, int, int, list[Floats]]] = []
    for a, first in enumerate(whole):
        for b, second in enumerate(whole):
            legs = _legs(first.segment, second.segment) if a != b else None
            if legs is not None and all(_hidden(leg, surfaces, eyes, blocks) for leg in legs):
                found.append((sum(math.dist(*leg) for leg in legs), a, b, legs))
    used = {(side, n) for n, s in enumerate(whole) for side in ("left", "right") if _met(s, side, whole)}
    closed = []
    for _, a, b, legs in sorted(found, key=lambda entry: entry[:3]):
        if ("right", a) not in used and ("left", b) not in used:
            used |= {("right", a), ("left", b)}
            top = min(whole[a].height, whole[b].height)
            closed += [(leg, top) for leg in legs if math.dist(*leg) > _SHORTEST]
    return tuple(upright(f"behind-{n}", "behind", leg[0], leg[1], top) for n, (leg, top) in enumerate(closed))


def whole_walls(surfaces: tuple[Surface, ...], heights: list[float | None]) -> list[Surface]:
    """Give the walls that are not cut, and the contours that are in line with one of them."""
    uncut = [s for s, height in zip(surfaces, heights, strict=True) if height in (None, s.height)]
    walls = [s for s in uncut if s.kind == "wall"]
    return walls + [s for s in uncut if s.kind == "contour" and in_line(s, walls)]


def in_line(surface: Surface, walls: list[Surface]) -> bool:
    """Whether a surface goes on where a wall is: in line with it, near it, and facing as it does."""
    ends = surface.segment
    for wall in walls:
        off = np.abs((ends - wall.segment[0]) @ wall.normal[:2]).max()
        s = (ends - wall.segment[0]) @ wall.across[:2]
        near = s.min() < wall.width + _NEAR and s.max() > -_NEAR
        if off < _OFFSET and near and float(surface.across @ wall.across) > math.cos(_TURN):
            return True
    return False


def _met(surface: Surface, side: str, walls: list[Surface]) -> bool:
    """Whether another wall begins where a wall ends."""
    mine, theirs = (1, 0) if side == "right" else (0, 1)
    return any(math.dist(surface.segment[mine], wall.segment[theirs]) < _SHORTEST for wall in walls)


def _legs(first: Floats, second: Floats) -> list[Floats] | None:
    """What would join the right end of a wall to the left end of another: one segment in line, or two to a corner."""
    along, other = first[1] - first[0], second[1] - second[0]
    along, other = along / np.hypot(*along), other / np.hypot(*other)
    gap = second[0] - first[1]
    turn = math.atan2(along[0] * other[1] - along[1] * other[0], along @ other)
    if abs(turn) < _TURN:
        off = abs(along[0] * gap[1] - along[1] * gap[0])
        return [np.stack([first[1], second[0]])] if off < _OFFSET and _SHORTEST < gap @ along < _LONGEST else None
    if not _CORNER < -turn < math.pi - _CORNER:  # it would run back, or turn to the viewer: furniture, no corner
        return None
    across = along[0] * other[1] - along[1] * other[0]
    s = (gap[0] * other[1] - gap[1] * other[0]) / across
    t = (gap[0] * along[1] - gap[1] * along[0]) / across
    if not (-0.02 < s < _LONGEST and -_LONGEST < t < 0.02 and s - t > _SHORTEST):
        return None
    corner = first[1] + s * along
    return [np.stack([first[1], corner]), np.stack([corner, second[0]])]


def _hidden(leg: Floats, surfaces: tuple[Surface, ...], eyes: Floats, blocks: Floats) -> bool:
    """Whether no place on the way has a leg in sight, but for what stands right on it."""
    count = max(math.ceil(math.dist(*leg) / _APART), 1)
    parts = (np.arange(count) + 0.5) / count
    places = np.column_stack([leg[0] + parts[:, None] * (leg[1] - leg[0]), np.zeros(count)])
    there = np.zeros(count, np.bool_)
    for surface in surfaces:
        if surface.kind != "floor":
            relative = places - surface.origin
            u = relative @ surface.across
            there |= (np.abs(relative @ surface.normal) < _OFFSET) & (u > -_CLEAR) & (u < surface.width + _CLEAR)
    places = np.ascontiguousarray(places[~there])
    return not any(visible(eye, places, blocks, 0.0, _CLEAR).any() for eye in eyes)


def _thinned(poses: Floats) -> Floats:
    """Places of the way on the floor, each a little apart from the one before."""
    steps = np.floor(np.concatenate([[0.0], np.hypot(*np.diff(poses[:, :2], axis=0).T).cumsum()]) / (3.0 * _APART))
    _, first = np.unique(steps, return_index=True)
    return np.column_stack([poses[first, :2], np.zeros(len(first))])
