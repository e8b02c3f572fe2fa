"""The contours of one scan: chains of points, each chain the trace of one surface."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.display import CONTOURS, Sketch, card

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Contours:
    """Contours in one flat array, counter-clockwise as the lidar sees them: free space lies to the left.

    Attributes
    ----------
    points : ndarray, shape (m, 2)
        Points in the lidar's frame at the scan's stamp, m.
    starts : ndarray of int, shape (c + 1,)
        Contour i is ``points[starts[i]:starts[i + 1]]``.
    closed : ndarray of bool, shape (c,)
        True where the last point is followed by the first, as in a full turn without a break.
    spacing : float
        Length of the elementary vectors in m, about equal after the equalization; 0 for raw contours.
    source : ndarray, shape (m,)
        Index of each point among the raw contours' points; fractions lie between two of them.
    """

    points: Floats
    starts: Ints
    closed: NDArray[np.bool_]
    spacing: float
    source: Floats

    def __len__(self) -> int:
        return len(self.closed)

    def __getitem__(self, index: int) -> Floats:
        return self.points[self.starts[index] : self.starts[index + 1]]

    def points_in(self, length: float, otherwise: int) -> int:
        """Points that a length (m) spans, at least 2; `otherwise` on raw contours, whose points have no one spacing."""
        return max(round(length / self.spacing), 2) if self.spacing > 0.0 else otherwise

    def _repr_html_(self) -> str:
        """Show them in a notebook, neighbours in different colours."""
        sketch = Sketch(f"{len(self)} contours of a scan")
        self.draw(sketch)
        figures = {"contours": len(self), "closed": int(self.closed.sum()), "points": len(self.points)}
        return card("Contours", figures | ({"spacing": f"{self.spacing:g} m"} if self.spacing else {}), sketch.svg())

    def draw(self, sketch: Sketch) -> None:
        """Draw them into a sketch that is shown in a notebook."""
        for number, colour in enumerate(CONTOURS):
            mine = [self[i] for i in range(number, len(self), len(CONTOURS))]
            if mine:
                sketch.dots(np.concatenate(mine), colour, 2.4)
