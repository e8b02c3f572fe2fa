"""What is kept of a map: its landmarks, the contours of its keyframes, and what binds them."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from contourslam.display import POINT, WAY, Sketch, card
from contourslam.geometry.poses import transform
from contourslam.slam.landmark_map import CornerMap, WallMap

NOT_CONTINUABLE = (
    "the map cannot be continued: it holds no keyframes, or not what binds them; map anew with --back-end graph"
)
Floats = NDArray[np.float64]
_MOST_CONTOURS = 300  # whose points are drawn in a notebook
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Contoured:
    """Keyframes with their contours, one row each, in the order of the drive.

    Attributes
    ----------
    stamps : ndarray, shape (k,)
        s.
    poses : ndarray, shape (k, 3)
        Base in the frame of the map: m, m, rad.
    covariances : ndarray, shape (k, 3, 3)
        Of the poses, in the axes of the map.
    blurs : ndarray, shape (k,)
        Variance of the heading from turns during the scan that are not known, rad².
    starts : ndarray of int, shape (k + 1,)
        Rows ``starts[i]:starts[i + 1]`` of `points` belong to keyframe i.
    points : ndarray of float32, shape (n, 4)
        Contour points and normals in the frame of the base: x, y (m), nx, ny.
    drives : ndarray of int, shape (k,)
        Number of the drive that each keyframe belongs to, ascending from 0: between two drives there is no odometry.
    """

    stamps: Floats
    poses: Floats
    covariances: Floats
    blurs: Floats
    starts: Ints
    points: NDArray[np.float32]
    drives: Ints

    def __len__(self) -> int:
        return len(self.stamps)

    def contour(self, keyframe: int) -> NDArray[np.float32]:
        """Contour points and normals of one keyframe, shape (n, 4)."""
        return self.points[self.starts[keyframe] : self.starts[keyframe + 1]]


@dataclass(frozen=True, slots=True)
class Relations:
    """Relative poses between keyframes: the factors of the graph.

    Attributes
    ----------
    first, second : ndarray of int, shape (r,)
        Keyframes; `first` is -1 where the relation ties `second` to the frame of the map.
    poses : ndarray, shape (r, 3)
        Of `second` seen from `first`: m, m, rad.
    information : ndarray, shape (r, 3, 3)
        Inverse covariance, in the frame of `second`.
    robust : ndarray, shape (r,)
        Width of the Cauchy kernel in standard deviations; NaN where there is none.
    ties : ndarray of bool, shape (r,)
        True for ties to places seen before, which a refinement makes anew.
    """

    first: Ints
    second: Ints
    poses: Floats
    information: Floats
    robust: Floats
    ties: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Seen:
    """What keyframes saw of corners and walls; the rows are those of :mod:`contourslam.graph.sightings`.

    Attributes
    ----------
    keys : ndarray of int32, shape (s,)
        Keyframes.
    ids : ndarray of int32, shape (s,)
        Landmark that each was taken for, -1 for none.
    rows : ndarray of float32, shape (s, 13)
        In the frame of the base.
    failures : ndarray of int, shape (ids ever given,)
        How often each landmark was not seen though it should have been.
    """

    keys: NDArray[np.int32]
    ids: NDArray[np.int32]
    rows: NDArray[np.float32]
    failures: Ints


@dataclass(frozen=True, slots=True)
class Stretches:
    """Finished local maps: which keyframes were aligned together.

    Attributes
    ----------
    anchors : ndarray of int, shape (p,)
        Keyframe that each moves with.
    starts : ndarray of int, shape (p + 1,)
        Entries ``starts[i]:starts[i + 1]`` of `members` and `seen` belong to stretch i.
    members : ndarray of int, shape (m,)
        Keyframes.
    seen : ndarray, shape (m, 3)
        Their poses seen from the anchor: m, m, rad.
    """

    anchors: Ints
    starts: Ints
    members: Ints
    seen: Floats


@dataclass(frozen=True, slots=True)
class SavedMap:
    """A map as it is kept.

    Attributes
    ----------
    corners : CornerMap
    walls : WallMap
    keyframes : Contoured or None
        None in a map of landmarks alone: it can be looked at, not continued, and localised in by its landmarks only.
    relations : Relations or None
    seen : Seen or None
    stretches : Stretches or None
    about : dict of str to str
        What people want to know of it: the recording, the detector, the version of the program, when it was made.
    """

    corners: CornerMap
    walls: WallMap
    keyframes: Contoured | None = None
    relations: Relations | None = None
    seen: Seen | None = None
    stretches: Stretches | None = None
    about: dict[str, str] = field(default_factory=dict)

    @property
    def continuable(self) -> bool:
        """Whether it holds all that a further drive needs to go on in it."""
        parts = (self.keyframes, self.relations, self.seen, self.stretches)
        return all(part is not None for part in parts) and bool(self.keyframes)

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        sketch, keyframes = Sketch("a map that is kept, from above"), self.keyframes
        figures: dict[str, object] = {"corners": len(self.corners.ids), "walls": len(self.walls.ids)}
        if keyframes is not None and len(keyframes):
            every = range(0, len(keyframes), 1 + len(keyframes) // _MOST_CONTOURS)
            seen = [transform(keyframes.poses[i], keyframes.contour(i)[:, :2].astype(np.float64)) for i in every]
            sketch.dots(np.concatenate(seen), POINT, 1.0)
            for drive in np.unique(keyframes.drives).tolist():
                sketch.way(keyframes.poses[keyframes.drives == drive, :2], WAY)
            figures |= {"keyframes": len(keyframes), "drives": len(np.unique(keyframes.drives))}
        self.walls.draw(sketch)
        self.corners.draw(sketch)
        figures["can be gone on in"] = "yes" if self.continuable else "no"
        return card("A map that is kept", figures | dict(self.about), sketch.svg())
