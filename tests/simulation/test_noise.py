from dataclasses import replace

import numpy as np
import pytest

from contourslam.simulation.config import PAPER_LIDAR, YDLIDAR_X4
from contourslam.simulation.lidar import IdealScan
from contourslam.simulation.noise import add_noise

COUNT = 20000


def flat(distance: float, incidence_deg: float = 90.0) -> tuple[IdealScan, ...]:
    angles = np.linspace(-np.pi, np.pi, COUNT, endpoint=False)
    full = np.full(COUNT, distance), np.full(COUNT, np.radians(incidence_deg))
    return (IdealScan(0.0, angles, np.zeros(COUNT), *full),)


@pytest.mark.parametrize("sigma", [0.01, 0.05])
def test_errors_are_gaussian_with_the_deviation_asked_for(sigma: float) -> None:
    errors = add_noise(flat(3.0), replace(PAPER_LIDAR, sigma_range=sigma), 5)[0].ranges - 3.0
    assert errors.std() == pytest.approx(sigma, rel=0.03)
    assert abs(errors.mean()) < 4 * sigma / np.sqrt(COUNT)
    assert np.mean(np.abs(errors) > 2 * sigma) == pytest.approx(0.0455, abs=0.006)
    assert abs(np.corrcoef(errors[1:], errors[:-1])[0, 1]) < 0.03


def test_without_noise_the_ideal_ranges_come_through() -> None:
    np.testing.assert_array_equal(add_noise(flat(3.0), replace(PAPER_LIDAR, sigma_range=0.0), 5)[0].ranges, 3.0)


def test_one_seed_is_one_pattern_of_errors_at_every_size() -> None:
    small, large = (
        add_noise(flat(3.0), replace(PAPER_LIDAR, sigma_range=sigma), 5)[0].ranges - 3.0 for sigma in (0.01, 0.04)
    )
    np.testing.assert_allclose(large, 4 * small, atol=1e-12)
    other = add_noise(flat(3.0), PAPER_LIDAR, 6)[0].ranges - 3.0
    assert abs(np.corrcoef(small, other)[0, 1]) < 0.03


def test_the_ydlidar_noise_grows_with_range() -> None:
    for distance, sigma in ((1.0, 0.01), (4.0, 0.02), (8.0, 0.04)):
        ranges = add_noise(flat(distance), YDLIDAR_X4, 1)[0].ranges
        assert ranges[ranges > 0].std() == pytest.approx(sigma, rel=0.03)


def test_beams_drop_out_at_random_and_at_grazing_incidence() -> None:
    lost = [np.mean(add_noise(flat(2.0, deg), YDLIDAR_X4, 1)[0].ranges == 0.0) for deg in (90.0, 10.0, 6.0, 2.0)]
    assert lost[0] == pytest.approx(0.01, abs=0.003)
    assert lost[1] == pytest.approx(0.01, abs=0.003)
    assert lost[2] == pytest.approx(0.25, abs=0.03)
    assert lost[3] == pytest.approx(0.75, abs=0.03)


def test_what_is_out_of_range_does_not_come_back() -> None:
    assert (add_noise(flat(12.0), YDLIDAR_X4, 1)[0].ranges == 0.0).all()
    assert (add_noise(flat(0.05), PAPER_LIDAR, 1)[0].ranges == np.inf).all()
    assert (add_noise(flat(np.inf), PAPER_LIDAR, 1)[0].ranges == np.inf).all()
