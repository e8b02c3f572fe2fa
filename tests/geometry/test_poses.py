import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose, interpolate, inverse, transform

Floats = NDArray[np.float64]
HEADINGS = st.one_of(st.floats(-math.pi, math.pi), st.sampled_from([math.pi, -math.pi, math.pi - 1e-9, 1e-9 - math.pi]))
POSES = st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), HEADINGS).map(np.array)
POINTS = hnp.arrays(np.float64, (4, 2), elements=st.floats(-50.0, 50.0))


def same_pose(first: Floats, second: Floats) -> None:
    np.testing.assert_allclose(first[..., :2], second[..., :2], atol=1e-9)
    np.testing.assert_allclose(wrap(first[..., 2] - second[..., 2]), 0.0, atol=1e-9)


def matrix(pose: Floats) -> Floats:
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    return np.array([[cos, -sin, pose[0]], [sin, cos, pose[1]], [0.0, 0.0, 1.0]])


@given(POSES, POSES)
def test_composition_is_the_product_of_the_homogeneous_matrices(first: Floats, second: Floats) -> None:
    np.testing.assert_allclose(matrix(compose(first, second)), matrix(first) @ matrix(second), atol=1e-9)


@given(POSES, POSES, POSES)
def test_composition_is_associative(a: Floats, b: Floats, c: Floats) -> None:
    same_pose(compose(compose(a, b), c), compose(a, compose(b, c)))


@given(POSES)
def test_the_origin_is_neutral_and_the_inverse_undoes(pose: Floats) -> None:
    same_pose(compose(np.zeros(3), pose), pose)
    same_pose(compose(pose, np.zeros(3)), pose)
    same_pose(compose(pose, inverse(pose)), np.zeros(3))
    same_pose(compose(inverse(pose), pose), np.zeros(3))


@given(POSES, POSES)
def test_between_is_what_composition_adds(first: Floats, second: Floats) -> None:
    same_pose(compose(first, between(first, second)), second)


@given(POSES, POSES, POINTS)
def test_points_go_through_frames_as_poses_do(first: Floats, second: Floats, points: Floats) -> None:
    step_by_step = transform(first, transform(second, points))
    np.testing.assert_allclose(transform(compose(first, second), points), step_by_step, atol=1e-9)
    np.testing.assert_allclose(transform(inverse(first), transform(first, points)), points, atol=1e-9)


@given(POSES, POSES)
def test_headings_come_out_wrapped(first: Floats, second: Floats) -> None:
    for pose in (compose(first, second), between(first, second), inverse(first)):
        assert -math.pi < pose[2] <= math.pi


def test_rows_of_poses_broadcast_against_one_pose() -> None:
    rng = np.random.default_rng(0)
    one, many = rng.uniform(-3.0, 3.0, 3), rng.uniform(-3.0, 3.0, (5, 3))
    same_pose(compose(one, many), np.stack([compose(one, row) for row in many]))
    same_pose(between(many, one), np.stack([between(row, one) for row in many]))
    same_pose(inverse(many), np.stack([inverse(row) for row in many]))


def test_interpolation_meets_the_readings_and_turns_the_short_way_across_pi() -> None:
    stamps = np.array([0.0, 1.0, 3.0])
    poses = np.array([[0.0, 0.0, 3.0], [1.0, 0.0, -3.0], [1.0, 2.0, -2.0]])
    same_pose(interpolate(stamps, poses, stamps), poses)
    halfway = interpolate(stamps, poses, np.array([0.5]))[0]
    assert abs(wrap(halfway[2] - math.pi)) < 1e-12
    np.testing.assert_allclose(halfway[:2], [0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(interpolate(stamps, poses, np.array([2.0]))[0, 2], -2.5)


def test_interpolation_is_clamped_at_both_ends_and_one_reading_is_enough() -> None:
    stamps, poses = np.array([1.0, 2.0]), np.array([[1.0, 2.0, 0.3], [2.0, 2.0, 0.4]])
    same_pose(interpolate(stamps, poses, np.array([-5.0, 9.0])), poses)
    same_pose(interpolate(stamps[:1], poses[:1], np.array([0.0, 1.0, 2.0])), np.repeat(poses[:1], 3, axis=0))


def test_interpolation_jumps_where_two_readings_share_a_stamp() -> None:
    stamps, poses = np.array([0.0, 1.0, 1.0, 2.0]), np.array([[0.0, 0, 0], [1.0, 0, 0], [5.0, 0, 0], [6.0, 0, 0]])
    np.testing.assert_allclose(interpolate(stamps, poses, np.array([0.5, 1.0, 1.5]))[:, 0], [0.5, 5.0, 5.5])
