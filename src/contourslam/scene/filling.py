"""Holes of a texture: small ones are filled from their borders, large ones are left plain and hatched."""

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Bools = NDArray[np.bool_]
Singles = NDArray[np.float32]

_GREY, _GREYED = 168.0, 0.6  # what no picture shows is this far on the way to this grey,
_STROKE, _STRIPE = 12.0, 12  # with strokes that are darker, so many texels apart


def fill(image: Bytes, seen: Bools, reach: int, like: NDArray[np.float64] | None = None) -> Bytes:
    """Fill the holes of a texture.

    Parameters
    ----------
    image : ndarray of uint8, shape (rows, columns, 3)
    seen : ndarray of bool, shape (rows, columns)
        Which texels have a colour.
    reach : int
        How many texels from the nearest colour are still filled from there.
    like : ndarray, shape (3,), optional
        Colour of what is not seen, where nothing at all is; it stays free of strokes.

    Returns
    -------
    ndarray of uint8, shape (rows, columns, 3)
    """
    import cv2

    if seen.all():
        return image
    if not seen.any():
        plain = np.full(3, _GREY) if like is None else like
        base = np.broadcast_to(plain, image.shape).astype(np.float32)
        return _hatched(base) if like is None else np.asarray(base, np.uint8)
    spread = _spread(cv2, image, seen)
    mean = image[seen].mean(axis=0)
    out = _hatched(0.5 * (1.0 - _GREYED) * (spread.astype(np.float32) + mean) + _GREYED * _GREY)
    away = np.asarray(cv2.distanceTransform((~seen).astype(np.uint8), cv2.DIST_L2, 3))
    close = ~seen & (away <= reach)
    out[close] = spread[close]
    out[seen] = image[seen]
    return out


def _hatched(base: Singles) -> Bytes:
    """Draw strokes."""
    rows, columns = np.indices(base.shape[:2])
    stroke = np.asarray((rows + columns) % _STRIPE < 2)[..., None]
    return np.asarray(np.clip(base - _STROKE * stroke, 0.0, 255.0), np.uint8)


def _spread(cv2: object, image: Bytes, seen: Bools) -> Bytes:
    """Spread colours into holes, the finer ones first (Gortler et al. 1996, the lumigraph's pull and push)."""
    colour, weight = image.astype(np.float32) * seen[..., None], seen.astype(np.float32)
    levels = [(colour, weight)]
    while min(levels[-1][1].shape) > 1:
        colour, weight = (_halved(part) for part in levels[-1])
        scale = np.minimum(weight, 1.0) / np.maximum(weight, 1e-9)
        levels.append((np.asarray(colour * scale[..., None], np.float32), np.asarray(weight * scale, np.float32)))
    below = levels[-1][0] / np.maximum(levels[-1][1], 1e-9)[..., None]
    for colour, weight in levels[-2::-1]:
        size = weight.shape[::-1]
        wide = cv2.resize(below, size, interpolation=cv2.INTER_LINEAR)  # type: ignore[attr-defined]
        below = colour + (1.0 - np.minimum(weight, 1.0))[..., None] * wide.reshape(colour.shape)
    return np.clip(below + 0.5, 0.0, 255.0).astype(np.uint8)


def _halved(part: Singles) -> Singles:
    """Sum of two by two neighbours."""
    rows, columns = part.shape[:2]
    padded = np.pad(part, ((0, rows % 2), (0, columns % 2), *((0, 0),) * (part.ndim - 2)))
    summed: Singles = padded[::2, ::2] + padded[1::2, ::2] + padded[::2, 1::2] + padded[1::2, 1::2]
    return summed
