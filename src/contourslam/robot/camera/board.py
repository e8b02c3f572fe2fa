"""A checkerboard: what a camera is calibrated with."""

import math
import re
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ConfigError

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Board:
    """A flat checkerboard.

    Its frame: the origin at the first inner corner, x along the columns, y along the rows.

    Parameters
    ----------
    columns, rows : int
        Inner corners, at least 3 each, and not as many of both: else nothing tells how the board is turned.
    square : float
        Side of one square, m.

    Raises
    ------
    ConfigError
        If a value is out of its range.
    """

    columns: int
    rows: int
    square: float

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3 or self.columns == self.rows:
            raise ConfigError(
                f"a board needs at least 3 inner corners each way, and not as many both ways, "
                f"got {self.columns}x{self.rows}"
            )
        if not (math.isfinite(self.square) and self.square > 0.0):
            raise ConfigError(f"the side of a board's square must be above 0 m, got {self.square}")

    @classmethod
    def parse(cls, text: str, square: float) -> Self:
        """Read a board from a text such as ``9x6``.

        Raises
        ------
        ConfigError
            If the text is of another form, or a value is out of its range.
        """
        found = re.fullmatch(r"\s*(\d{1,3})\s*[xX]\s*(\d{1,3})\s*", text)
        if found is None:
            raise ConfigError(f"a board is written as inner corners along and across, such as 9x6, got {text!r}")
        return cls(int(found[1]), int(found[2]), square)

    @property
    def points(self) -> Floats:
        """Inner corners, row by row, board frame, m, shape (columns * rows, 3)."""
        y, x = np.mgrid[: self.rows, : self.columns] * self.square
        return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])

    @property
    def middle(self) -> Floats:
        """Middle of the board, board frame, m, shape (3,)."""
        return 0.5 * self.square * np.array([self.columns - 1.0, self.rows - 1.0, 0.0])

    @property
    def size(self) -> tuple[float, float]:
        """Length along the columns and the rows of all the squares, m, without a margin."""
        return (self.columns + 1) * self.square, (self.rows + 1) * self.square
