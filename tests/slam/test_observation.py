"""What a scan saw in the filter's form: range, bearing and line with covariance, and looks moved to the world."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.geometry.poses import compose, transform
from contourslam.landmarks import Corners, Walls
from contourslam.slam import observation as look
from contourslam.slam.measurement import CORNER, WALL
from contourslam.slam.observation import Observations, to_world

Floats = NDArray[np.float64]
See = Callable[..., Observations]

angles = st.floats(-math.pi, math.pi)
poses = st.builds(lambda x, y, t: np.array([x, y, t]), st.floats(-9.0, 9.0), st.floats(-9.0, 9.0), angles)


@given(r=st.floats(0.2, 25.0), bearing=angles, seed=st.integers(0, 1000))
def test_range_and_bearing_carry_the_corners_covariance(
    see: See, corners_at: Callable[..., Corners], r: float, bearing: float, seed: int
) -> None:
    x, y = r * math.cos(bearing), r * math.sin(bearing)
    corners = corners_at([x, y])
    root = np.random.default_rng(seed).normal(size=(2, 2)) * 0.02
    corners.covariances[0] = root @ root.T
    seen = see(corners)
    assert seen.values[0, 0] == pytest.approx(r)
    assert abs(wrap(np.array(seen.values[0, 1] - bearing))) < 1e-9
    # Turned into the frame along the beam, a metre across it is 1/r rad.
    beam = np.array([[math.cos(bearing), math.sin(bearing)], [-math.sin(bearing) / r, math.cos(bearing) / r]])
    np.testing.assert_allclose(seen.noises[0], beam @ root @ root.T @ beam.T, rtol=1e-7, atol=1e-12)


def test_corners_come_first_and_share_the_information_with_the_walls(
    see: See, corners_at: Callable[..., Corners], walls_at: Callable[..., Walls]
) -> None:
    corners = corners_at([[2.0, 1.0], [2.0, -1.0]], directions=[0.3, 0.5], convex=[True, False], sides=(0.7, 0.9))
    walls = walls_at([[[2.0, -1.0], [2.0, 1.0]]])
    alone, both = see(corners), see(corners, walls)
    np.testing.assert_array_equal(both.looks[:, look.KIND], [CORNER, CORNER, WALL])
    np.testing.assert_array_equal(both.looks[:2], alone.looks)
    np.testing.assert_array_equal(both.values[:2], alone.values)
    np.testing.assert_array_equal(both.values[2], walls.lines[0])
    np.testing.assert_array_equal(both.looks[2, look.X1 :], [2.0, -1.0, 2.0, 1.0])
    # Corner and walls are made of the same points: the information of both together must not exceed what was there.
    np.testing.assert_allclose(both.noises[:2], 2.0 * alone.noises)
    np.testing.assert_allclose(both.noises[2], 2.0 * walls.covariances[0])


def test_a_scan_that_saw_nothing_is_an_empty_observation(see: See) -> None:
    seen = see()
    assert len(seen) == 0
    assert seen.noises.shape == (0, 2, 2)
    assert to_world(np.zeros(3), np.zeros(3), seen.looks).shape == (0, 8)


@given(pose=poses, mount=poses)
def test_looks_are_moved_to_the_world_over_the_lidars_mount(
    see: See, corners_at: Callable[..., Corners], walls_at: Callable[..., Walls], pose: Floats, mount: Floats
) -> None:
    points = np.array([[3.0, 0.5], [1.0, -2.0], [2.0, 2.0]])
    seen = see(corners_at(points[:1], directions=0.4, sides=(0.6, 0.8)), walls_at([points[1:]]))
    world = to_world(pose, mount, seen.looks)
    expected = transform(compose(pose, mount), points)
    np.testing.assert_allclose(world[0, look.X1 : look.Y1 + 1], expected[0], atol=1e-9)
    np.testing.assert_allclose(world[1, look.X1 :].reshape(2, 2), expected[1:], atol=1e-9)
    np.testing.assert_array_equal(world[0, look.X2 :], [0.6, 0.8])  # lengths stay
    assert math.cos(world[0, look.DIRECTION] - pose[2] - mount[2] - 0.4) == pytest.approx(1.0)
