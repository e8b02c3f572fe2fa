"""A pixel sees the ray that falls on it, beyond 90 degrees off the axis too."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.errors import ConfigError
from contourslam.robot.camera.model import FisheyeModel

# About what the calibration of a 220-degree lens gives.
LENS = FisheyeModel(1280, 960, 1.6, 620.0, 618.0, 0.4, 641.5, 478.2, -0.02, 0.004, 0.0006, -0.0004)


def cone(angle: float, count: int = 37) -> np.ndarray:
    """Rays all around at an angle off the axis."""
    around = np.linspace(0.0, 2.0 * np.pi, count)
    return np.column_stack(
        [np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.full(count, np.cos(angle))]
    )


@given(
    st.floats(0.8, 2.2), st.floats(200.0, 900.0), st.floats(-0.03, 0.03), st.floats(0.0, 0.01),
    st.floats(-1e-3, 1e-3), st.floats(-1e-3, 1e-3),
)  # fmt: skip
def test_unprojecting_undoes_projecting_up_to_110_degrees(
    xi: float, f: float, k1: float, k2: float, p1: float, p2: float
) -> None:
    model = FisheyeModel(4000, 4000, xi, f, 1.01 * f, 0.3, 2000.0, 1990.0, k1, k2, p1, p2)
    rays = np.vstack([cone(angle) for angle in np.radians([0.0, 1.0, 45.0, 89.0, 90.0, 100.0, 109.99])])
    pixels, _ = model.project(rays)
    again, _ = model.unproject(pixels)
    np.testing.assert_allclose(again, rays, atol=1e-8)


def test_projecting_undoes_unprojecting_all_over_the_picture() -> None:
    columns, rows = np.meshgrid(np.arange(0, 1280, 7), np.arange(0, 960, 7))
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)
    rays, seen = LENS.unproject(pixels)
    again, seen_again = LENS.project(rays[seen])
    assert seen_again.all()
    assert 0.3 < seen.mean() < 1.0
    np.testing.assert_allclose(again, pixels[seen], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(rays[seen], axis=1), 1.0, atol=1e-12)


def test_it_projects_as_opencv_does() -> None:
    cv2 = pytest.importorskip("cv2")
    rays = np.vstack([cone(angle) for angle in np.radians(np.linspace(0.0, 110.0, 23))]) * 2.7
    theirs, _ = cv2.omnidir.projectPoints(
        rays.reshape(-1, 1, 3), np.zeros(3), np.zeros(3), LENS.matrix, LENS.xi, LENS.distortion.reshape(1, 4)
    )
    ours, _ = LENS.project(rays)
    np.testing.assert_allclose(ours, theirs.reshape(-1, 2), atol=1e-6)


@pytest.mark.parametrize("xi", [0.0, 1.0])
def test_a_ray_is_seen_only_within_view_and_picture(xi: float) -> None:
    model = FisheyeModel(201, 201, xi, 30.0, 30.0, 0.0, 100.0, 100.0, field_of_view_deg=120.0)
    _, seen = model.project([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.6], [1.0, 0.0, 0.55]])
    assert seen.tolist() == [True, False, True, False]
    narrow = FisheyeModel(21, 201, xi, 30.0, 30.0, 0.0, 10.0, 100.0, field_of_view_deg=120.0)
    assert narrow.project([[1.0, 0.0, 0.6], [0.0, 1.0, 0.6]])[1].tolist() == [False, True]


def test_a_pixel_outside_of_the_lens_circle_sees_nothing() -> None:
    model = FisheyeModel(1000, 1000, 1.6, 300.0, 300.0, 0.0, 500.0, 500.0)
    rays, seen = model.unproject([[5.0, 5.0], [500.0, 500.0], [-1.0, 500.0]])
    assert seen.tolist() == [False, True, False]
    assert np.isnan(rays[0]).all()


def test_a_model_that_maps_two_rays_to_one_pixel_is_refused() -> None:
    with pytest.raises(ConfigError, match="only out to"):
        FisheyeModel(1000, 1000, 1.6, 300.0, 300.0, 0.0, 500.0, 500.0, k1=-0.7)
    with pytest.raises(ConfigError, match="only out to"):
        FisheyeModel(1000, 1000, 4.0, 300.0, 300.0, 0.0, 500.0, 500.0)


@pytest.mark.parametrize(
    "wrong", [{"fx": float("nan")}, {"fy": 0.0}, {"width": 0}, {"xi": -0.1}, {"field_of_view_deg": 0.0}]
)
def test_a_model_without_sense_is_refused(wrong: dict[str, float]) -> None:
    values = {"width": 100, "height": 100, "xi": 1.0, "fx": 30.0, "fy": 30.0, "skew": 0.0, "cx": 50.0, "cy": 50.0}
    with pytest.raises(ConfigError):
        FisheyeModel(**{**values, **wrong})  # type: ignore[arg-type] # wrong on purpose
