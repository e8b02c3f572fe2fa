"""Colours taken from the pictures: for each texel one from each picture that its cell has chosen."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.recordings.picture import Picture
from contourslam.scene.choice import CLEARANCE, MARGIN, SLOTS, TEXELS, Choice, steadiness
from contourslam.scene.lens import Lens
from contourslam.scene.occlusion import visible
from contourslam.scene.surface import SIDE, TexelGrid
from contourslam.scene.views import View

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

_LEVELS = 3  # how often a picture is halved for texels that are larger than its pixels


@dataclass(frozen=True, slots=True)
class Samples:
    """Colours of texels, one for each slot of their cells.

    Attributes
    ----------
    colours : ndarray of uint8, shape (cells, SIDE * SIDE, SLOTS, 3)
        Red, green, blue.
    weights : ndarray of uint8, shape (cells, SIDE * SIDE, SLOTS)
        How well each was seen; 0 where it was not.
    damaged : int
        How many pictures could not be decoded, or are not of the camera's size.
    """

    colours: Bytes
    weights: Bytes
    damaged: int


def decode(picture: Picture, model: FisheyeModel) -> Bytes | None:
    """Decode a picture, shape (height, width, 3); None where it is damaged or of another size than the camera's."""
    from PIL import Image

    try:
        with Image.open(io.BytesIO(picture.data), formats=("JPEG", "PNG")) as image:
            if image.size != (model.width, model.height):
                return None
            return np.asarray(image.convert("RGB"))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):  # Pillow raises all of these
        return None


def take(
    grid: TexelGrid,
    choice: Choice,
    views: tuple[View, ...],
    lens: Lens,
    blocks: Floats,
    texel: float,
    told: Callable[[float], None] = lambda done: None,
) -> Samples:
    """Take the colours out of the pictures, each of which is decoded once.

    Parameters
    ----------
    grid, choice, views, lens, blocks, texel, told
        As for :func:`contourslam.scene.choice.choose`.
    """
    colours = np.zeros((grid.cells, SIDE * SIDE, SLOTS, 3), np.uint8)
    weights = np.zeros((grid.cells, SIDE * SIDE, SLOTS), np.uint8)
    flat = choice.views.ravel()
    order = np.argsort(flat, kind="stable")
    bounds = np.searchsorted(flat[order], np.arange(len(views) + 1))
    damaged = 0
    for number, view in enumerate(views):
        told(number / len(views))
        picked = order[bounds[number] : bounds[number + 1]]
        if not len(picked):
            continue
        picture = decode(view.picture, lens.model)
        if picture is None:
            damaged += 1
            continue
        levels = _levels(picture)
        cells, slots = np.divmod(picked, SLOTS)
        stand = lens.stand(view.pose)
        owner = grid.surface_of(cells)
        for index in np.unique(owner).tolist():
            own, slot = cells[owner == index], int(slots[0])
            places = grid.places(own, TEXELS).reshape(-1, 3)
            sight = lens.look(stand, places, grid.surfaces[index].normal, texel)
            seen = (sight.scores > 0.0) & visible(stand[:3, 3], places, blocks, MARGIN, CLEARANCE)
            taken = _sample(levels, sight.pixels, sight.density * texel)
            worth = np.clip(sight.scores * steadiness(view) * 255.0, 1.0, 255.0) * seen
            colours[own, :, slot] = taken.reshape(len(own), -1, 3)
            weights[own, :, slot] = worth.reshape(len(own), -1).astype(np.uint8)
    return Samples(colours, weights, damaged)


def _levels(picture: Bytes) -> list[Any]:
    import cv2

    levels: list[Any] = [picture]
    for _ in range(_LEVELS - 1):
        levels.append(np.asarray(cv2.pyrDown(levels[-1])))
    return levels


def _sample(levels: list[Any], pixels: Floats, each: Floats) -> Bytes:
    """Colours at pixels, from the level whose pixels are about as large as a texel."""
    import cv2

    level = np.clip(np.round(np.log2(np.maximum(each, 1e-3))), 0, len(levels) - 1).astype(np.int64)
    out = np.zeros((len(pixels), 3), np.uint8)
    for number, image in enumerate(levels):
        these = np.flatnonzero(level == number)
        if not len(these):
            continue
        at = np.nan_to_num(pixels[these] / 2**number, nan=-1e4).astype(np.float32)
        for first in range(0, len(these), 30000):  # OpenCV's remap takes no more rows than this
            part = at[first : first + 30000]
            found = cv2.remap(
                image, part[:, None, 0], part[:, None, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
            )
            out[these[first : first + 30000]] = found[:, 0]
    return out
