"""Which pictures each cell of the surfaces is coloured from."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.scene.lens import Lens
from contourslam.scene.occlusion import visible
from contourslam.scene.surface import SIDE, Surface, TexelGrid, middles
from contourslam.scene.views import View

Floats = NDArray[np.float64]

SLOTS = 8
"""How many pictures a cell gets; each slot chooses among pictures of other times, so that they can vote."""
MARGIN, CLEARANCE = 0.04, 0.08  # m
_SPAN = 3.0  # s whose pictures share a slot
_REACH = 9.0  # m
_TURN = 0.4  # rad/s, at which a picture counts for half
_FEWEST = 0.15  # a cell of which less is seen does not choose the picture


@dataclass(frozen=True, slots=True)
class Choice:
    """The pictures of each cell.

    Attributes
    ----------
    views : ndarray of int32, shape (cells, SLOTS)
        Which view, -1 for none.
    angles : ndarray of float32, shape (cells, SLOTS)
        Where the cell lies off the axis of its picture, in parts of the lens' field of view.
    """

    views: NDArray[np.int32]
    angles: NDArray[np.float32]


def steadiness(view: View) -> float:
    """How far a picture is to be trusted for how fast the robot turned, in (0, 1]."""
    return 1.0 / (1.0 + (view.turning / _TURN) ** 2)


def in_sight(eye: Floats, surface: Surface) -> bool:
    """Whether a camera is on the right side of a surface and not too far from it."""
    relative = eye - surface.origin
    u, v = float(relative @ surface.across), float(relative @ surface.up)
    away = np.hypot(u - np.clip(u, 0.0, surface.width), v - np.clip(v, 0.0, surface.height))
    above = float(relative @ surface.normal)
    return above > 0.02 and float(np.hypot(above, away)) < _REACH


def choose(
    grid: TexelGrid,
    views: tuple[View, ...],
    lens: Lens,
    blocks: Floats,
    texel: float,
    told: Callable[[float], None] = lambda done: None,
) -> Choice:
    """Choose the best pictures for each cell: close, straight on, sharp, and with nothing between.

    Parameters
    ----------
    grid : TexelGrid
    views : tuple of View
    lens : Lens
    blocks : ndarray, shape (b, 5)
        As from :func:`contourslam.scene.occlusion.occluders`.
    texel : float
        Side of a texel, m.
    told : callable
        Called with the fraction done.
    """
    chosen = np.full((grid.cells, SLOTS), -1, np.int32)
    scores, angles = (np.zeros((grid.cells, SLOTS), np.float32) for _ in range(2))
    samples = np.array([[0.5, 0.5], [0.1, 0.1], [0.1, 0.9], [0.9, 0.1], [0.9, 0.9]])
    for number, view in enumerate(views):
        stand, slot = lens.stand(view.pose), int((view.picture.stamp - views[0].picture.stamp) // _SPAN) % SLOTS
        near = _near(blocks, stand[:3, 3])
        for index, surface in enumerate(grid.surfaces):
            if not in_sight(stand[:3, 3], surface):
                continue
            cells = np.arange(grid.starts[index], grid.starts[index + 1])
            middle = grid.places(cells, samples[:1])[:, 0]
            sight = lens.look(stand, middle, surface.normal, texel)
            worth = sight.scores * steadiness(view)
            better = np.flatnonzero(worth > scores[cells, slot])
            if not len(better):
                continue
            around = grid.places(cells[better], samples).reshape(-1, 3)
            part = visible(stand[:3, 3], around, near, MARGIN, CLEARANCE).reshape(-1, len(samples)).mean(axis=1)
            worth = worth[better] * part
            wins = (worth > scores[cells[better], slot]) & (part > _FEWEST)
            won = cells[better[wins]]
            chosen[won, slot], scores[won, slot] = number, worth[wins]
            angles[won, slot] = sight.angles[better[wins]]
        told((number + 1) / len(views))
    return Choice(chosen, angles)


def _near(blocks: Floats, eye: Floats) -> Floats:
    """Only what is near enough to stand in the way."""
    a, b = blocks[:, :2] - eye[:2], blocks[:, 2:4] - eye[:2]
    d = b - a
    part = np.clip(-(a * d).sum(axis=1) / np.maximum((d * d).sum(axis=1), 1e-12), 0.0, 1.0)
    return np.ascontiguousarray(blocks[np.hypot(*(a + part[:, None] * d).T) < _REACH])


TEXELS = middles(SIDE)
