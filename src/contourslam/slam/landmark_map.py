"""The map as its readers get it: corners and walls with their covariance and their record of being seen."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.display import CORNER, WALL, Sketch, card, metres

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class CornerMap:
    """Corners of the map, one row each, in the world frame.

    Attributes
    ----------
    ids : ndarray of int, shape (c,)
        Identity, kept for life and never used again.
    positions : ndarray, shape (c, 2)
        m.
    covariances : ndarray, shape (c, 2, 2)
        Covariance of the position, m².
    directions : ndarray, shape (c,)
        Bisector of the two sides, pointing into the angle they enclose, rad.
    openings : ndarray, shape (c,)
        Angle between the two sides, in (0, pi), rad.
    convex : ndarray of bool, shape (c,)
        True where matter fills the angle (the edge of a box), false where free space does (the corner of a room).
    observed, failed : ndarray of int, shape (c,)
        How often the landmark was seen (o), and how often it should have been but was not (f).
    """

    ids: NDArray[np.int64]
    positions: Floats
    covariances: Floats
    directions: Floats
    openings: Floats
    convex: NDArray[np.bool_]
    observed: NDArray[np.int64]
    failed: NDArray[np.int64]

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        sketch = Sketch(f"{len(self.ids)} corners from above")
        self.draw(sketch)
        figures: dict[str, object] = {"corners": len(self.ids), "convex": int(self.convex.sum())} | _seen(
            self.observed, self.failed
        )
        if len(self.ids):
            sigmas = np.sqrt(0.5 * np.trace(self.covariances, axis1=1, axis2=2))
            figures["σ of a position, median"] = metres(float(np.median(sigmas)))
        return card("Corners of a map", figures, sketch.svg())

    def draw(self, sketch: Sketch) -> None:
        """Draw it into a sketch that is shown in a notebook."""
        sketch.dots(self.positions, CORNER, 4.0)


@dataclass(frozen=True, slots=True)
class WallMap:
    """Walls of the map, one row each, in the world frame.

    Attributes
    ----------
    ids : ndarray of int, shape (w,)
        Identity, kept for life and never used again.
    end_points : ndarray, shape (w, 2, 2)
        First and last point, m; seen from free space the wall runs from the right to the left.
    end_point_covariances : ndarray, shape (w, 2, 2, 2)
        Covariance of each end point, m²; along the wall it is what the beam spacing leaves open.
    normals : ndarray, shape (w,)
        Direction of the normal that points from free space into the wall, rad.
    line_covariances : ndarray, shape (w, 2, 2)
        Covariance of (normal direction, distance along the normal at the wall's middle), rad and m.
    observed, failed : ndarray of int, shape (w,)
        How often the landmark was seen (o), and how often it should have been but was not (f).
    """

    ids: NDArray[np.int64]
    end_points: Floats
    end_point_covariances: Floats
    normals: Floats
    line_covariances: Floats
    observed: NDArray[np.int64]
    failed: NDArray[np.int64]

    def _repr_html_(self) -> str:
        """Show it in a notebook."""
        sketch = Sketch(f"{len(self.ids)} walls from above")
        self.draw(sketch)
        length = float(np.hypot(*(self.end_points[:, 1] - self.end_points[:, 0]).T).sum())
        figures: dict[str, object] = {"walls": len(self.ids), "together": metres(length)} | _seen(
            self.observed, self.failed
        )
        return card("Walls of a map", figures, sketch.svg())

    def draw(self, sketch: Sketch) -> None:
        """Draw it into a sketch that is shown in a notebook."""
        sketch.lines(self.end_points, WALL)


def _seen(observed: NDArray[np.int64], failed: NDArray[np.int64]) -> dict[str, object]:
    chances = int(observed.sum() + failed.sum())
    return {"seen when they should have been": f"{observed.sum() / chances:.1%} of {chances}"} if chances else {}
