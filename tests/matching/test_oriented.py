import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.contour.contours import Contours
from contourslam.geometry.poses import transform
from contourslam.matching.oriented import REACH, move, oriented_points

Floats = NDArray[np.float64]


def contours_of(*pieces: Floats, closed: bool = False) -> Contours:
    starts = np.cumsum([0, *map(len, pieces)])
    points = np.concatenate([*pieces, np.empty((0, 2))])
    flags = np.full(len(pieces), closed)
    return Contours(points, starts.astype(np.int64), flags, 0.0, np.arange(len(points), dtype=np.float64))


def wandering(seed: int, n: int) -> Floats:
    """A curve that bends at random, some metres from the lidar."""
    chance = np.random.default_rng(seed)
    heading = np.cumsum(chance.normal(0.0, 0.3, n))
    return np.cumsum(0.05 * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0) + np.array([1.0, 3.0])


def twin(points: Floats, closed: bool, spacing: float, bend: float) -> Floats:
    """The same with NumPy's eigenvectors, point by point."""
    rows: list[Floats] = []
    for k, p in enumerate(points):
        if rows and np.hypot(*(p - rows[-1][:2])) < spacing:
            continue
        indices = [k + o for o in range(-REACH, REACH + 1)]
        indices = [i % len(points) for i in indices] if closed else [i for i in indices if 0 <= i < len(points)]
        offsets = [(i - k + len(points) // 2) % len(points) - len(points) // 2 for i in indices]
        near = [
            points[i] - p
            for i, o in zip(indices, offsets, strict=True)
            if abs(o) <= 1 or np.hypot(*(points[i] - p)) <= bend
        ]
        if len(near) < 3:
            continue
        values, vectors = np.linalg.eigh(np.cov(np.array(near).T, bias=True))
        if values[1] - values[0] < 0.6 * (values[0] + values[1]):
            continue
        normal = vectors[:, 0] if vectors[:, 0] @ p < 0.0 else -vectors[:, 0]
        rows.append(np.hstack([p, normal]))
    return np.array(rows).reshape(-1, 4)


@pytest.mark.parametrize("closed", [False, True])
@given(seed=st.integers(0, 1000), n=st.integers(8, 40))
def test_points_and_normals_are_those_of_numpy(closed: bool, seed: int, n: int) -> None:
    points = wandering(seed, n)
    found = oriented_points(contours_of(points, closed=closed))
    np.testing.assert_allclose(found, twin(points, closed, 0.04, 0.3), atol=1e-6)


@given(seed=st.integers(0, 1000), angle=st.floats(-3.1, 3.1))
def test_turning_the_lidar_turns_points_and_normals(seed: int, angle: float) -> None:
    points, turn = wandering(seed, 30), np.array([0.0, 0.0, angle])
    as_it_was = oriented_points(contours_of(points))
    # A point on the verge of being left out may go either way, for the numbers are rounded anew.
    found = oriented_points(contours_of(transform(turn, points)))
    if len(found) == len(as_it_was):
        np.testing.assert_allclose(found, move(as_it_was, turn), atol=1e-6)
    assert abs(len(found) - len(as_it_was)) <= 3


@given(pose=st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(-10.0, 10.0)))
def test_moving_and_moving_back_changes_nothing(pose: tuple[float, float, float]) -> None:
    oriented = oriented_points(contours_of(wandering(3, 30)))
    there = move(oriented, np.array(pose))
    np.testing.assert_allclose(there[:, :2], transform(np.array(pose), oriented[:, :2]))
    turned_back = move(there - [pose[0], pose[1], 0.0, 0.0], np.array([0.0, 0.0, -pose[2]]))
    np.testing.assert_allclose(turned_back, oriented, atol=1e-9)


def test_normals_of_a_wall_face_the_lidar_and_are_of_unit_length() -> None:
    x = np.arange(-1.0, 1.0, 0.03)
    for side in (-1.5, 1.5):
        found = oriented_points(contours_of(np.stack([x, np.full(len(x), side)], axis=1)))
        np.testing.assert_allclose(found[:, 2:], np.tile([0.0, -math.copysign(1.0, side)], (len(found), 1)), atol=1e-9)
        assert np.diff(found[:, 0]).min() >= 0.04


def test_a_corner_keeps_no_normal_between_its_sides() -> None:
    sides = np.concatenate(
        [[[t, 2.0] for t in np.arange(-0.5, 0.0, 0.05)], [[0.0, 2.0 + t] for t in np.arange(0, 0.5, 0.05)]]
    )
    normals = oriented_points(contours_of(sides))[:, 2:]
    assert (np.abs(normals).max(axis=1) > 0.9).mean() > 0.8


def test_no_contours_give_no_points() -> None:
    assert oriented_points(contours_of()).shape == (0, 4)
    assert oriented_points(contours_of(np.array([[1.0, 1.0], [1.05, 1.0]]))).shape == (0, 4)
