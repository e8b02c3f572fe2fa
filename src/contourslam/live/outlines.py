"""The contours of a map's keyframes where they stand by now: what an occupancy grid is drawn of."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.maps.saved_map import SavedMap
from contourslam.slam.mapper import Mapper
from contourslam.slam.slam import ContourSlam


@dataclass(frozen=True, slots=True)
class Outlines:
    """Keyframes at one moment.

    Attributes
    ----------
    version : int
        That of the session at that moment.
    poses : ndarray, shape (k, 3)
        Base in the map: m, m, rad.
    points : tuple of ndarray of float32, shape (n, 4)
        Contour points and normals of each, in the frame of the base: x, y (m), nx, ny.
    """

    version: int
    poses: Floats
    points: tuple[NDArray[np.float32], ...]


NONE: tuple[Floats, tuple[NDArray[np.float32], ...]] = np.empty((0, 3)), ()


def outlines(mapper: Mapper, known: SavedMap | None, version: int) -> Outlines:
    """Give the keyframes of a mapper: none where it keeps no contours, as the filter does not.

    Parameters
    ----------
    mapper : Mapper
    known : SavedMap or None
        The map that is localised in; its keyframes are given then.
    version : int
    """
    if known is not None:
        kept = known.keyframes
        if kept is None:
            return Outlines(version, *NONE)
        return Outlines(version, kept.poses, tuple(kept.contour(i) for i in range(len(kept))))
    if isinstance(mapper, ContourSlam):
        return Outlines(version, *NONE)
    from contourslam.graph import GraphSlam  # GTSAM is there, for the mapper is
    from contourslam.graph.keeping import standing

    return Outlines(version, *standing(mapper)) if isinstance(mapper, GraphSlam) else Outlines(version, *NONE)
