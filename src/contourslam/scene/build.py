"""From a map, a way and pictures to a scene."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import MapError, RecordingError
from contourslam.maps.saved_map import SavedMap
from contourslam.scene.atlas import BORDER, LARGEST
from contourslam.scene.behind import in_line, walls_behind, whole_walls
from contourslam.scene.blending import blend
from contourslam.scene.bodies import bodies, lids
from contourslam.scene.choice import choose
from contourslam.scene.exposure import Exposure, solve_exposure, trust
from contourslam.scene.facets import contour_points, find_facets
from contourslam.scene.filling import fill
from contourslam.scene.floor import seen_floor
from contourslam.scene.heights import disagreement, find_heights
from contourslam.scene.lens import Lens
from contourslam.scene.mask import robot_mask
from contourslam.scene.occlusion import occluders
from contourslam.scene.sampling import take
from contourslam.scene.surface import SIDE, Surface, TexelGrid, texel_for, upright
from contourslam.scene.views import Views
from contourslam.scene.walls import Named, clean_walls, join_ends, square_up

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

_REACH = 8.0  # m; the floor is laid as far from the way as this
_FLOOR_CELL = 0.04  # m
_FILLED = 0.2  # m from the nearest colour up to which holes are filled
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


@dataclass(frozen=True, slots=True)
class Scene:
    """Surfaces with their textures.

    Attributes
    ----------
    surfaces : tuple of Surface
    textures : tuple of ndarray of uint8, shape (rows, columns, 3)
        Of each surface, the top row first; what no picture shows is plain and hatched.
    seen : tuple of ndarray of bool, shape (rows, columns)
        Which of their texels have a colour from pictures.
    texel : float
        Side of a texel, m.
    exposure : Exposure
    damaged : int
        How many of the chosen pictures could not be used.
    notes : tuple of str
        What is worth knowing.
    """

    surfaces: tuple[Surface, ...]
    textures: tuple[Bytes, ...]
    seen: tuple[NDArray[np.bool_], ...]
    texel: float
    exposure: Exposure
    damaged: int
    notes: tuple[str, ...] = field(default=())

    def share(self, kind: str) -> float | None:
        """Part of the area of all surfaces of a kind that pictures show; None where there are none."""
        own = [n for n, surface in enumerate(self.surfaces) if surface.kind == kind]
        area = sum(self.surfaces[n].area for n in own)
        return sum(self.seen_part(n) * self.surfaces[n].area for n in own) / area if area else None

    def seen_part(self, index: int) -> float:
        """Part of a surface that pictures show."""
        inside = coverage(self.surfaces[index], self.seen[index].shape)
        return float(self.seen[index][inside].mean()) if inside.any() else 0.0


def coverage(surface: Surface, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which texels of a surface's texture are on one of its parts."""
    if surface.parts is None:
        return np.ones(shape, np.bool_)
    inside = np.zeros(shape, np.bool_)
    scale = np.array([shape[1] / surface.width, shape[0] / surface.height] * 2)
    for left, lower, right, upper in np.round(surface.parts * scale).astype(int).tolist():
        inside[shape[0] - upper : shape[0] - lower, left:right] = True
    return inside


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
    """
    points, keys = contour_points(saved.keyframes)
    walls = clean_walls(saved.walls, points)
    if not walls:
        raise MapError("the map holds no walls, of which a scene is made; map the recording again with --walls")
    facets, columns = find_facets(points, keys, walls)
    longest = min(30.0, options.texel * (LARGEST - 2 * BORDER - SIDE))
    surfaces = []
    for name, segment in _short(join_ends(walls + square_up(facets, walls)) + columns, longest):
        kind = name.partition("-")[0]
        height = options.height if kind == "wall" else options.furniture_height
        surfaces.append(upright(name, kind, segment[0], segment[1], height))
    upright_ones = tuple(surfaces)
    return upright_ones + seen_floor(poses, occluders(upright_ones), _REACH, _FLOOR_CELL)


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
    floors = seen_floor(poses, occluders(standing), _REACH, _FLOOR_CELL)
    return (*standing, *lids(standing, options.height), *floors)


def _settled(surface: Surface, found: float | None, walls: list[Surface], options: SceneOptions) -> float:
    """Height of a surface: as found, or what it usually is."""
    if found is not None:
        return found
    return options.height if surface.kind == "wall" or in_line(surface, walls) else options.furniture_height


def _lid_colours(
    surfaces: tuple[Surface, ...], images: list[Bytes], seen: list[NDArray[np.bool_]]
) -> dict[str, Floats]:
    """Colour of each lid: the mean of the upper half of that side of the same thing that is seen best."""
    colours = {}
    for group in bodies(surfaces):
        for side in sorted(group, key=lambda n: int(seen[n].sum())):  # the best last
            upper = slice(0, max(len(images[side]) // 2, 1))
            known = images[side][upper][seen[side][upper]]
            if len(known):
                colours.update({f"top-of-{surfaces[n].name}": known.mean(axis=0) for n in group})
    return colours


def build_scene(
    surfaces: tuple[Surface, ...],
    poses: Floats,
    views: Views,
    lens: Lens,
    options: SceneOptions,
    told: Callable[[float], None] = lambda done: None,
) -> Scene:
    """Colour surfaces from pictures.

    Parameters
    ----------
    surfaces : tuple of Surface
        As from :func:`raise_surfaces`.
    poses : ndarray, shape (n, 3)
        The way of the base.
    views : Views
    lens : Lens
    options : SceneOptions
    told : callable
        Called with the fraction done.

    Raises
    ------
    RecordingError
        If no picture can be used.
    """
    if not views.chosen:
        raise RecordingError(
            f"none of the {views.seen} pictures was taken while the trajectory lasts; is it another recording's?"
        )
    lens = lens.without(robot_mask(views.chosen, lens))
    begun = 0.4 if options.find_heights else 0.0
    if options.find_heights:
        surfaces = cut_to_height(surfaces, poses, views, lens, options, lambda done: told(begun * done))

    def rest(done: float) -> None:
        told(begun + (1.0 - begun) * done)

    texel = texel_for(surfaces, options.texel, options.most_texels)
    grid, blocks = TexelGrid.over(surfaces, texel), occluders(surfaces)
    choice = choose(grid, views.chosen, lens, blocks, texel, lambda done: rest(0.35 * done))
    samples = take(grid, choice, views.chosen, lens, blocks, texel, lambda done: rest(0.35 + 0.55 * done))
    if samples.damaged == len(views.chosen):
        size = f"{lens.model.width} by {lens.model.height}"
        raise RecordingError(f"none of the pictures can be decoded to {size} pixels, the camera's size")
    exposure = solve_exposure(choice, samples, len(views.chosen))
    trusted = np.where(choice.views >= 0, trust(exposure)[choice.views], 0.0).astype(np.float32)
    colours, count = blend(samples.colours, samples.weights, exposure.factors(choice), trusted)
    rest(0.95)
    seen = [grid.image(index, count > 0) for index in range(len(surfaces))]
    images = [grid.image(index, colours) for index in range(len(surfaces))]
    likes = _lid_colours(surfaces, images, seen)
    textures = [
        fill(image, mask, round(_FILLED / texel), likes.get(surface.name))
        for surface, image, mask in zip(surfaces, images, seen, strict=True)
    ]
    notes = []
    if texel > options.texel:
        notes.append(
            f"a texel is {100 * texel:.1f} cm wide, not {100 * options.texel:.1f}, so that the file stays small"
        )
    rest(1.0)
    return Scene(surfaces, tuple(textures), tuple(seen), texel, exposure, samples.damaged, tuple(notes))
