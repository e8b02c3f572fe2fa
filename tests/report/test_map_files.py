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
from contourslam.slam.landmark_map import CornerMap, WallMap

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


def relative(found, wanted):
    """Largest difference of two sets of covariances, as a part of the standard deviations that belong to it."""
    sigmas = np.sqrt(np.einsum("...ii->...i", wanted))
    return np.max(np.abs(found - wanted) / (sigmas[..., :, None] * sigmas[..., None, :]), initial=0.0)


@given(corner_maps())
def test_a_map_comes_back_as_it_was_to_a_tenth_of_a_millimetre(tmp_path_factory, corners):
    path = tmp_path_factory.mktemp("map") / "map.geojson"
    write_geojson(path, corners, EMPTY_WALLS)
    back, walls = read_geojson(path)
    assert len(walls.ids) == 0
    np.testing.assert_allclose(back.positions, corners.positions, atol=0.5001e-4)
    assert relative(back.covariances, corners.covariances) < 0.05
    np.testing.assert_allclose(back.directions, corners.directions, atol=0.6e-3)
    for name in ("ids", "convex", "observed", "failed"):
        np.testing.assert_array_equal(getattr(back, name), getattr(corners, name))


def test_walls_come_back_too_and_the_file_says_that_its_metres_are_not_degrees(tmp_path: Path, make_run) -> None:
    run = make_run()
    write_geojson(tmp_path / "map.geojson", run.corner_map, run.wall_map)
    _, walls = read_geojson(tmp_path / "map.geojson")
    np.testing.assert_allclose(walls.end_points, run.wall_map.end_points, atol=1e-4)
    assert relative(walls.line_covariances, run.wall_map.line_covariances) < 0.015
    np.testing.assert_allclose(walls.normals, run.wall_map.normals, atol=1e-3)
    np.testing.assert_array_equal(walls.failed, run.wall_map.failed)
    content = json.loads((tmp_path / "map.geojson").read_text())
    assert content["type"] == "FeatureCollection"
    assert {feature["geometry"]["type"] for feature in content["features"]} == {"Point", "LineString"}
    assert "not longitude" in content["contourslam"]["note"]


def long_walls(n: int) -> WallMap:
    """Walls as a filter keeps them: their ends are uncertain by the line they lie on, and along it."""
    rng = np.random.default_rng(4)
    angles, lengths = rng.uniform(-np.pi, np.pi, n), rng.uniform(0.5, 30.0, n)
    normals = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=-1)
    middles = rng.uniform(-200.0, 200.0, (n, 2))
    factors = rng.standard_normal((n, 2, 2)) * np.array([[0.003], [0.02]])
    lines = factors @ factors.transpose(0, 2, 1)
    ends, spreads = np.empty((n, 2, 2)), np.empty((n, 2, 2, 2))
    for e, at in enumerate((-0.5 * lengths, 0.5 * lengths)):
        ends[:, e] = middles + at[:, None] * tangents
        across = lines[:, 1, 1] - 2 * at * lines[:, 0, 1] + at**2 * lines[:, 0, 0]
        spreads[:, e] = np.einsum("n,ni,nj->nij", across, normals, normals)
        spreads[:, e] += 0.05**2 * np.einsum("ni,nj->nij", tangents, tangents)
    counts = rng.integers(0, 1000, (2, n))
    return WallMap(np.arange(n), ends, spreads, angles, lines, *counts)


def test_what_is_left_out_of_a_wall_follows_from_the_rest(tmp_path: Path) -> None:
    walls = long_walls(200)
    write_geojson(tmp_path / "map.geojson", EMPTY_CORNERS, walls)
    _, back = read_geojson(tmp_path / "map.geojson")
    assert '"along":' not in (tmp_path / "map.geojson").read_text()
    assert relative(back.line_covariances, walls.line_covariances) < 0.015
    assert relative(back.end_point_covariances, walls.end_point_covariances) < 0.03
    np.testing.assert_allclose(np.cos(back.normals - walls.normals), 1.0, atol=1e-6)


def test_what_does_not_follow_from_the_rest_is_written(tmp_path: Path) -> None:
    walls = long_walls(2)
    walls.normals[1] += np.pi - 6.0
    walls.end_point_covariances[0] += 0.3**2 * np.eye(2)
    write_geojson(tmp_path / "map.geojson", EMPTY_CORNERS, walls)
    _, back = read_geojson(tmp_path / "map.geojson")
    np.testing.assert_allclose(back.normals, walls.normals, atol=1e-3)
    tangent = np.array([-np.sin(walls.normals[0]), np.cos(walls.normals[0])])
    for e in (0, 1):
        assert tangent @ back.end_point_covariances[0, e] @ tangent == pytest.approx(0.3**2 + 0.05**2, rel=0.01)


def test_a_landmark_costs_less_than_two_hundred_bytes(tmp_path: Path, make_run) -> None:
    write_geojson(tmp_path / "map.geojson", EMPTY_CORNERS, long_walls(200))
    assert (tmp_path / "map.geojson").stat().st_size < 200 * 200
    write_geojson(tmp_path / "map.geojson", make_run().corner_map, EMPTY_WALLS)
    corners = [line for line in (tmp_path / "map.geojson").read_text().splitlines() if '"Point"' in line]
    assert len(corners) == 4
    assert max(map(len, corners)) < 220


def test_a_map_of_the_first_format_is_still_read(tmp_path: Path) -> None:
    corner = {
        "type": "Feature",
        "id": "corner-3",
        "geometry": {"type": "Point", "coordinates": [1.5, -2.25]},
        "properties": {
            "kind": "corner",
            "id": 3,
            "covariance": [[0.01, 0.001], [0.001, 0.02]],
            "direction": 0.5,
            "opening": 1.5,
            "convex": True,
            "observed": 7,
            "failed": 2,
        },
    }
    wall = {
        "type": "Feature",
        "id": "wall-4",
        "geometry": {"type": "LineString", "coordinates": [[0, 0], [2, 0]]},
        "properties": {
            "kind": "wall",
            "id": 4,
            "end_point_covariances": [[[0.01, 0], [0, 0.02]], [[0.03, 0], [0, 0.04]]],
            "normal": -1.5708,
            "line_covariance": [[0.1, 0.0], [0.0, 0.2]],
            "observed": 1,
            "failed": 0,
        },
    }
    path = tmp_path / "map.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "contourslam": {"format": 1}, "features": [corner, wall]}))
    corners, walls = read_geojson(path)
    assert corners.ids.tolist() == [3]
    assert corners.positions.tolist() == [[1.5, -2.25]]
    assert corners.covariances.tolist() == [[[0.01, 0.001], [0.001, 0.02]]]
    assert (corners.observed[0], corners.failed[0]) == (7, 2)
    assert walls.end_point_covariances[0, 1].tolist() == [[0.03, 0.0], [0.0, 0.04]]
    assert walls.normals.tolist() == [-1.5708]


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
        lambda text: text.replace('"format": 2', '"format": 99'),
        lambda text: text.replace('"seen":[800,', '"seen":["many",'),
        lambda text: text.replace('"seen":[800,10]', '"seen":[800]'),
        lambda text: text.replace('"convex":true', '"convex":1'),
        lambda text: text.replace('"Point"', '"LineString"'),
        lambda text: text.replace('"direction"', '"heading"'),
        lambda text: text.replace('"opening":1.571', '"opening":NaN'),
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
