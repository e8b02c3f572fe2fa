"""Rotations in space survive being written as quaternions and as vectors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.geometry.poses import compose
from contourslam.geometry.rigid import (
    from_planar,
    from_quaternion,
    inverse,
    is_rigid,
    quaternion,
    rigid,
    rotation_from_vector,
    vector_from_rotation,
)

VECTORS = st.tuples(*[st.floats(-1.8, 1.8)] * 3).map(np.array)  # shorter than half a turn, 3.14


@given(VECTORS)
def test_a_rotation_survives_vector_and_quaternion(vector: np.ndarray) -> None:
    rotation = rotation_from_vector(vector)
    assert is_rigid(rigid(rotation, (1.0, 2.0, 3.0)))
    np.testing.assert_allclose(rotation @ vector, vector, atol=1e-12)
    np.testing.assert_allclose(from_quaternion(*quaternion(rotation)), rotation, atol=1e-12)
    np.testing.assert_allclose(vector_from_rotation(rotation), vector, atol=1e-9)


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
def test_half_a_turn_has_an_exact_quaternion(axis: list[float]) -> None:
    rotation = rotation_from_vector(np.pi * np.array(axis))
    np.testing.assert_allclose(np.abs(quaternion(rotation)[:3]), axis, atol=1e-12)
    np.testing.assert_allclose(from_quaternion(*quaternion(rotation)), rotation, atol=1e-12)


@given(VECTORS, st.tuples(*[st.floats(-10.0, 10.0)] * 3))
def test_a_motion_and_its_inverse_cancel(vector: np.ndarray, move: tuple[float, float, float]) -> None:
    matrix = rigid(rotation_from_vector(vector), move)
    np.testing.assert_allclose(inverse(matrix) @ matrix, np.eye(4), atol=1e-12)


def test_planar_poses_compose_as_their_matrices_do() -> None:
    a, b = np.array([1.0, -2.0, 2.5]), np.array([0.3, 0.4, 1.5])
    np.testing.assert_allclose(from_planar(a) @ from_planar(b), from_planar(compose(a, b)), atol=1e-12)


def test_what_is_no_rigid_motion_is_told() -> None:
    mirror, scaled = np.diag([1.0, 1.0, -1.0, 1.0]), np.diag([2.0, 2.0, 2.0, 1.0])
    assert not any(is_rigid(wrong) for wrong in (mirror, scaled, np.eye(3), np.full((4, 4), np.nan)))
