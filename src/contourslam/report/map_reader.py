"""Reads back the GeoJSON map that ``map_files`` writes."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ResultError
from contourslam.nearest import unreadable
from contourslam.report.map_files import FORMAT, USUAL_ALONG, across_variances, normals, spread
from contourslam.slam.landmark_map import CornerMap, WallMap

Features = list[dict[str, Any]]

_FIRST_FORMAT = 1  # read for the maps that were written in it


def read_geojson(path: Path) -> tuple[CornerMap, WallMap]:
    """Read a map written by :func:`contourslam.report.map_files.write_geojson`.

    Features of another kind are passed over, so that a user may add their own.

    Parameters
    ----------
    path : Path
        The file to read.

    Returns
    -------
    CornerMap, WallMap
        Both in the world frame; positions as written, to 0.1 mm.

    Raises
    ------
    ResultError
        If the file is missing, is not such a map, or one of its values is missing, of the wrong type or shape, or
        not finite.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ResultError(unreadable(path, error)) from error
    except (ValueError, RecursionError) as error:
        raise ResultError(f"{path}: is not valid JSON ({error}); write it again with `contourslam run`") from error
    try:
        version = content["contourslam"]["format"]
        features = content["features"]
        if version == FORMAT and type(version) is int:
            return _compact_corners(_named(features, "c")), _compact_walls(_named(features, "w"))
        if version != _FIRST_FORMAT:
            raise ResultError(
                f"{path}: is a map of format {version!r}, this version reads up to {FORMAT}; update contourslam"
            )
        return (
            _corners([feature for feature in features if feature["properties"].get("kind") == "corner"]),
            _walls([feature for feature in features if feature["properties"].get("kind") == "wall"]),
        )
    except KeyError as error:
        raise ResultError(f"{path}: is not a contourslam map, {error} is missing") from error
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ResultError(f"{path}: is not a contourslam map ({error})") from error


def _named(features: Features, letter: str) -> Features:
    """Give the landmarks whose id is this letter and a number, with the number as property "id"."""
    found = []
    for feature in features:
        name = feature.get("id")
        if isinstance(name, str) and name[:1] == letter and name[1:].isdecimal() and name.isascii():
            found.append({**feature, "properties": {**feature["properties"], "id": int(name[1:])}})
    return found


def _compact_corners(features: Features) -> CornerMap:
    ellipses = _numbers(features, "ellipse", (3,))
    observed, failed = _sightings(features)
    return CornerMap(
        ids=_counts(features, "id"),
        positions=_coordinates(features, "Point", (2,)),
        covariances=spread(ellipses[:, 0] ** 2, ellipses[:, 1] ** 2, ellipses[:, 2]),
        directions=_numbers(features, "direction", ()),
        openings=_numbers(features, "opening", ()),
        convex=np.array([_typed(feature, "convex", bool) for feature in features], dtype=np.bool_),
        observed=observed,
        failed=failed,
    )


def _compact_walls(features: Features) -> WallMap:
    ends = _coordinates(features, "LineString", (2, 2))
    turn, shift, correlation = _numbers(features, "sigma", (3,)).T
    both = turn * shift * correlation
    lines = np.stack([np.stack([turn**2, both], axis=-1), np.stack([both, shift**2], axis=-1)], axis=1)
    implied = normals(ends)
    stated = [feature["properties"].get("normal", usual) for feature, usual in zip(features, implied, strict=True)]
    across, angles = across_variances(ends, lines), _stacked(stated, "normal", ())
    along = [np.broadcast_to(feature["properties"].get("along", USUAL_ALONG), (2,)) for feature in features]
    variances = _stacked(along, "along", (2,)) ** 2
    observed, failed = _sightings(features)
    return WallMap(
        ids=_counts(features, "id"),
        end_points=ends,
        end_point_covariances=np.stack([spread(across[:, e], variances[:, e], angles) for e in (0, 1)], axis=1),
        normals=angles,
        line_covariances=lines,
        observed=observed,
        failed=failed,
    )


def _sightings(features: Features) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """How often each was seen, and how often missed."""
    for feature in features:
        seen = feature["properties"]["seen"]
        if not (isinstance(seen, list) and len(seen) == 2 and all(type(count) is int for count in seen)):
            raise TypeError(f"seen must be two counts, got {seen!r}")
    counts = np.array([feature["properties"]["seen"] for feature in features], dtype=np.int64).reshape(-1, 2)
    return counts[:, 0], counts[:, 1]


def _corners(features: Features) -> CornerMap:
    return CornerMap(
        ids=_counts(features, "id"),
        positions=_coordinates(features, "Point", (2,)),
        covariances=_numbers(features, "covariance", (2, 2)),
        directions=_numbers(features, "direction", ()),
        openings=_numbers(features, "opening", ()),
        convex=np.array([_typed(feature, "convex", bool) for feature in features], dtype=np.bool_),
        observed=_counts(features, "observed"),
        failed=_counts(features, "failed"),
    )


def _walls(features: Features) -> WallMap:
    return WallMap(
        ids=_counts(features, "id"),
        end_points=_coordinates(features, "LineString", (2, 2)),
        end_point_covariances=_numbers(features, "end_point_covariances", (2, 2, 2)),
        normals=_numbers(features, "normal", ()),
        line_covariances=_numbers(features, "line_covariance", (2, 2)),
        observed=_counts(features, "observed"),
        failed=_counts(features, "failed"),
    )


def _typed(feature: dict[str, Any], name: str, kind: type) -> Any:
    value = feature["properties"][name]
    if type(value) is not kind:
        raise TypeError(f"{name} must be of type {kind.__name__}, got {value!r}")
    return value


def _counts(features: Features, name: str) -> NDArray[np.int64]:
    return np.array([_typed(feature, name, int) for feature in features], dtype=np.int64)


def _numbers(features: Features, name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    return _stacked([feature["properties"][name] for feature in features], name, shape)


def _coordinates(features: Features, geometry: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    for feature in features:
        if feature["geometry"]["type"] != geometry:
            raise ValueError(f"a {feature['properties']['kind']} must be a {geometry}")
    return _stacked([feature["geometry"]["coordinates"] for feature in features], "coordinates", shape)


def _stacked(values: list[Any], name: str, shape: tuple[int, ...]) -> NDArray[np.float64]:
    rows = np.zeros((len(values), *shape))
    for row, value in enumerate(values):
        array = np.array(value, dtype=np.float64)
        if array.shape != shape or not np.isfinite(array).all():
            raise ValueError(f"{name} must be finite numbers of shape {shape}, got {value!r}")
        rows[row] = array
    return rows
