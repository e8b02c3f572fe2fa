"""Corners and walls made by hand, as the graph's landmarks keep them."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("gtsam", reason="needs the extra 'graph'")

from contourslam.graph import sightings as s
from contourslam.slam.measurement import CORNER, WALL

Floats = NDArray[np.float64]
Row = Callable[..., Floats]


def _corner_row(
    x: float,
    y: float,
    direction: float = 0.0,
    *,
    opening: float = math.pi / 2,
    convex: bool = True,
    sigma: float = 0.02,
) -> Floats:
    row = np.zeros(s.COLUMNS)
    row[s.KIND], row[s.X], row[s.Y], row[s.DIRECTION] = CORNER, x, y, direction
    row[s.OPENING], row[s.CONVEX], row[s.START], row[s.END] = opening, convex, 1.0, 1.0
    row[s.PXX] = row[s.PYY] = sigma**2
    row[s.PTT] = math.radians(3.0) ** 2
    return row


def _wall_row(x: float, y: float, normal: float = 0.0, *, length: float = 2.0, sigma: float = 0.02) -> Floats:
    row = np.zeros(s.COLUMNS)
    row[s.KIND], row[s.X], row[s.Y], row[s.DIRECTION] = WALL, x, y, normal
    row[s.START], row[s.END] = -0.5 * length, 0.5 * length
    row[s.PXX], row[s.PTT] = sigma**2, math.radians(1.0) ** 2
    return row


@pytest.fixture(scope="session")
def corner_row() -> Row:
    """A corner at x, y with its bisector at `direction`."""
    return _corner_row


@pytest.fixture(scope="session")
def wall_row() -> Row:
    """A wall with its middle at x, y and its normal, into the wall, at `normal`."""
    return _wall_row
