"""What the lidar should see (eqs 29-30), every Jacobian against central differences, and bearings behind the robot."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import between, compose, transform
from contourslam.slam.measurement import (
    ANCHOR_X,
    ANCHOR_Y,
    COLUMNS,
    CORNER,
    FIRST_A,
    FIRST_B,
    KIND,
    WALL,
    innovation,
    measure_corner,
    measure_wall,
    predict_measurements,
)

Floats = NDArray[np.float64]

metres = st.floats(-20.0, 20.0)
angles = st.one_of(st.floats(-math.pi, math.pi), st.sampled_from([math.pi, math.pi - 1e-7, -math.pi + 1e-7, 0.0]))
poses = st.builds(lambda x, y, t: np.array([x, y, t]), metres, metres, angles)
mounts = st.builds(lambda x, y, t: np.array([x, y, t]), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), angles)


def differences(measure: object, at: Floats, angle: int) -> Floats:
    """Jacobian of a measurement of two numbers, of which number `angle` wraps."""
    step = 1e-6
    columns = []
    for k in range(at.size):
        ahead = np.array(measure(at + step * np.eye(at.size)[k]))
        behind = np.array(measure(at - step * np.eye(at.size)[k]))
        difference = ahead - behind
        difference[angle] = wrap(difference[angle])
        columns.append(difference / (2.0 * step))
    return np.stack(columns, axis=1)


def one(kind: float, state: Floats, *, first: Floats | None = None, anchor: Floats | None = None) -> tuple:
    """Mean and table of a map of one landmark."""
    table = np.zeros((1, COLUMNS))
    table[0, KIND] = kind
    table[0, FIRST_A], table[0, FIRST_B] = state if first is None else first
    table[0, ANCHOR_X], table[0, ANCHOR_Y] = (0.0, 0.0) if anchor is None else anchor
    return np.concatenate([np.zeros(3), state]), table


@given(pose=poses, mount=mounts, x=metres, y=metres)
def test_corner_jacobians_equal_central_differences(pose: Floats, mount: Floats, x: float, y: float) -> None:
    corner = np.array([x, y])
    assume(np.hypot(*(corner - compose(pose, mount)[:2])) > 0.3)
    mean, table = one(CORNER, corner)
    expected, by_pose, by_landmark = predict_measurements(pose, mount, mean, table, 1, False)
    np.testing.assert_array_equal(expected[0], measure_corner(pose, mount, x, y))
    np.testing.assert_allclose(
        by_pose[0], differences(lambda p: measure_corner(p, mount, x, y), pose, 1), rtol=1e-5, atol=1e-6
    )
    np.testing.assert_allclose(
        by_landmark[0], differences(lambda m: measure_corner(pose, mount, m[0], m[1]), corner, 1), rtol=1e-5, atol=1e-6
    )


@given(pose=poses, mount=mounts, normal=angles, distance=st.floats(-3.0, 3.0), x=metres, y=metres)
def test_wall_jacobians_equal_central_differences(
    pose: Floats, mount: Floats, normal: float, distance: float, x: float, y: float
) -> None:
    wall = np.array([normal, distance])
    mean, table = one(WALL, wall, anchor=np.array([x, y]))
    expected, by_pose, by_landmark = predict_measurements(pose, mount, mean, table, 1, False)
    np.testing.assert_array_equal(expected[0], measure_wall(pose, mount, normal, distance, x, y))
    np.testing.assert_allclose(
        by_pose[0], differences(lambda p: measure_wall(p, mount, normal, distance, x, y), pose, 0), rtol=1e-5, atol=1e-6
    )
    np.testing.assert_allclose(
        by_landmark[0], differences(lambda m: measure_wall(pose, mount, *m, x, y), wall, 0), rtol=1e-5, atol=1e-6
    )


@given(pose=poses, mount=mounts, x=metres, y=metres, way=angles)
def test_a_wall_is_measured_as_the_foot_of_its_perpendicular_says(
    pose: Floats, mount: Floats, x: float, y: float, way: float
) -> None:
    # The wall runs through (x, y) and (x, y) + (cos way, sin way); NumPy turns both points into the lidar's frame.
    points = transform(
        between(compose(pose, mount), np.zeros(3)), np.array([[x, y], [x + math.cos(way), y + math.sin(way)]])
    )
    along = points[1] - points[0]
    normal = np.array([along[1], -along[0]])
    direction, distance = measure_wall(pose, mount, way - math.pi / 2, 0.0, x, y)
    assert abs(wrap(np.array(direction - math.atan2(normal[1], normal[0])))) < 1e-9
    assert distance == pytest.approx(float(normal @ points[0]), abs=1e-9)


@given(pose=poses, d=st.floats(0.0, 0.5), x=metres, y=metres)
def test_with_the_lidar_a_distance_ahead_the_measurement_is_that_of_eqs_29_and_30(
    pose: Floats, d: float, x: float, y: float
) -> None:
    lidar_x, lidar_y = pose[0] + d * math.cos(pose[2]), pose[1] + d * math.sin(pose[2])
    assume(math.hypot(x - lidar_x, y - lidar_y) > 1e-3)
    r, bearing = measure_corner(pose, np.array([d, 0.0, 0.0]), x, y)
    assert r == pytest.approx(math.hypot(x - lidar_x, y - lidar_y), abs=1e-9)
    assert abs(wrap(np.array(bearing - (math.atan2(y - lidar_y, x - lidar_x) - pose[2])))) < 1e-9
    assert -math.pi <= bearing <= math.pi


@pytest.mark.parametrize("heading", [0.0, 3.0, -3.1, math.pi])
@pytest.mark.parametrize("side", [1e-9, -1e-9])
def test_jacobians_hold_where_the_corner_stands_exactly_behind(heading: float, side: float) -> None:
    pose, mount = np.array([0.4, -0.2, heading]), np.array([0.1, 0.05, 0.2])
    corner = transform(compose(pose, mount), np.array([-2.0, side]))
    mean, table = one(CORNER, corner)
    expected, by_pose, by_landmark = predict_measurements(pose, mount, mean, table, 1, False)
    assert abs(expected[0, 1]) == pytest.approx(math.pi, abs=1e-8)
    np.testing.assert_allclose(
        by_pose[0], differences(lambda p: measure_corner(p, mount, *corner), pose, 1), rtol=1e-5, atol=1e-6
    )
    np.testing.assert_allclose(
        by_landmark[0], differences(lambda m: measure_corner(pose, mount, *m), corner, 1), rtol=1e-5, atol=1e-6
    )


@given(seen=angles, expected=angles, kind=st.sampled_from([CORNER, WALL]))
def test_the_innovation_wraps_its_angle_and_only_that(seen: float, expected: float, kind: float) -> None:
    angle = 1 if kind == CORNER else 0
    values, model = np.full(2, 40.0), np.full(2, 1.0)
    values[angle], model[angle] = seen, expected
    nu = innovation(kind, values, model)
    assert nu[1 - angle] == 39.0
    assert -math.pi - 1e-12 <= nu[angle] <= math.pi + 1e-12
    assert math.cos(nu[angle] - (seen - expected)) == pytest.approx(1.0)


def test_the_innovation_is_small_across_the_half_turn() -> None:
    seen, expected = np.array([2.0, math.pi - 0.01]), np.array([2.0, -math.pi + 0.01])
    np.testing.assert_allclose(innovation(CORNER, seen, expected), [0.0, -0.02], atol=1e-12)
    np.testing.assert_allclose(innovation(WALL, seen[::-1], expected[::-1]), [-0.02, 0.0], atol=1e-12)


@pytest.mark.parametrize("kind", [CORNER, WALL])
def test_first_estimates_change_the_jacobians_and_not_the_expected_measurement(kind: float) -> None:
    pose, mount = np.array([0.5, 0.2, 0.3]), np.array([0.1, 0.02, -0.1])
    state, first, anchor = np.array([1.4, 0.9]), np.array([1.2, 1.1]), np.array([3.0, 2.0])
    mean, table = one(kind, state, first=first, anchor=anchor)
    expected, by_pose, by_landmark = predict_measurements(pose, mount, mean, table, 1, True)
    latest = predict_measurements(pose, mount, mean, table, 1, False)
    at_first = predict_measurements(pose, mount, np.concatenate([np.zeros(3), first]), table, 1, False)
    np.testing.assert_array_equal(expected, latest[0])
    np.testing.assert_array_equal(by_pose, at_first[1])
    np.testing.assert_array_equal(by_landmark, at_first[2])
    assert not np.allclose(by_pose, latest[1])
