"""From a map, a way and pictures to a scene."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import RecordingError
from contourslam.scene.blending import blend
from contourslam.scene.bodies import bodies
from contourslam.scene.choice import choose
from contourslam.scene.exposure import Exposure, solve_exposure, trust
from contourslam.scene.extras import check_extras
from contourslam.scene.filling import fill
from contourslam.scene.lens import Lens
from contourslam.scene.mask import robot_mask
from contourslam.scene.occlusion import occluders
from contourslam.scene.raising import SceneOptions, cut_to_height
from contourslam.scene.sampling import take
from contourslam.scene.surface import Surface, TexelGrid, texel_for
from contourslam.scene.views import Views

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

_FILLED = 0.2  # m from the nearest colour up to which holes are filled


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
        As from :func:`contourslam.scene.raising.raise_surfaces`.
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
    MissingExtraError
        If a library of the extra `camera` is not installed.
    """
    check_extras()
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
