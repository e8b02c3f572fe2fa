"""Surfaces raised from a map: walls, furniture and floor, and how high each is."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import MapError
from contourslam.maps.saved_map import SavedMap
from contourslam.scene.atlas import BORDER, LARGEST
from contourslam.scene.behind import in_line, walls_behind, whole_walls
from contourslam.scene.bodies import lids
from contourslam.scene.choice import choose
from contourslam.scene.exposure import solve_exposure
from contourslam.scene.extras import check_extras
from contourslam.scene.facets import contour_points, find_facets
from contourslam.scene.floor import seen_floor
from contourslam.scene.heights import disagreement, find_heights
from contourslam.scene.lens import Lens
from contourslam.scene.occlusion import occluders
from contourslam.scene.sampling import take
from contourslam.scene.surface import SIDE, Surface, TexelGrid, texel_for, upright
from contourslam.scene.views import Views
from contourslam.scene.walls import Named, clean_walls, join_ends, square_up

Floats = NDArray[np.float64]

_REACH = 8.0  # m; the floor is laid as far from the way as this
_FLOOR_CELL = 0.04  # m
_MOST_TEXELS = 6_000_000


@dataclass(frozen=True, slots=True)
class SceneOptions:
    """How a scene is built.

    Attributes
    ----------
    height : float
        Of the walls, m.
    furniture_height : float
        Of what contours show beside the walls, where pictures do not tell, m.
    find_heights : bool
        Find from the pictures how high each surface really is; else all are as high as the two values say.
    texel : float
        Side of a texel, m; it grows where the scene would have more than `most_texels`.
    most_texels : int
    """

    height: float = 2.5
    furniture_height: float = 0.8
    find_heights: bool = True
    texel: float = 0.015
    most_texels: int = _MOST_TEXELS


def raise_surfaces(saved: SavedMap, poses: Floats, options: SceneOptions) -> tuple[Surface, ...]:
    """Raise the walls and the contours of a map from the floor, and lay the floor.

    Parameters
    ----------
    saved : SavedMap
        Without keyframes there are no contours, and walls are as long as the map says.
    poses : ndarray, shape (n, 3)
        The way of the base, m, m, rad.
    options : SceneOptions

    Raises
    ------
    MapError
        If the map has no walls.
    MissingExtraError
        If a library of the extra `camera` is not installed.
    """
    check_extras()
    points, keys = contour_points(saved.keyframes)
    walls = clean_walls(saved.walls, points)
    if not walls:
        raise MapError("the map holds no walls, of which a scene is made; map the recording again with --walls")
    facets, columns = find_facets(points, keys, walls)
    longest = _longest(options)
    surfaces = []
    for name, segment in _short(join_ends(walls + square_up(facets, walls)) + columns, longest):
        kind = name.partition("-")[0]
        height = options.height if kind == "wall" else options.furniture_height
        surfaces.append(upright(name, kind, segment[0], segment[1], height))
    upright_ones = tuple(surfaces)
    return upright_ones + seen_floor(poses, occluders(upright_ones), _REACH, _FLOOR_CELL, longest)


def _longest(options: SceneOptions) -> float:
    """Longest side of a piece that a sheet has room for, m."""
    return min(30.0, options.texel * (LARGEST - 2 * BORDER - SIDE))


def _short(segments: Named, longest: float) -> Named:
    """Cut segments into pieces that a sheet has room for."""
    cut = []
    for name, segment in segments:
        pieces = max(math.ceil(math.dist(*segment) / longest), 1)
        knots = segment[0] + np.linspace(0.0, 1.0, pieces + 1)[:, None] * (segment[1] - segment[0])
        names = [name] if pieces == 1 else [f"{name}-{n}" for n in range(pieces)]
        cut += [(each, knots[n : n + 2]) for n, each in enumerate(names)]
    return [(name, segment) for name, segment in cut if math.dist(*segment) > 0.02]


def cut_to_height(
    surfaces: tuple[Surface, ...],
    poses: Floats,
    views: Views,
    lens: Lens,
    options: SceneOptions,
    told: Callable[[float], None] = lambda done: None,
) -> tuple[Surface, ...]:
    """Find from pictures how high each surface is, and close the walls behind furniture.

    Parameters
    ----------
    surfaces : tuple of Surface
    poses : ndarray, shape (n, 3)
        The way of the base.
    views : Views
    lens : Lens
    options : SceneOptions
    told : callable
        Called with the fraction done.
    """
    top = max(options.height, options.furniture_height)
    looked_at = tuple(s.cut(top) for s in surfaces if s.kind != "floor")
    texel = texel_for(looked_at, options.texel, options.most_texels)
    grid, blocks = TexelGrid.over(looked_at, texel), occluders(looked_at)
    choice = choose(grid, views.chosen, lens, blocks, texel, lambda done: told(0.4 * done))
    samples = take(grid, choice, views.chosen, lens, blocks, texel, lambda done: told(0.4 + 0.6 * done))
    factors = solve_exposure(choice, samples, len(views.chosen)).factors(choice)
    heights = find_heights(grid, *disagreement(grid, texel, samples.colours, samples.weights, factors))
    closed = walls_behind(looked_at, heights, poses)
    walls = [*whole_walls(looked_at, heights), *closed]
    cut = [s.cut(_settled(s, h, walls, options)) for s, h in zip(looked_at, heights, strict=True)]
    standing = (*cut, *(s.cut(options.height) for s in closed))
    floors = seen_floor(poses, occluders(standing), _REACH, _FLOOR_CELL, _longest(options))
    return (*standing, *lids(standing, options.height), *floors)


def _settled(surface: Surface, found: float | None, walls: list[Surface], options: SceneOptions) -> float:
    """Height of a surface: as found, or what it usually is."""
    if found is not None:
        return found
    return options.height if surface.kind == "wall" or in_line(surface, walls) else options.furniture_height
