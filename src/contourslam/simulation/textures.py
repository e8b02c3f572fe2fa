"""The surfaces of a room with what is painted on them: what pictures of the room show, and the truth about them.

All of it follows from the room and a seed. Walls and floor have a texture each; furniture is of the material that its
colour names, so a description of a room needs nothing new.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.simulation.room import Room

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


@dataclass(frozen=True, slots=True, eq=False)
class RoomTextures:
    """A room's surfaces.

    Attributes
    ----------
    room : Room
    surfaces : tuple of Surface
    """

    room: Room
    surfaces: tuple[Surface, ...]

    @property
    def walls(self) -> tuple[Surface, ...]:
        """Those of the outline, one for each of its sides, in its order."""
        return tuple(surface for surface in self.surfaces if surface.name.startswith("wall"))

    def find(self, points: ArrayLike, *, within: float = 0.05) -> NDArray[np.int64]:
        """Tell which surface each point lies on or near: the nearest one along its own normal.

        Parameters
        ----------
        points : array_like, shape (n, 3)
            World frame, m.
        within : float
            Farthest distance from the surface, m.

        Returns
        -------
        ndarray, shape (n,)
            Index in `surfaces`, -1 where there is none.
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        found, nearest = np.full(len(points), -1), np.full(len(points), within)
        for index, surface in enumerate(self.surfaces):
            across, below, before = surface.places(points).T
            inside = (across >= 0) & (across <= surface.width) & (below >= 0) & (below <= surface.height)
            nearer = inside & (np.abs(before) < nearest)
            found[nearer], nearest[nearer] = index, np.abs(before[nearer])
        return found

    def colours(self, points: ArrayLike, *, within: float = 0.05) -> tuple[Floats, NDArray[np.bool_]]:
        """The textures' own colours at points near surfaces, before any light falls on them.

        Parameters
        ----------
        points, within
            As of :meth:`find`.

        Returns
        -------
        colours : ndarray, shape (n, 3)
            0 to 255; NaN where no surface is near.
        found : ndarray of bool, shape (n,)
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        index = self.find(points, within=within)
        colours = np.full((len(points), 3), math.nan)
        for k in np.unique(index[index >= 0]).tolist():
            mine = index == k
            colours[mine] = self.surfaces[k].colours(self.surfaces[k].places(points[mine])[:, :2])
        return colours, index >= 0


def room_textures(room: Room, seed: int = 0) -> RoomTextures:
    """Paint a room.

    Parameters
    ----------
    room : Room
    seed : int
        Varies wallpaper, what hangs on the walls, and the grain of everything.

    Returns
    -------
    RoomTextures
        4 mm to a pixel; coarser in large rooms, so that all textures have some 12 million pixels at most.
    """
    from contourslam.simulation.looks.painting import paint  # here, since painting returns surfaces

    return RoomTextures(room, paint(room, seed))
