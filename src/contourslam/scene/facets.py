"""What the contours of the keyframes show beside the walls of the map, as straight facets."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from contourslam.maps.saved_map import Contoured
from contourslam.scene.columns import find_columns
from contourslam.scene.walls import Named, draw_out, frame

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_NEAR = 0.07  # m across, up to which points belong to a facet or wall
_AGREE = 0.5  # cosine between their normals
_BREAK = 0.25  # m; consecutive contour points farther apart are two pieces
_FEWEST = 4  # points of a piece
_SHORTEST = 0.08  # m
_BEND = 0.03  # m; a facet leaves its points by no more
_CELL = 0.05  # m
_SEEN = 3  # keyframes; what fewer saw in a place has moved


def contour_points(keyframes: Contoured | None) -> tuple[Floats, NDArray[np.int64]]:
    """Contour points of all keyframes in the frame of the map.

    Returns
    -------
    points : ndarray, shape (n, 4)
        x, y (m) and the normal towards free space.
    keys : ndarray of int, shape (n,)
        Keyframe of each.
    """
    if keyframes is None or not len(keyframes):
        return np.zeros((0, 4)), np.zeros(0, np.int64)
    keys = np.repeat(np.arange(len(keyframes)), np.diff(keyframes.starts))
    pose, local = keyframes.poses[keys], keyframes.points[: len(keys)].astype(np.float64)
    cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    turned = [
        np.stack([cos * local[:, a] - sin * local[:, a + 1], sin * local[:, a] + cos * local[:, a + 1]], axis=1)
        for a in (0, 2)
    ]
    return np.hstack([pose[:, :2] + turned[0], turned[1]]), keys


def find_facets(points: Floats, keys: NDArray[np.int64], walls: Named) -> tuple[Named, Named]:
    """Find the straight facets that contours show where no wall of the map is.

    Parameters
    ----------
    points : ndarray, shape (n, 4)
        As from :func:`contour_points`.
    keys : ndarray of int, shape (n,)
    walls : list of (str, ndarray of shape (2, 2))

    Returns
    -------
    facets : list of (str, ndarray of shape (2, 2))
        "contour-0" and so on, each as seen from free space from the left to the right, m.
    columns : list of (str, ndarray of shape (2, 2))
        Those of round columns, as from :func:`contourslam.scene.columns.find_columns`.
    """
    free = _often_seen(points, keys) if len(points) else np.zeros(0, np.bool_)
    for _, wall in walls:
        free &= ~_on(wall, points)
    columns, free = find_columns(points, free)
    rest, order = points[free], keys[free]
    step = np.hypot(*np.diff(rest[:, :2], axis=0).T)
    ends = np.flatnonzero((step > _BREAK) | (np.diff(order) != 0)) + 1
    pieces = [piece for piece in np.split(rest, ends) if len(piece) >= _FEWEST]
    pieces.sort(key=lambda piece: -float(np.hypot(*np.diff(piece[:, :2], axis=0).T).sum()))
    found: list[Floats] = []
    for piece in pieces:
        uncovered = np.ones(len(piece), np.bool_)
        for facet in found:
            uncovered &= ~_on(facet, piece)
        for part in np.split(piece, np.flatnonzero(np.diff(uncovered)) + 1):
            if len(part) >= _FEWEST and not any(_on(facet, part[:1])[0] for facet in found):
                found += _facets_along(part, rest)
    found.sort(key=lambda facet: -float(np.hypot(*(facet[1] - facet[0]))))
    kept = [facet for n, facet in enumerate(found) if not any(_covers(other, facet) for other in found[:n])]
    return [(f"contour-{number}", facet) for number, facet in enumerate(kept)], columns


def _covers(longer: Floats, facet: Floats) -> bool:
    """Whether most of a facet lies on a longer one."""
    _, across, _ = frame(facet)
    places = facet[0] + np.linspace(0.1, 0.9, 9)[:, None] * (facet[1] - facet[0])
    return bool(np.mean(_on(longer, np.hstack([places, np.tile(-across, (9, 1))]))) > 0.6)


def _often_seen(points: Floats, keys: NDArray[np.int64]) -> Bools:
    """Whether enough keyframes saw something beside each point."""
    cell = np.floor(points[:, :2] / _CELL).astype(np.int64)
    cell -= cell.min(axis=0)
    columns = int(cell[:, 1].max()) + 3
    place = (cell[:, 0] + 1) * columns + cell[:, 1] + 1
    around = [place + i * columns + j for i in (-1, 0, 1) for j in (-1, 0, 1)]
    pairs = np.unique(np.stack([np.concatenate(around), np.tile(keys, 9)], axis=1), axis=0)
    cells, counts = np.unique(pairs[:, 0], return_counts=True)
    often: Bools = counts[np.searchsorted(cells, place)] >= _SEEN
    return often


def _on(segment: Floats, points: Floats) -> Bools:
    """Whether points lie on a segment and face as it does."""
    along, across, length = frame(segment)
    relative = points[:, :2] - segment[0]
    s = relative @ along
    near = (np.abs(relative @ across) < _NEAR) & (s > -_NEAR) & (s < length + _NEAR)
    return np.asarray(near & (points[:, 2:] @ across < -_AGREE))


def _facets_along(piece: Floats, points: Floats) -> list[Floats]:
    """Facets along the points of one contour, each laid through all the points about it."""
    facets = []
    knots = _bends(piece[:, :2])
    for first, last in pairwise(knots):
        segment = piece[[first, last], :2]
        if np.hypot(*(segment[1] - segment[0])) < _SHORTEST:
            continue
        _, across, _ = frame(segment)
        if np.sum(piece[first : last + 1, 2:] @ across) > 0.0:  # seen from free space it runs to the right
            segment = segment[::-1]
        facets.append(draw_out(_fit(segment, points), points, _BEND))
    return facets


def _bends(line: Floats) -> list[int]:
    """Indices of the points that a line is simplified to (Douglas and Peucker 1973)."""
    kept, todo = {0, len(line) - 1}, [(0, len(line) - 1)]
    while todo:
        first, last = todo.pop()
        chord = line[last] - line[first]
        length = float(np.hypot(*chord))
        if last - first < 2 or length == 0.0:
            continue
        inner = line[first + 1 : last] - line[first]
        off = np.abs(inner[:, 0] * chord[1] - inner[:, 1] * chord[0]) / length
        middle = first + 1 + int(np.argmax(off))
        if off[middle - first - 1] > _BEND:
            kept.add(middle)
            todo += [(first, middle), (middle, last)]
    return sorted(kept)


def _fit(segment: Floats, points: Floats) -> Floats:
    """Lay a segment through the points on it; its ends stay where they are along it."""
    along, _, length = frame(segment)
    s = (points[:, :2] - segment[0]) @ along
    on = points[_on(segment, points) & (s > _BEND) & (s < length - _BEND), :2]
    if len(on) < _FEWEST:
        return segment
    middle = on.mean(axis=0)
    _, vectors = np.linalg.eigh((on - middle).T @ (on - middle))
    direction = vectors[:, 1] if vectors[:, 1] @ along > 0.0 else -vectors[:, 1]
    if direction @ along < 0.9:
        return segment
    return np.asarray(middle + ((segment - middle) @ direction)[:, None] * direction)
