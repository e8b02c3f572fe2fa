"""Reads back the GeoJSON map that ``map_files`` writes."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ResultError
from contourslam.report.map_files import FORMAT
from contourslam.slam.landmark_map import CornerMap, WallMap

Features = list[dict[str, Any]]


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
        raise ResultError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (ValueError, RecursionError) as error:
        raise ResultError(f"{path}: is not valid JSON ({error}); write it again with `contourslam run`") from error
    try:
        version = content["contourslam"]["format"]
        if version != FORMAT:
            raise ResultError(
                f"{path}: is a map of format {version!r}, this version reads {FORMAT}; update contourslam"
            )
        features = content["features"]
        return (
            _corners([feature for feature in features if feature["properties"].get("kind") == "corner"]),
            _walls([feature for feature in features if feature["properties"].get("kind") == "wall"]),
        )
    except KeyError as error:
        raise ResultError(f"{path}: is not a contourslam map, {error} is missing") from error
    except (TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ResultError(f"{path}: is not a contourslam map ({error})") from error


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
