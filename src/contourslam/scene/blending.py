"""One colour for each texel out of those that the pictures give."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel

Bytes = NDArray[np.uint8]

_AGREE = 18.0  # difference of brightness from the middle one at which a colour counts for 60 %, of 255
_SHARPNESS = 3.0  # the power of the scores: high, one picture decides and others only near their borders


def blend(
    colours: Bytes, weights: Bytes, factors: NDArray[np.float32], trusted: NDArray[np.float32]
) -> tuple[Bytes, Bytes]:
    """Blend the samples of each texel around their weighted median, the best seen ones leading.

    Parameters
    ----------
    colours : ndarray of uint8, shape (cells, t, slots, 3)
    weights : ndarray of uint8, shape (cells, t, slots)
    factors : ndarray of float32, shape (cells, slots, 3)
        What the colours are multiplied by.
    trusted : ndarray of float32, shape (cells, slots)
        What the weights are multiplied by.

    Returns
    -------
    colours : ndarray of uint8, shape (cells, t, 3)
    count : ndarray of uint8, shape (cells, t)
        How many pictures agree on each; 0 where there is no colour.
    """
    out, count = np.zeros((*colours.shape[:2], 3), np.uint8), np.zeros(colours.shape[:2], np.uint8)
    _blend(colours, weights, factors, trusted, out, count)
    return out, count


@kernel
def _blend(
    colours: Bytes,
    weights: Bytes,
    factors: NDArray[np.float32],
    trusted: NDArray[np.float32],
    out: Bytes,
    count: Bytes,
) -> None:
    cells, texels, slots, _ = colours.shape
    light, worth, order = np.empty(slots), np.empty(slots), np.empty(slots, np.int64)
    for c in range(cells):
        for t in range(texels):
            n, total = 0, 0.0
            for s in range(slots):
                if weights[c, t, s] == 0 or trusted[c, s] <= 0.0:
                    continue
                bright = 0.0
                for k in range(3):
                    bright += colours[c, t, s, k] * factors[c, s, k] / 3.0
                i = n  # sorted in
                while i > 0 and light[order[i - 1]] > bright:
                    order[i] = order[i - 1]
                    i -= 1
                order[i] = s
                light[s], worth[s] = bright, weights[c, t, s] * trusted[c, s] / 255.0
                total += worth[s]
                n += 1
            if n == 0:
                continue
            half, middle = 0.0, light[order[n - 1]]
            for i in range(n):
                half += worth[order[i]]
                if half >= 0.5 * total:
                    middle = light[order[i]]
                    break
            red = green = blue = summed = 0.0
            agree = 0
            for i in range(n):
                s = order[i]
                off = (light[s] - middle) / _AGREE
                weight = worth[s] ** _SHARPNESS * math.exp(-0.5 * off * off) + 1e-12
                agree += abs(off) < 1.5
                summed += weight
                red += weight * colours[c, t, s, 0] * factors[c, s, 0]
                green += weight * colours[c, t, s, 1] * factors[c, s, 1]
                blue += weight * colours[c, t, s, 2] * factors[c, s, 2]
            out[c, t, 0] = min(red / summed + 0.5, 255.0)
            out[c, t, 1] = min(green / summed + 0.5, 255.0)
            out[c, t, 2] = min(blue / summed + 0.5, 255.0)
            count[c, t] = max(agree, 1)
