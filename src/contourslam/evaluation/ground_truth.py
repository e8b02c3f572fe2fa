"""The true room as evaluation needs it: outlines at the lidar's height and the corners they make."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class GroundTruth:
    """The true room in the world frame, cut at the lidar's height.

    Attributes
    ----------
    segments : ndarray, shape (s, 2, 2)
        Straight outlines, both end points, m.
    circles : ndarray, shape (k, 3)
        Round outlines: x, y, radius, m.
    positions : ndarray, shape (c, 2)
        True corners, m.
    directions : ndarray, shape (c,)
        Bisector of each corner's two sides, pointing into the angle they enclose, rad.
    openings : ndarray, shape (c,)
        Angle between the two sides, in (0, pi), rad.
    convex : ndarray of bool, shape (c,)
        True where matter fills the angle, false where free space does.

    Raises
    ------
    ValueError
        If an array has a wrong shape.
    """

    segments: Floats
    circles: Floats
    positions: Floats
    directions: Floats
    openings: Floats
    convex: NDArray[np.bool_]

    def __post_init__(self) -> None:
        count = len(self.positions)
        wanted = {
            "segments": (len(self.segments), 2, 2),
            "circles": (len(self.circles), 3),
            "positions": (count, 2),
            "directions": (count,),
            "openings": (count,),
            "convex": (count,),
        }
        for name, shape in wanted.items():
            if getattr(self, name).shape != shape:
                raise ValueError(f"true room: {name} has shape {getattr(self, name).shape}, wanted {shape}")

    def sides(self) -> tuple[Floats, Floats]:
        """Directions of each corner's two sides, and their normals.

        Returns
        -------
        sides : ndarray, shape (c, 2, 2)
            Unit vectors from the corner along its two sides.
        normals : ndarray, shape (c, 2, 2)
            Unit normals of the two sides, pointing into free space.
        """
        angles = self.directions[:, None] + 0.5 * self.openings[:, None] * np.array([-1.0, 1.0])
        sides = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        # Turned by +90° from the clockwise side and by -90° from the other, a normal points into the enclosed angle.
        inward = np.stack([-sides[..., 1], sides[..., 0]], axis=-1) * np.array([1.0, -1.0])[:, None]
        return sides, np.where(self.convex[:, None, None], -inward, inward)
