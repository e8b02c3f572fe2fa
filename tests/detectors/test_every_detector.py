import math
from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.contour import Contours
from contourslam.detectors import DETECTORS, Detector, make_detector, suppress
from contourslam.errors import ConfigError

Floats = NDArray[np.float64]
Maker = Callable[..., Contours]
EVERY = [(name, adapted) for name in DETECTORS for adapted in (True, False)]


def spacing_for(detector: Detector) -> float:
    return 0.05 if detector.equalized else 0.0


def wander(seed: int, n: int) -> Floats:
    rng = np.random.default_rng(seed)
    heading = np.cumsum(np.where(rng.random(n) < 0.1, rng.uniform(-2.5, 2.5, n), rng.normal(0.0, 0.05, n)))
    return np.cumsum(0.05 * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)


def candidates(detector: Detector, contour: Contours) -> list[int]:
    return list(suppress(detector.respond(contour), contour, detector.threshold, detector.reach(contour)))


def test_the_registry_holds_the_papers_four() -> None:
    assert set(DETECTORS) == {"matched_filter", "wu", "teh_chin", "curvature_scale_space"}
    for name in DETECTORS:
        assert make_detector(name).equalized
        assert make_detector(name, adapted=False).equalized == (name == "matched_filter")


def test_a_name_that_is_not_there_is_an_error_that_lists_those_that_are() -> None:
    with pytest.raises(ConfigError) as error:
        make_detector("harris")
    assert "harris" in str(error.value)
    assert all(name in str(error.value) for name in DETECTORS)
    assert "\n" not in str(error.value)


def test_a_fifth_detector_is_one_entry_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(DETECTORS, "fifth", DETECTORS["wu"])
    assert make_detector("fifth", adapted=False) == make_detector("wu", adapted=False)


@pytest.mark.parametrize(("name", "adapted"), EVERY)
def test_a_detector_is_a_value(name: str, adapted: bool) -> None:
    detector = make_detector(name, adapted=adapted)
    assert detector == make_detector(name, adapted=adapted)
    with pytest.raises(FrozenInstanceError):
        detector.adapted = not adapted  # type: ignore[attr-defined]


@pytest.mark.parametrize("turn_deg", [90.0, -90.0, 60.0, -120.0])
@pytest.mark.parametrize(("name", "adapted"), EVERY)
def test_one_corner_is_one_candidate_at_its_vertex(
    contour_of: Maker, corner_of: Callable[..., Floats], name: str, adapted: bool, turn_deg: float
) -> None:
    detector = make_detector(name, adapted=adapted)
    contour = contour_of(corner_of(math.radians(turn_deg), 25), spacing=spacing_for(detector))
    found = candidates(detector, contour)
    if (name, adapted) == ("teh_chin", False):
        assert 25 in found  # its support reaches round the corner from farther off, which gives small maxima besides
    else:
        assert found == [25]


@pytest.mark.parametrize(("name", "adapted"), EVERY)
def test_a_wall_gives_no_candidate_and_only_the_printed_filter_responds_to_it(
    contour_of: Maker, name: str, adapted: bool
) -> None:
    detector = make_detector(name, adapted=adapted)
    wall = np.stack([np.arange(60) * 0.03, 1.0 - np.arange(60) * 0.04], axis=1)
    contour = contour_of(wall, spacing=spacing_for(detector))
    assert candidates(detector, contour) == []
    if (name, adapted) != ("matched_filter", False):
        np.testing.assert_allclose(detector.respond(contour), 0.0, atol=1e-9)


@pytest.mark.parametrize(("name", "adapted"), EVERY)
@given(seed=st.integers(0, 10_000), closed=st.booleans(), turn=st.floats(-4.0, 4.0))
def test_responses_forget_translation_rotation_and_mirroring(
    contour_of: Maker, name: str, adapted: bool, seed: int, closed: bool, turn: float
) -> None:
    detector = make_detector(name, adapted=adapted)
    points = wander(seed, 60)
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])

    def respond(rows: Floats) -> Floats:
        return detector.respond(contour_of(rows, closed=closed, spacing=spacing_for(detector)))

    response = respond(points)
    np.testing.assert_allclose(respond(points @ rotation.T + [3.0, -7.0]), response, atol=1e-7)
    np.testing.assert_allclose(respond(points * [1.0, -1.0]), response, atol=1e-9)


