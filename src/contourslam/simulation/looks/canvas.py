"""A canvas measured in metres, to draw the surfaces of a room on."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Pixels = NDArray[np.float32]
Colour = ArrayLike  # red, green, blue, 0 to 1


class Canvas:
    """A rectangle to draw on; mutable. x runs right from the left edge, z up from the lower edge, both in m.

    Parameters
    ----------
    width, height : float
        m.
    pixel : float
        Metres per pixel, in both directions; the last column and the lowest row may reach beyond the rectangle.
    colour : array_like, shape (3,)
        Of the ground, 0 to 1.

    Attributes
    ----------
    pixels : ndarray, shape (rows, columns, 3)
        The uppermost row first.
    """

    def __init__(self, width: float, height: float, pixel: float, colour: Colour = (1.0, 1.0, 1.0)) -> None:
        self.width, self.height, self.pixel = width, height, pixel
        rows, columns = (max(1, math.ceil(length / pixel - 1e-6)) for length in (height, width))
        self.pixels: Pixels = np.empty((rows, columns, 3), dtype=np.float32)
        self.pixels[:] = np.asarray(colour, dtype=np.float32)

    @property
    def x(self) -> Pixels:
        """Of the middle of each column, shape (1, columns), m."""
        return ((np.arange(self.pixels.shape[1], dtype=np.float32) + 0.5) * self.pixel)[None, :]

    @property
    def z(self) -> Pixels:
        """Of the middle of each row, shape (rows, 1), m."""
        return (
            np.float32(self.height) - ((np.arange(self.pixels.shape[0], dtype=np.float32) + 0.5) * self.pixel)[:, None]
        )

    def part(self, x0: float, x1: float, z0: float, z1: float) -> Pixels:
        """The pixels of a rectangle, as a view; what lies beyond the canvas is cut off."""
        columns = [round(min(max(x, 0.0), self.width + self.pixel) / self.pixel) for x in (x0, x1)]
        rows = [round(min(max(self.height - z, 0.0), self.height + self.pixel) / self.pixel) for z in (z1, z0)]
        return self.pixels[rows[0] : rows[1], columns[0] : columns[1]]

    def fill(self, x0: float, x1: float, z0: float, z1: float, colour: Colour) -> None:
        """Fill a rectangle."""
        self.part(x0, x1, z0, z1)[:] = np.asarray(colour, dtype=np.float32)

    def shade(self, x0: float, x1: float, z0: float, z1: float, factor: float) -> None:
        """Make a rectangle darker (below 1) or lighter."""
        self.part(x0, x1, z0, z1)[:] *= np.float32(factor)

    def disc(self, x: float, z: float, radius: float, colour: Colour, *, squeeze: float = 1.0) -> None:
        """Fill a circle, or an ellipse `squeeze` times as high as wide."""
        inside = (self.x - x) ** 2 + ((self.z - z) / squeeze) ** 2 < radius**2
        self.pixels[inside] = np.asarray(colour, dtype=np.float32)

    def put(self, x: float, z: float, other: "Canvas") -> None:
        """Put another canvas of the same resolution on this one, its lower left corner at (x, z)."""
        target = self.part(x, x + other.width, z, z + other.height)
        rows, columns = (min(a, b) for a, b in zip(target.shape[:2], other.pixels.shape[:2], strict=True))
        target[:rows, :columns] = other.pixels[:rows, :columns]

    def shadow(self, x0: float, x1: float, z0: float, z1: float, *, width: float = 0.04, depth: float = 0.35) -> None:
        """Darken softly what surrounds a rectangle that stands out, most on its right and below."""
        away_x = np.maximum(np.maximum(x0 - self.x + 0.3 * width, self.x - x1 - 0.3 * width), 0.0)
        away_z = np.maximum(np.maximum(z0 - self.z - 0.5 * width, self.z - z1 + 0.5 * width), 0.0)
        self.pixels *= (1.0 - depth * np.exp(-(away_x**2 + away_z**2) / width**2))[..., None].astype(np.float32)

    def grain(self, amount: float, size: tuple[float, float], chance: np.random.Generator) -> None:
        """Vary the brightness smoothly by about so much over spots of so many metres across and upright."""
        self.pixels *= (
            1.0
            + amount * smooth(self.pixels.shape[:2], (size[1] / self.pixel, size[0] / self.pixel), chance)[..., None]
        )

    def image(self) -> NDArray[np.uint8]:
        """The pixels as bytes, shape (rows, columns, 3), not to be written to."""
        found = (np.clip(self.pixels, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
        found.flags.writeable = False
        return found


def smooth(shape: tuple[int, ...], size: tuple[float, float], chance: np.random.Generator) -> Pixels:
    """Draw smooth noise between -1 and 1; spots measure so many pixels down and across. Shape (rows, columns)."""
    rows, columns = shape[:2]
    (i, down), (j, across) = (_between(n, max(spot, 1.0)) for n, spot in zip((rows, columns), size, strict=True))
    knots = chance.uniform(-1.0, 1.0, (int(i[-1]) + 2, int(j[-1]) + 2)).astype(np.float32)
    along = knots[:, j] * (1.0 - across) + knots[:, j + 1] * across
    return np.asarray(along[i] * (1.0 - down[:, None]) + along[i + 1] * down[:, None], dtype=np.float32)


def _between(count: int, spot: float) -> tuple[NDArray[np.int64], Pixels]:
    """The knot before each pixel, and how far on to the next one it is."""
    at = np.arange(count) / spot
    before = at.astype(np.int64)
    return before, (at - before).astype(np.float32)
