"""Where a lidar sits, out of its place in space: turned, upside down, and refused where it looks out of the plane."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.errors import ScanError
from contourslam.geometry.poses import transform
from contourslam.scan import LaserScan
from contourslam.scan.mounting import mirrored, mounting

ANGLES = st.floats(-math.pi, math.pi)
PLACES = st.floats(-5.0, 5.0)


def quaternion(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """x, y, z, w of turns about x, then y, then z."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(np.array([roll, pitch, yaw]) / 2), np.cos(np.array([roll, pitch, yaw]) / 2)
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )


def rotated(q: np.ndarray, point: np.ndarray) -> np.ndarray:
    """A point turned by a quaternion."""
    t = 2.0 * np.cross(q[:3], point)
    return np.asarray(point + q[3] * t + np.cross(q[:3], t))


@given(x=PLACES, y=PLACES, z=PLACES, yaw=ANGLES, upside_down=st.booleans(), beam=ANGLES, sign=st.sampled_from([-1, 1]))
def test_a_beam_ends_in_the_plane_where_it_ends_in_space(
    x: float, y: float, z: float, yaw: float, upside_down: bool, beam: float, sign: int
) -> None:
    q = sign * quaternion(math.pi if upside_down else 0.0, 0.0, yaw)
    in_space = np.array([x, y, z]) + rotated(q, 3.0 * np.array([math.cos(beam), math.sin(beam), 0.0]))
    found = mounting([x, y, z], q)
    assert found.upside_down is upside_down
    scan = LaserScan(0.0, np.array([beam]), np.array([3.0]), np.zeros(1), 0.1, 10.0)
    if found.upside_down:
        scan = mirrored(scan)
    end = transform(found.pose, 3.0 * np.array([math.cos(scan.angles[0]), math.sin(scan.angles[0])]))
    np.testing.assert_allclose(end, in_space[:2], atol=1e-9)


@given(roll=st.floats(-0.06, 0.06), pitch=st.floats(-0.06, 0.06), yaw=ANGLES, over=st.booleans())
def test_a_lidar_tilted_a_little_keeps_its_direction(roll: float, pitch: float, yaw: float, over: bool) -> None:
    found = mounting([0.0, 0.0, 0.3], quaternion(roll + (math.pi if over else 0.0), pitch, yaw))
    assert found.upside_down is over
    assert abs(math.remainder(found.pose[2] - yaw, 2.0 * math.pi)) < 0.01


@pytest.mark.parametrize(("roll", "pitch"), [(0.1, 0.0), (0.0, -0.2), (math.pi + 0.1, 0.0), (math.pi / 2, 0.0)])
def test_a_lidar_that_looks_out_of_the_plane_is_refused_with_the_angle(roll: float, pitch: float) -> None:
    tilt = math.degrees(abs(math.remainder(roll, math.pi)) + abs(pitch))
    with pytest.raises(ScanError, match=rf"laser: the lidar is tilted by {tilt:.1f} degrees; .* mount it level"):
        mounting([0.1, 0.0, 0.2], quaternion(roll, pitch, 0.3), frame="laser")


@pytest.mark.parametrize(
    ("translation", "turn"),
    [
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]),
        ([math.nan, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
        ([0.0, 0.0, 0.0], [0.0, 0.0, math.nan, 1.0]),
        ([1e9, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
        ([0.0, 0.0], [0.0, 0.0, 0.0, 1.0]),
        ([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
    ],
)
def test_what_is_no_transform_is_refused(translation: list[float], turn: list[float]) -> None:
    with pytest.raises(ScanError, match="are no transform; check the robot's description"):
        mounting(translation, turn)


def test_a_mirrored_scan_mirrored_again_is_the_scan() -> None:
    scan = LaserScan(1.0, np.array([-1.0, 0.5]), np.array([2.0, 3.0]), np.array([0.0, 0.1]), 0.1, 10.0)
    again = mirrored(mirrored(scan))
    np.testing.assert_array_equal(again.angles, scan.angles)
    np.testing.assert_array_equal(mirrored(scan).ranges, scan.ranges)
