"""A picture in the characters of a terminal, and what can be told of a camera by watching it."""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.robot.camera.opencv import opencv

Pixels = NDArray[np.uint8]

_GREYS = np.array(list(" .:-=+*#%@"))
_DARK, _BRIGHT = 8, 250


def half_blocks(pixels: Pixels, columns: int, rows: int, *, colour: bool) -> list[str]:
    """Draw a picture: with colour two pixels to a character, without it one shade.

    Parameters
    ----------
    pixels : ndarray of uint8, shape (height, width, 3)
        Red, green, blue.
    columns, rows : int
        Characters there is room for; one is taken as twice as high as wide.
    colour : bool
        With the escapes of terminals that know 16 million colours.

    Returns
    -------
    list of str
        Lines of one length, as many of each as keep the picture's shape.
    """
    cv2 = opencv()
    height, width = pixels.shape[:2]
    scale = min(max(columns, 1) / width, 2.0 * max(rows, 1) / height)
    wide, high = max(round(width * scale), 1), max(round(0.5 * height * scale), 1)
    small = cv2.resize(pixels, (wide, 2 * high), interpolation=cv2.INTER_AREA)
    if not colour:
        grey = small.reshape(high, 2, wide, 3).mean(axis=(1, 3))
        shades = _GREYS[np.minimum((grey * len(_GREYS) / 256.0).astype(np.int64), len(_GREYS) - 1)]
        return ["".join(line) for line in shades.tolist()]
    lines = []
    for above, below in zip(small[::2].tolist(), small[1::2].tolist(), strict=True):
        cells = [
            f"\x1b[38;2;{a[0]};{a[1]};{a[2]};48;2;{b[0]};{b[1]};{b[2]}m▀" for a, b in zip(above, below, strict=True)
        ]
        lines.append("".join(cells) + "\x1b[0m")
    return lines


@dataclass(frozen=True, slots=True)
class CameraFigures:
    """Medians over the last pictures.

    Attributes
    ----------
    pictures : int
        How many they are taken over.
    rate : float
        A second; NaN with fewer than two.
    width, height : int
        Pixels.
    kilobytes : float
        Of one picture.
    brightness : float
        Mean, 0 to 255.
    too_dark, too_bright : float
        Share of the pixels of no use, within the lens' circle as far as that can be told.
    sharpness : float
        Variance of the Laplacian; only good for comparing pictures of one scene.
    """

    pictures: int
    rate: float
    width: int
    height: int
    kilobytes: float
    brightness: float
    too_dark: float
    too_bright: float
    sharpness: float


class CameraTally:
    """Gathers figures over the last pictures.

    Parameters
    ----------
    span : int
        How many pictures.
    """

    def __init__(self, span: int = 60) -> None:
        self._stamps: deque[float] = deque(maxlen=span)
        self._sizes: deque[int] = deque(maxlen=span)
        self._looks: deque[tuple[float, ...]] = deque(maxlen=span)
        self._shape = (0, 0)

    def add(self, stamp: float, size: int) -> None:
        """Take a picture's stamp, s, and its bytes."""
        self._stamps.append(stamp)
        self._sizes.append(size)

    def look(self, pixels: Pixels) -> None:
        """Take a decoded picture; not each need be, for it takes time."""
        cv2 = opencv()
        self._shape = pixels.shape[0], pixels.shape[1]
        grey = cv2.cvtColor(pixels, cv2.COLOR_RGB2GRAY)
        rows, columns = (np.linspace(-1.0, 1.0, size) for size in grey.shape)
        middle = grey[rows[:, None] ** 2 + columns**2 < 0.5]
        small = cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        self._looks.append(
            (
                float(middle.mean()), float((middle < _DARK).mean()), float((middle > _BRIGHT).mean()),
                float(cv2.Laplacian(small, cv2.CV_32F).var()),
            )
        )  # fmt: skip

    def figures(self) -> CameraFigures:
        """Tell the figures."""
        steps = np.diff(np.array(self._stamps))
        step = float(np.median(steps)) if steps.size else 0.0
        looks = np.median(np.array(self._looks), axis=0) if self._looks else np.full(4, math.nan)
        return CameraFigures(
            len(self._stamps), 1.0 / step if step > 0.0 else math.nan, self._shape[1], self._shape[0],
            float(np.median(self._sizes)) / 1000.0 if self._sizes else math.nan, *looks.tolist(),
        )  # fmt: skip
