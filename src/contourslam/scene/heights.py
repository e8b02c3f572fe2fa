"""How high the surfaces are: above its upper edge a surface shows what is behind it, on which pictures disagree."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel
from contourslam.scene.bodies import bodies
from contourslam.scene.surface import SIDE, Surface, TexelGrid

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]
Singles = NDArray[np.float32]

_FEWEST = 3  # pictures that can disagree
_FAIR = 0.3  # of the best weight; what is seen worse is left out
_SHIFT = 0.03  # m by which pictures may be shifted against each other
_DIFFERENT = 5.0  # mean difference between pictures, of 255, that is more than noise
_WINDOW = 0.3  # m below and above an edge
_KNOWN = 0.4  # of the width that must be known to tell
_FEW, _NONE = 0.2, 0.1  # of the width that disagrees below an edge at the most, and where there is none
_ABOVE, _ALL_ABOVE = 0.75, 0.85  # of the width that disagrees just above an edge, and all the way up
_LOWEST = 0.15  # m
_BOX, _APART = 4, 0.15  # sides; m, by which the sides of one thing may differ
_ALIKE = 30.0  # of 255
_ABOVE_EDGE = 0.02  # m by which edges are found too high: small shifts count as agreement


def disagreement(
    grid: TexelGrid, texel: float, colours: Bytes, weights: Bytes, factors: Singles
) -> tuple[Singles, Singles]:
    """How far pictures differ on each texel, by more than a small shift of one of them explains.

    What counts is by how much a picture's colour leaves the range that the best picture shows nearby.

    Parameters
    ----------
    grid : TexelGrid
    texel : float
        Side of a texel, m.
    colours : ndarray of uint8, shape (cells, t, slots, 3)
    weights : ndarray of uint8, shape (cells, t, slots)
    factors : ndarray of float32, shape (cells, slots, 3)
        What the colours are multiplied by.

    Returns
    -------
    differences : ndarray of float32, shape (cells, t)
        Of 255; NaN where fewer than three pictures show it.
    best : ndarray of float32, shape (cells, t, 3)
        The colours in the best picture of each.
    """
    import cv2

    best = np.zeros((*weights.shape[:2], 3), np.float32)
    _best(colours, weights, factors, best)
    low, high = np.empty_like(best), np.empty_like(best)
    reach = max(round(_SHIFT / texel), 1)
    nearby = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
    for index in range(len(grid.surfaces)):
        image = np.ascontiguousarray(grid.image(index, best))
        for out, extreme in ((low, cv2.erode), (high, cv2.dilate)):
            grid.put(index, out, np.asarray(extreme(image, nearby)))
    out = np.empty(weights.shape[:2], np.float32)
    _excess(colours, weights, factors, low, high, out)
    return out, best


@kernel
def _best(colours: Bytes, weights: Bytes, factors: Singles, out: Singles) -> None:
    """Colour of each texel in the picture that shows it best."""
    cells, texels, slots, _ = colours.shape
    for c in range(cells):
        for t in range(texels):
            best = 0
            for s in range(1, slots):
                if weights[c, t, s] > weights[c, t, best]:
                    best = s
            for k in range(3):
                out[c, t, k] = colours[c, t, best, k] * factors[c, best, k]


@kernel
def _excess(colours: Bytes, weights: Bytes, factors: Singles, low: Singles, high: Singles, out: Singles) -> None:
    """Weighted mean of how far colours lie outside a range."""
    cells, texels, slots, _ = colours.shape
    for c in range(cells):
        for t in range(texels):
            best = 0
            for s in range(slots):
                best = max(best, weights[c, t, s])
            n, total, summed = 0, 0.0, 0.0
            for s in range(slots):
                w = float(weights[c, t, s])
                if w < _FAIR * best or w == 0.0:
                    continue
                n += 1
                if w < best:  # the range is the best picture's own
                    total += w
                    for k in range(3):
                        value = colours[c, t, s, k] * factors[c, s, k]
                        summed += w * max(low[c, t, k] - value, value - high[c, t, k], 0.0) / 3.0
            out[c, t] = summed / total if n >= _FEWEST and total > 0.0 else np.nan


def find_heights(grid: TexelGrid, differences: Singles, best: Singles) -> list[float | None]:
    """Find the heights of upright surfaces that were coloured higher than they may be.

    Parameters
    ----------
    grid : TexelGrid
    differences, best
        As from :func:`disagreement`.

    Returns
    -------
    list of (float or None)
        Of each surface, m; None where pictures do not tell, and for the floor. What only corners show of a piece of
        furniture is as high as the rest of it.
    """
    heights = [
        None if s.kind == "floor" else _height(grid.image(n, differences)[::-1], grid.image(n, best)[::-1], s)
        for n, s in enumerate(grid.surfaces)
    ]
    for group in bodies(grid.surfaces):
        told = sorted((h, grid.surfaces[n].width) for n in group if (h := heights[n]) is not None)
        edges = [(h, width) for h, width in told if h < max(grid.surfaces[n].height for n in group)]
        if sum(width for _, width in edges) >= 0.5 * sum(width for _, width in told):
            told = edges  # an edge that is seen says more than none that is seen
        if told:
            half = np.searchsorted(np.cumsum([width for _, width in told]), 0.5 * sum(width for _, width in told))
            middle = told[int(half)][0]
            for n in group:  # the sides of a round column are too narrow to tell each for itself
                own = heights[n]
                if own is None or abs(own - middle) > _APART or len(group) > _BOX:
                    heights[n] = middle
    return heights


def _height(image: Singles, colours: Singles, surface: Surface) -> float | None:
    """Height at which disagreement begins over most of the width, or the surface's own where there is none at all, m.

    The images have the lowest row first.
    """
    row = surface.height / len(image)
    differ = _Columns(image)
    window = max(round(_WINDOW / row), 1)
    best: tuple[float, float] | None = None
    for at in range(max(round(_LOWEST / row), 1), len(image) - window // 2):
        parts = [differ.over(at - window, at), differ.over(0, at), differ.over(at, at + window)]
        below, all_below, above = parts
        if min(part.known for part in parts) < _KNOWN or max(below.share, all_below.share) > _FEW:
            continue
        if above.share < _ABOVE:
            continue
        # A wall behind something looks as if it ended there, but farther up pictures agree again.
        if surface.kind == "wall" and differ.over(at, len(image)).share < _ALL_ABOVE:
            continue
        edge = max(round(0.3 * _WINDOW / row), 1)
        step = differ.over(at, at + edge).mean - differ.over(at - edge, at).mean
        if best is None or step > best[0]:
            best = step, at * row
    if best is not None:
        return best[1] - _ABOVE_EDGE
    whole = differ.over(round(0.3 * len(image)), len(image))
    agreed = whole.known > _KNOWN and whole.share < _NONE and whole.mean < 0.4 * _DIFFERENT
    return surface.height if agreed and _all_one(image, colours) else None


def _all_one(image: Singles, colours: Singles) -> bool:
    """Whether the upper part of a surface is about as bright as its lower part: a plain ceiling agrees everywhere."""
    third = max(len(image) // 3, 1)
    parts = [colours[rows][np.isfinite(image[rows])] for rows in (slice(0, third), slice(-third, None))]
    return all(len(part) for part in parts) and bool(
        np.abs(parts[0].mean(axis=0) - parts[1].mean(axis=0)).mean() < _ALIKE
    )


@dataclass(frozen=True, slots=True)
class _Part:
    """Some rows of a surface: the part of its width that is known, how much of that disagrees, and by how much."""

    known: float
    share: float
    mean: float


class _Columns:
    """Disagreement in columns as wide as cells, summed up from the floor."""

    def __init__(self, image: Singles) -> None:
        known = np.isfinite(image)
        wide = (len(image), image.shape[1] // SIDE, SIDE)
        zero = np.zeros((1, wide[1]))
        self._summed = np.vstack([zero, np.where(known, image, 0.0).reshape(wide).sum(axis=2).cumsum(axis=0)])
        self._counted = np.vstack([zero, known.reshape(wide).sum(axis=2).cumsum(axis=0)])

    def over(self, first: int, last: int) -> _Part:
        """Take together the rows from the first to before the last."""
        first, last = max(first, 0), min(last, len(self._summed) - 1)
        number = self._counted[last] - self._counted[first]
        enough = number > 0.25 * SIDE * (last - first)
        if not enough.any():
            return _Part(0.0, 0.0, 0.0)
        mean = (self._summed[last] - self._summed[first])[enough] / number[enough]
        return _Part(float(enough.mean()), float(np.mean(mean > _DIFFERENT)), float(mean.mean()))
