"""A rectangle of the room with what is painted on it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A rectangle in the world that is seen from one side, with its texture.

    Attributes
    ----------
    name : str
        ``floor``, ``ceiling``, ``wall3`` (the fourth side of the room's outline), ``piece7.0`` (a face of the eighth
        piece: a box has four sides counter-clockwise from that along its x axis, then its top, 4, and its lower side,
        5; a column has as many as its mantle has facets).
    corner : ndarray, shape (3,)
        Its upper left corner as seen from free space, m in the world frame.
    right, down : ndarray, shape (3,)
        Unit vectors along its upper and its left edge.
    width, height : float
        m.
    image : ndarray of uint8, shape (rows, columns, 3)
        Red, green, blue; repeated in both directions where the surface is larger.
    metres_per_pixel : float
        The same in both directions.
    offset : tuple of float
        Where in the image the corner is: column and row, pixels from its upper left corner.
    """

    name: str
    corner: Floats
    right: Floats
    down: Floats
    width: float
    height: float
    image: Bytes
    metres_per_pixel: float
    offset: tuple[float, float] = (0.0, 0.0)

    @property
    def normal(self) -> Floats:
        """Unit vector into the free space before it, shape (3,)."""
        return np.cross(self.down, self.right)

    def points(self, places: ArrayLike) -> Floats:
        """Points of the world (n, 3), m, at places on the surface (n, 2): m to the right of the corner, and down."""
        across, below = np.asarray(places, dtype=np.float64).reshape(-1, 2).T
        return np.asarray(self.corner + across[:, None] * self.right + below[:, None] * self.down)

    def places(self, points: ArrayLike) -> Floats:
        """Where points of the world (n, 3) are: m to the right of the corner, down, and before it; shape (n, 3)."""
        off = np.asarray(points, dtype=np.float64).reshape(-1, 3) - self.corner
        return np.stack([off @ self.right, off @ self.down, off @ self.normal], axis=1)

    def colours(self, places: ArrayLike) -> Bytes:
        """The texture's own colour at places on the surface, shape (n, 2) as of :meth:`points`; shape (n, 3)."""
        texels = np.asarray(places, dtype=np.float64).reshape(-1, 2) / self.metres_per_pixel + self.offset
        column, row = np.floor(texels).astype(np.int64).T
        rows, columns = self.image.shape[:2]
        return np.asarray(self.image[row % rows, column % columns])
