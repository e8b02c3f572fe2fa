"""The faces of a cube around a lens: as much of each as the lens sees, laid side by side on one sheet."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_NEAR, _FAR = 0.02, 80.0  # m
_MARGIN = 2  # pixels around what is needed, to look up between pixels

# Right, up and ahead of each face in the camera's frame (x right, y down, z out of the lens), as columns.
_AXES = {
    (2, 1): ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
    (0, 1): ((0, 0, -1), (0, -1, 0), (1, 0, 0)),
    (0, -1): ((0, 0, 1), (0, -1, 0), (-1, 0, 0)),
    (1, 1): ((0, 0, 1), (-1, 0, 0), (0, 1, 0)),
    (1, -1): ((0, 0, 1), (1, 0, 0), (0, -1, 0)),
    (2, -1): ((-1, 0, 0), (0, -1, 0), (0, 0, -1)),
}


@dataclass(frozen=True, slots=True, eq=False)
class Face:
    """What is seen of one face of the cube.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Right, up and ahead as columns, camera frame.
    left, columns, rows : int
        First column on the sheet, and size, pixels; all faces begin at the sheet's lowest row.
    middle, bottom, top : float
        Bounds on the plane at distance 1: middle of the columns, lower and upper edge.
    """

    axes: Floats
    left: int
    columns: int
    rows: int
    middle: float
    bottom: float
    top: float
    near: float = _NEAR
    far: float = _FAR


def cube_faces(rays: Floats, seen: NDArray[np.bool_], pixels: int) -> tuple[tuple[Face, ...], Floats]:
    """Lay out the faces that rays fall on.

    Parameters
    ----------
    rays : ndarray, shape (n, 3)
        Camera frame.
    seen : ndarray of bool, shape (n,)
        Rays that count.
    pixels : int
        Of a whole face, along its side.

    Returns
    -------
    faces : tuple of Face
    at : ndarray, shape (n, 2)
        Column and row on the sheet that each ray falls on, the lowest row first, pixel centres at whole numbers;
        those that don't count fall on its corner.
    """
    axis = np.argmax(np.abs(rays), axis=1)
    sign = np.sign(np.take_along_axis(rays, axis[:, None], axis=1)[:, 0])
    faces, at, left = [], np.zeros((len(rays), 2)), 0
    each = 0.5 * pixels  # pixels per unit on the plane at distance 1
    for (number, side), columns in _AXES.items():
        mine = seen & (axis == number) & (sign == side)
        if not mine.any():
            continue
        axes = np.array(columns, dtype=np.float64).T
        local = rays[mine] @ axes
        plane = each * local[:, :2] / local[:, 2:]
        low = np.floor(plane.min(axis=0)) - _MARGIN
        size = (np.ceil(plane.max(axis=0)) + _MARGIN - low).astype(np.int64)
        high = low + size
        at[mine] = plane - low - 0.5 + [left, 0]
        middle = float(low[0] + high[0]) / 2 / each
        faces.append(Face(axes, left, int(size[0]), int(size[1]), middle, float(low[1]) / each, float(high[1]) / each))
        left += int(size[0])
    return tuple(faces), at
