"""How well a camera sees a place on a surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.fisheye import FisheyeModel

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_BORDER = np.radians(6.0)  # towards the edge of the field of view pictures fade and calibrations end
_NEAREST = 0.25  # m; nearer than this an error of the pose moves the picture too far


@dataclass(frozen=True, slots=True)
class Sight:
    """What a camera sees of places, one row each.

    Attributes
    ----------
    pixels : ndarray, shape (n, 2)
        Column and row.
    scores : ndarray, shape (n,)
        0 where it is not seen, up to 1 where it is seen straight on and close.
    density : ndarray, shape (n,)
        Pixels for each metre of the surface, along the direction that is seen the most foreshortened.
    angles : ndarray, shape (n,)
        Off the axis of the lens, in parts of the greatest that it sees.
    """

    pixels: Floats
    scores: Floats
    density: Floats
    angles: Floats


class Lens:
    """A camera on a robot: its model and its place.

    Parameters
    ----------
    model : FisheyeModel
    T_base_camera : ndarray, shape (4, 4)
        m; z = 0 of the base is the floor.
    covered : ndarray of bool, shape (height, width), optional
        Pixels that are not to be used, for the robot itself is in them.
    """

    def __init__(self, model: FisheyeModel, T_base_camera: Floats, covered: Bools | None = None) -> None:
        self.model, self._place = model, np.asarray(T_base_camera, dtype=np.float64)
        self._covered = covered
        angles = np.linspace(1e-3, model.half_view, 200)
        rays = np.stack([np.sin(angles), np.zeros(200), np.cos(angles)], axis=1)
        with np.errstate(invalid="ignore"):
            pixels, _ = model.project(rays)
            radii = np.hypot(*(pixels - [model.cx, model.cy]).T)
        # Pixels for each radian outward and around, whichever is fewer.
        each = np.minimum(np.gradient(radii, angles), radii / np.maximum(np.sin(angles), 0.05))
        self._angles, self._each = angles, np.nan_to_num(np.maximum(each, 0.0))

    def without(self, covered: Bools) -> "Lens":
        """Give the same camera, some of whose pixels are not to be used."""
        return Lens(self.model, self._place, covered)

    def stand(self, pose: Floats) -> Floats:
        """Place of the camera in the world for a pose of the base in the plane, shape (4, 4)."""
        cos, sin = np.cos(pose[2]), np.sin(pose[2])
        return np.array([[cos, -sin, 0, pose[0]], [sin, cos, 0, pose[1]], [0, 0, 1, 0], [0, 0, 0, 1.0]]) @ self._place

    def look(self, stand: Floats, places: Floats, normal: Floats, texel: float) -> Sight:
        """Say where places on a flat surface are in the picture, and how well they are seen.

        Parameters
        ----------
        stand : ndarray, shape (4, 4)
            As from :meth:`stand`.
        places : ndarray, shape (n, 3)
            World frame, m.
        normal : ndarray, shape (3,)
            Of the surface, towards its viewer.
        texel : float
            Side of the squares that are to be told apart, m.
        """
        rays = places - stand[:3, 3]
        distances = np.maximum(np.linalg.norm(rays, axis=1), 1e-9)
        facing = -(rays @ normal) / distances
        local = rays @ stand[:3, :3]
        with np.errstate(invalid="ignore"):
            pixels, seen = self.model.project(local)
        angles = np.arctan2(np.hypot(local[:, 0], local[:, 1]), local[:, 2])
        density = np.interp(angles, self._angles, self._each) / distances * np.maximum(facing, 0.0)
        fine = density * texel
        border = np.clip((self.model.half_view - angles) / _BORDER, 0.0, 1.0)
        scores = fine / (1.0 + fine) * np.sqrt(np.maximum(facing, 0.0)) * border
        seen &= (facing > 0.05) & (distances > _NEAREST)
        if self._covered is not None:
            column, row = np.clip(np.round(pixels[seen]), 0, np.array(self._covered.shape[::-1]) - 1).astype(np.int64).T
            seen[seen] = ~self._covered[row, column]
        scores *= seen
        return Sight(pixels, scores, density, angles / self.model.half_view)
