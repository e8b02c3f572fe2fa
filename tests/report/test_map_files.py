import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from contourslam.errors import ResultError
from contourslam.report.map_files import write_geojson
from contourslam.report.map_reader import read_geojson
from contourslam.report.scan_table import EMPTY_CORNERS, EMPTY_WALLS
from contourslam.slam.landmark_map import CornerMap

COORDINATE = st.floats(-1e4, 1e4, allow_nan=False)
ANGLE = st.floats(-np.pi, np.pi)


@st.composite
def corner_maps(draw):
    n = draw(st.integers(0, 5))
    count = st.integers(0, 10**9)
    factor = draw(arrays(float, (n, 2, 2), elements=st.floats(-0.5, 0.5)))
    return CornerMap(
        ids=draw(arrays(np.int64, n, elements=count)),
        positions=draw(arrays(float, (n, 2), elements=COORDINATE)),
        covariances=factor @ factor.transpose(0, 2, 1) + 1e-6 * np.eye(2),
        directions=draw(arrays(float, n, elements=ANGLE)),
        openings=draw(arrays(float, n, elements=ANGLE)),
        convex=draw(arrays(np.bool_, n)),
        observed=draw(arrays(np.int64, n, elements=count)),
        failed=draw(arrays(np.int64, n, elements=count)),
    )


@given(corner_maps())
def test_a_map_comes_back_as_it_was_to_a_tenth_of_a_millimetre(tmp_path_factory, corners):
    path = tmp_path_factory.mktemp("map") / "map.geojson"
    write_geojson(path, corners, EMPTY_WALLS)
    back, walls = read_geojson(path)
    assert len(walls.ids) == 0
    np.testing.assert_allclose(back.positions, corners.positions, atol=0.5001e-4)
    np.testing.assert_allclose(back.covariances, corners.covariances, rtol=1e-5, atol=1e-12)
    np.testing.assert_allclose(back.directions, corners.directions, atol=0.6e-5)
    for name in ("ids", "convex", "observed", "failed"):
        np.testing.assert_array_equal(getattr(back, name), getattr(corners, name))


def test_walls_come_back_too_and_the_file_says_that_its_metres_are_not_degrees(tmp_path: Path, make_run) -> None:
    run = make_run()
    write_geojson(tmp_path / "map.geojson", run.corner_map, run.wall_map)
    _, walls = read_geojson(tmp_path / "map.geojson")
    np.testing.assert_allclose(walls.end_points, run.wall_map.end_points, atol=1e-4)
    np.testing.assert_allclose(walls.line_covariances, run.wall_map.line_covariances, rtol=1e-5)
    np.testing.assert_array_equal(walls.failed, run.wall_map.failed)
    content = json.loads((tmp_path / "map.geojson").read_text())
    assert content["type"] == "FeatureCollection"
    assert {feature["geometry"]["type"] for feature in content["features"]} == {"Point", "LineString"}
    assert "not longitude" in content["contourslam"]["note"]


def test_a_thin_covariance_stays_positive_definite(tmp_path: Path, make_run) -> None:
    run = make_run()
    axis = np.array([np.cos(0.3), np.sin(0.3)])
    run.corner_map.covariances[:] = np.outer(axis, axis) + 1e-5 * np.eye(2)
    write_geojson(tmp_path / "map.geojson", run.corner_map, EMPTY_WALLS)
    corners, _ = read_geojson(tmp_path / "map.geojson")
    assert np.linalg.eigvalsh(corners.covariances).min() > 0


def test_a_number_that_is_not_finite_is_not_written(tmp_path: Path, make_run) -> None:
    run = make_run()
    run.corner_map.covariances[1, 0, 0] = np.nan
    with pytest.raises(ResultError, match="not finite"):
        write_geojson(tmp_path / "map.geojson", run.corner_map, run.wall_map)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: text[: len(text) // 2],
        lambda text: text.replace('"format": 1', '"format": 99'),
        lambda text: text.replace('"observed":800', '"observed":"many"'),
        lambda text: text.replace('"convex":true', '"convex":1'),
        lambda text: text.replace('"Point"', '"LineString"'),
        lambda text: text.replace('"direction"', '"heading"'),
        lambda text: text.replace('"opening":1.5708', '"opening":NaN'),
        lambda text: "[]",
        lambda text: '{"features": 3}',
        lambda text: "[" * 100_000,
    ],
)
def test_a_damaged_map_is_refused_by_name(tmp_path: Path, make_run, damage) -> None:
    path = tmp_path / "map.geojson"
    run = make_run()
    write_geojson(path, run.corner_map, run.wall_map)
    good = path.read_text()
    assert damage(good) != good
    path.write_text(damage(good))
    with pytest.raises(ResultError, match=r"map\.geojson: "):
        read_geojson(path)


@given(
    st.recursive(
        st.none() | st.booleans() | st.floats() | st.text(),
        lambda inner: (
            st.lists(inner)
            | st.dictionaries(
                st.sampled_from(
                    ["type", "contourslam", "format", "features", "properties", "kind", "geometry", "corner"]
                ),
                inner | st.just(1),
            )
        ),
    )
)
def test_any_json_gives_a_map_or_a_clear_error(tmp_path_factory, content) -> None:
    path = tmp_path_factory.mktemp("any") / "map.geojson"
    path.write_text(json.dumps(content))
    try:
        corners, _ = read_geojson(path)
    except ResultError as error:
        assert str(path) in str(error)
    else:
        assert len(corners.ids) == 0


def test_an_empty_map_is_a_map(tmp_path: Path) -> None:
    write_geojson(tmp_path / "map.geojson", EMPTY_CORNERS, EMPTY_WALLS)
    corners, walls = read_geojson(tmp_path / "map.geojson")
    assert corners.positions.shape == (0, 2)
    assert walls.end_points.shape == (0, 2, 2)
