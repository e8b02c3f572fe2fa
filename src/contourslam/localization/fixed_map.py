"""A saved map made ready for being followed in: all contours in one table, and how well each place is known."""

import math
from dataclasses import dataclass

import numpy as np

from contourslam.contour.contours import Floats
from contourslam.errors import MapError
from contourslam.geometry.poses import between_one
from contourslam.localization.known_map import along
from contourslam.maps import SavedMap
from contourslam.matching.cell_map import CellMap
from contourslam.matching.small import moved
from contourslam.slam.landmark_map import WallMap

ORIGIN, NO_NOISE = np.zeros(3), np.zeros((3, 3))
OUTSIDE = 3.0  # m; a robot whose place is not known may stand this far outside of where the map was seen from
REACH = 16.0  # m; contours farther than this from a place do not help to find a scan near it


@dataclass(frozen=True, slots=True)
class FixedMap:
    """Contours of a map that does not change.

    Attributes
    ----------
    cells : CellMap
        All of them, in the frame of the map. A floor of 100 x 100 m full of rooms takes 25 MB.
    poses : ndarray, shape (k, 3)
        Where the map was seen from: m, m, rad; none in a map of landmarks alone.
    covariances : ndarray, shape (k, 3, 3)
        Of these poses, in the axes of the map.
    """

    cells: CellMap
    poses: Floats
    covariances: Floats

    def doubt_at(self, pose: Floats) -> Floats:
        """Covariance of the map itself at a place, shape (3, 3): that of the nearest keyframe, carried over stiffly."""
        if not len(self.poses):
            return np.zeros((3, 3))
        nearest = int(np.argmin((self.poses[:, 0] - pose[0]) ** 2 + (self.poses[:, 1] - pose[1]) ** 2))
        key = self.poses[nearest]
        return moved(key, self.covariances[nearest], between_one(key, pose), NO_NOISE)[1]

    def anywhere(self) -> tuple[Floats, Floats]:
        """Pose and covariance of a robot that may be anywhere in the map: those of an even distribution."""
        places = self.poses[:, :2] if len(self.poses) else self.cells.points[:, :2]
        low, high = places.min(axis=0) - OUTSIDE, places.max(axis=0) + OUTSIDE
        variances = np.array([*(high - low) ** 2 / 12.0, math.pi**2 / 3.0])
        return np.array([*0.5 * (low + high), 0.0]), np.diag(variances)

    def around(self, pose: Floats) -> CellMap:
        """Contours around a place only, for a search there."""
        points = self.cells.points
        near = np.abs(points[:, :2] - pose[:2]).max(axis=1) < REACH
        out = CellMap(pose, REACH + 1.0, large=True)
        out.insert(points[near, :4], ORIGIN)
        return out


def make_fixed_map(saved: SavedMap) -> FixedMap:
    """Merge the contours of all keyframes; a map of landmarks alone gives the faces of its walls.

    Parameters
    ----------
    saved : SavedMap

    Raises
    ------
    MapError
        If the map holds neither contours nor walls.
    """
    keyframes = saved.keyframes
    if keyframes is None or not len(keyframes.points):
        faces = _faces(saved.walls)
        if not len(faces):
            raise MapError(
                "the map holds neither contours nor walls to localise by; map the place again with `contourslam run`"
            )
        cells = _table(faces[:, :2])
        cells.insert(faces, ORIGIN)
        return FixedMap(cells, np.empty((0, 3)), np.empty((0, 3, 3)))
    # A point lies no farther from its keyframe than the farthest of all.
    reach = float(np.sqrt((keyframes.points[:, :2].astype(np.float64) ** 2).sum(axis=1).max()))
    places = keyframes.poses[:, :2]
    cells = _table(np.stack([places.min(axis=0) - reach, places.max(axis=0) + reach]))
    for k, pose in enumerate(keyframes.poses):
        cells.insert(keyframes.contour(k).astype(np.float64), pose)
    return FixedMap(cells, keyframes.poses, keyframes.covariances)


def _table(points: Floats) -> CellMap:
    """Make an empty map that covers points."""
    low, high = points.min(axis=0), points.max(axis=0)
    return CellMap(0.5 * (low + high), 0.5 * float((high - low).max()) + 1.0, large=True)


def _faces(walls: WallMap) -> Floats:
    """Points along walls with the normal into free space: x, y, nx, ny."""
    ends = zip(walls.end_points, walls.normals, strict=True)
    return np.concatenate([np.empty((0, 4)), *(along(first, last, normal + math.pi) for (first, last), normal in ends)])
