"""What stands between a camera and a place: upright rectangles, seen in the plane with their heights."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel
from contourslam.scene.surface import FLAT, Surface

Floats = NDArray[np.float64]


def occluders(surfaces: tuple[Surface, ...]) -> Floats:
    """Give the upright surfaces as what hides others.

    Returns
    -------
    ndarray, shape (n, 5)
        x, y of both ends of the lower edge and the height of the upper one, m.
    """
    rows = [[*s.segment.ravel(), s.origin[2] + s.height] for s in surfaces if s.kind not in FLAT]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


@kernel
def crossing(eye: Floats, dx: float, dy: float, block: Floats) -> tuple[float, float]:
    """Where a ray in the plane meets a block: share of the ray's own length, and of the block's; NaN if never."""
    ax, ay = block[0] - eye[0], block[1] - eye[1]
    sx, sy = block[2] - block[0], block[3] - block[1]
    across = dx * sy - dy * sx
    if across == 0.0:
        return np.nan, np.nan
    return (ax * sy - ay * sx) / across, (ax * dy - ay * dx) / across


@kernel
def visible(eye: Floats, places: Floats, blocks: Floats, margin: float, clearance: float) -> NDArray[np.bool_]:
    """Tell which places a camera sees past what stands in the room.

    Parameters
    ----------
    eye : ndarray, shape (3,)
        The camera, m.
    places : ndarray, shape (n, 3)
        On surfaces, m.
    blocks : ndarray, shape (b, 5)
        As from :func:`occluders`.
    margin : float
        By how much each block is drawn out at its ends and its top, m: poses and walls are known no better.
    clearance : float
        A block within this distance of a place hides it not: it is the surface that the place is on, m.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    seen = np.ones(places.shape[0], dtype=np.bool_)
    for n in range(places.shape[0]):
        dx, dy, dz = places[n, 0] - eye[0], places[n, 1] - eye[1], places[n, 2] - eye[2]
        length = math.sqrt(dx * dx + dy * dy)
        if length < 1e-9:
            continue
        for b in range(blocks.shape[0]):
            part, place = crossing(eye, dx, dy, blocks[b])
            if not 0.0 < part < 1.0:
                continue
            sx, sy = blocks[b, 2] - blocks[b, 0], blocks[b, 3] - blocks[b, 1]
            wide = math.sqrt(sx * sx + sy * sy)
            side = margin / wide
            if place < -side or place > 1.0 + side or eye[2] + part * dz > blocks[b, 4] + margin:
                continue
            # How far the place is in front of or behind the block's own line.
            if (1.0 - part) * min(length, abs(dx * sy - dy * sx) / wide) < clearance:
                continue
            seen[n] = False
            break
    return seen
