"""Straight pieces of a scan, among which a board may be."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_GAP = 0.12  # m between neighbours, and this share of the range: farther apart they are not on one surface
_GAP_SHARE = 0.03
_OFF = 0.035  # m that a point may be off the line of its piece
_FEWEST = 5


@dataclass(frozen=True)
class Piece:
    """A straight piece.

    Attributes
    ----------
    middle, direction : ndarray, shape (2,)
        m, and of unit length.
    length : float
        m.
    """

    middle: Floats
    direction: Floats
    length: float


def straight_pieces(points: Floats) -> list[Piece]:
    """Cut a scan into straight pieces by iterative end-point fit.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
        In the order of the beams, m; NaN where nothing was hit.

    Returns
    -------
    list of Piece

    References
    ----------
    U. Ramer, An iterative procedure for the polygonal approximation of plane curves, 1972.
    """
    hits = points[np.isfinite(points).all(axis=1)]
    if len(hits) < _FEWEST:
        return []
    steps = np.linalg.norm(np.diff(hits, axis=0), axis=1)
    cuts = np.flatnonzero(steps > _GAP + _GAP_SHARE * np.linalg.norm(hits[1:], axis=1)) + 1
    pieces: list[Piece] = []
    todo = [part for part in np.split(hits, cuts) if len(part) >= _FEWEST]
    while todo:
        part = todo.pop()
        side = part[-1] - part[0]
        length = float(np.linalg.norm(side))
        if length < 1e-6:
            continue
        off = np.abs((part - part[0]) @ np.array([-side[1], side[0]])) / length
        worst = int(np.argmax(off))
        if off[worst] > _OFF and 0 < worst < len(part) - 1:
            todo += [half for half in (part[: worst + 1], part[worst:]) if len(half) >= _FEWEST]
            continue
        centred = part - part.mean(axis=0)
        direction = np.linalg.svd(centred, full_matrices=False)[2][0]
        pieces.append(Piece(part.mean(axis=0), direction, length))
    return pieces
