"""What must hold in a map that others can rely on."""

from collections.abc import Iterator

import numpy as np

from contourslam.maps.layout import Array
from contourslam.maps.saved_map import Contoured, Relations, SavedMap, Seen, Stretches
from contourslam.slam.landmark_map import CornerMap, WallMap

Problem = tuple[str, str]
"""Name of an array, as in the file, and what is wrong with it."""


def problems(saved: SavedMap) -> Iterator[Problem]:
    """Everything that is wrong with a map whose arrays have the right types and shapes."""
    yield from _landmarks(saved.corners, saved.walls)
    keyframes = saved.keyframes
    if keyframes is not None:
        yield from _keyframes(keyframes)
    count = 0 if keyframes is None else len(keyframes)
    if saved.relations is not None:
        yield from _relations(saved.relations, count)
    if saved.seen is not None:
        yield from _seen(saved.seen, count, saved.corners, saved.walls)
    if saved.stretches is not None:
        yield from _stretches(saved.stretches, count)


def _landmarks(corners: CornerMap, walls: WallMap) -> Iterator[Problem]:
    yield from _finite("corners.positions", corners.positions)
    yield from _finite("corners.directions", corners.directions)
    yield from _finite("corners.openings", corners.openings)
    yield from _covariances("corners.covariances", corners.covariances)
    yield from _finite("walls.end_points", walls.end_points)
    yield from _finite("walls.normals", walls.normals)
    yield from _covariances("walls.end_point_covariances", walls.end_point_covariances)
    yield from _covariances("walls.line_covariances", walls.line_covariances)
    for part, landmarks in (("corners", corners), ("walls", walls)):
        for name in ("ids", "observed", "failed"):
            yield from _from_zero(f"{part}.{name}", getattr(landmarks, name))
    ids = np.concatenate([corners.ids, walls.ids])
    values, counts = np.unique(ids, return_counts=True)
    if (counts > 1).any():
        where = "corners.ids" if (corners.ids == values[counts > 1][0]).sum() > 1 else "walls.ids"
        yield where, f"{values[counts > 1][0]} stands there more than once"


def _keyframes(keyframes: Contoured) -> Iterator[Problem]:
    for name in ("stamps", "poses", "blurs", "points"):
        yield from _finite(f"keyframes.{name}", getattr(keyframes, name))
    yield from _covariances("keyframes.covariances", keyframes.covariances)
    if (keyframes.blurs < 0.0).any():
        yield "keyframes.blurs", "a variance is negative"
    yield from _starts("keyframes.starts", keyframes.starts, len(keyframes.points))
    steps = np.diff(keyframes.drives, prepend=0)
    if ((steps < 0) | (steps > 1)).any() or (len(steps) and steps[0] != 0):
        yield "keyframes.drives", "the numbers do not ascend one by one from 0"


def _relations(relations: Relations, keyframes: int) -> Iterator[Problem]:
    yield from _within("relations.first", relations.first, -1, keyframes)
    yield from _within("relations.second", relations.second, 0, keyframes)
    if (relations.first == relations.second).any():
        yield "relations.second", "a keyframe is related to itself"
    yield from _finite("relations.poses", relations.poses)
    yield from _covariances("relations.information", relations.information)
    robust = relations.robust
    if not (np.isnan(robust) | ((robust > 0.0) & np.isfinite(robust))).all():
        yield "relations.robust", "a width is not positive"


def _seen(seen: Seen, keyframes: int, corners: CornerMap, walls: WallMap) -> Iterator[Problem]:
    yield from _within("seen.keys", seen.keys, 0, keyframes)
    if (np.diff(seen.keys) < 0).any():
        yield "seen.keys", "the keyframes do not ascend"
    given = len(seen.failures)
    yield from _within("seen.ids", seen.ids, -1, given)
    yield from _finite("seen.rows", seen.rows)
    if not np.isin(seen.rows[:, 0], (0.0, 1.0)).all():
        yield "seen.rows", "a kind is neither 0 nor 1"
    yield from _from_zero("seen.failures", seen.failures)
    yield from _within("corners.ids", corners.ids, 0, given)
    yield from _within("walls.ids", walls.ids, 0, given)


def _stretches(stretches: Stretches, keyframes: int) -> Iterator[Problem]:
    yield from _within("stretches.anchors", stretches.anchors, 0, keyframes)
    yield from _starts("stretches.starts", stretches.starts, len(stretches.members))
    yield from _within("stretches.members", stretches.members, 0, keyframes)
    yield from _finite("stretches.seen", stretches.seen)


def _finite(name: str, values: Array) -> Iterator[Problem]:
    if not np.isfinite(values).all():
        yield name, "a number is not finite"


def _from_zero(name: str, values: Array) -> Iterator[Problem]:
    if (values < 0).any():
        yield name, "a number is negative"


def _within(name: str, values: Array, least: int, until: int) -> Iterator[Problem]:
    wrong = values[(values < least) | (values >= until)]
    if len(wrong):
        yield name, f"{wrong[0]} is not in the range from {least} to {until - 1}"


def _starts(name: str, starts: Array, length: int) -> Iterator[Problem]:
    if starts[0] != 0 or starts[-1] != length or (np.diff(starts) < 0).any():
        yield name, f"the numbers do not ascend from 0 to {length}"


def _covariances(name: str, matrices: Array) -> Iterator[Problem]:
    """Finite, symmetric up to rounding, no negative variance."""
    if not np.isfinite(matrices).all():
        yield name, "a number is not finite"
        return
    off = np.abs(matrices - np.swapaxes(matrices, -1, -2))
    variances = np.diagonal(matrices, axis1=-2, axis2=-1)
    if (off > 1e-6 * np.abs(matrices).max(axis=(-2, -1), keepdims=True, initial=0.0)).any():
        yield name, "a matrix is not symmetric"
    if (variances < 0.0).any():
        yield name, "a variance is negative"