@pytest.mark.parametrize(("name", "adapted"), EVERY)
@given(seed=st.integers(0, 10_000), shift=st.integers(1, 59))
def test_responses_on_a_ring_do_not_depend_on_where_it_begins(
    contour_of: Maker, name: str, adapted: bool, seed: int, shift: int
) -> None:
    detector = make_detector(name, adapted=adapted)
    points = wander(seed, 60)
    response = detector.respond(contour_of(points, closed=True, spacing=spacing_for(detector)))
    rolled = contour_of(np.roll(points, -shift, axis=0), closed=True, spacing=spacing_for(detector))
    np.testing.assert_allclose(detector.respond(rolled), np.roll(response, -shift), atol=1e-9)


@pytest.mark.parametrize("name", ["teh_chin", "wu", "curvature_scale_space"])
@given(seed=st.integers(0, 10_000), scale=st.floats(0.01, 100.0))
def test_responses_on_raw_points_forget_the_scale(contour_of: Maker, name: str, seed: int, scale: float) -> None:
    detector = make_detector(name, adapted=False)
    points = wander(seed, 60)
    np.testing.assert_allclose(
        detector.respond(contour_of(points * scale)), detector.respond(contour_of(points)), atol=1e-7
    )


@pytest.mark.parametrize(("name", "adapted"), EVERY)
def test_each_contour_is_judged_by_itself(contour_of: Maker, name: str, adapted: bool) -> None:
    detector = make_detector(name, adapted=adapted)
    parts = [wander(seed, n) for seed, n in enumerate([40, 1, 3, 57, 0, 30])]
    starts = np.cumsum([0, *map(len, parts)])
    flat = np.concatenate(parts)
    together = Contours(flat, starts, np.zeros(6, np.bool_), spacing_for(detector), np.arange(len(flat), dtype=float))
    alone = [detector.respond(contour_of(part, spacing=spacing_for(detector))) for part in parts]
    np.testing.assert_allclose(detector.respond(together), np.concatenate(alone), atol=1e-9)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize(("name", "adapted"), EVERY)
def test_a_contour_too_short_or_empty_has_no_corner(contour_of: Maker, name: str, adapted: bool, closed: bool) -> None:
    detector = make_detector(name, adapted=adapted)
    for n in range(3):
        points = np.array([[0.0, 0.0], [0.05, 0.0]])[:n]
        contour = contour_of(points, closed=closed and n > 0, spacing=spacing_for(detector))
        assert detector.respond(contour).shape == (n,)
        assert candidates(detector, replace(contour, closed=np.array([False]))) == []
    none = Contours(np.empty((0, 2)), np.zeros(1, np.int64), np.zeros(0, np.bool_), spacing_for(detector), np.empty(0))
    assert detector.respond(none).shape == (0,)


@pytest.mark.parametrize(("name", "adapted"), EVERY)
@given(seed=st.integers(0, 10_000), n=st.integers(0, 60), closed=st.booleans(), kind=st.integers(0, 4))
def test_a_response_is_never_missing_or_negative(
    contour_of: Maker, name: str, adapted: bool, seed: int, n: int, closed: bool, kind: int
) -> None:
    rng = np.random.default_rng(seed)
    points = [
        wander(seed, n),
        np.repeat(wander(seed, n), 2, axis=0)[:n],  # every point twice
        np.zeros((n, 2)),
        rng.integers(0, 2, (n, 2)).astype(float),  # back and forth between four points
        rng.normal(0.0, 1e-160, (n, 2)),  # squares underflow
    ][kind]
    detector = make_detector(name, adapted=adapted)
    response = detector.respond(contour_of(points, closed=closed, spacing=spacing_for(detector)))
    assert np.isfinite(response).all()
    assert (response >= -1e-12).all()
