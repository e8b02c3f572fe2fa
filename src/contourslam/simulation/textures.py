"""The surfaces of a room with what is painted on them: what pictures of the room show, and the truth about them.

All of it follows from the room and a seed. Walls and floor have a texture each; furniture is of the material that its
colour names, so a description of a room needs nothing new.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.simulation.looks.painting import paint
from contourslam.simulation.looks.surface import Surface
from contourslam.simulation.room import Room

__all__ = ["RoomTextures", "Surface", "room_textures"]

Floats = NDArray[np.float64]


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
        5 mm to a pixel; coarser in large rooms, so that all textures have some 9 million pixels at most.
    """
    return RoomTextures(room, paint(room, seed))
