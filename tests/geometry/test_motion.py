import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from contourslam.geometry.motion import unicycle_step

speeds = st.floats(-2.0, 2.0)
angles = st.floats(-math.pi, math.pi)


def test_a_step_goes_along_the_heading_after_the_turn() -> None:
    # eq. 28 by hand: from the origin, 1 m/s and pi/2 rad/s for one second ends at (0, 1), not on an arc
    np.testing.assert_allclose(unicycle_step(np.zeros(3), 1.0, math.pi / 2, 1.0), [0.0, 1.0, math.pi / 2], atol=1e-12)


def test_the_heading_wraps_at_pi() -> None:
    assert math.isclose(unicycle_step(np.array([0.0, 0.0, 3.1]), 0.0, 1.0, 0.1)[2], 3.2 - 2 * math.pi)


@given(v=speeds, omega=speeds, heading=angles)
def test_many_small_steps_approach_the_exact_arc(v: float, omega: float, heading: float) -> None:
    pose = np.array([1.0, -2.0, heading])
    for _ in range(1000):
        pose = unicycle_step(pose, v, omega, 1e-3)
    chord = v if abs(omega) < 1e-9 else 2 * v / omega * math.sin(omega / 2)
    expected = [1.0 + chord * math.cos(heading + omega / 2), -2.0 + chord * math.sin(heading + omega / 2)]
    np.testing.assert_allclose(pose[:2], expected, atol=3e-3)
