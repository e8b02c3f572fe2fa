"""The map as GeoJSON: corners as points, walls as lines, each with its covariance and its record of being seen."""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import ResultError
from contourslam.report.atomic import write_text
from contourslam.slam.landmark_map import CornerMap, WallMap

FORMAT = 1
_FRAME_NOTE = (
    "Coordinates are metres in the map's own plane (x, y), not longitude and latitude; covariances are in m^2 "
    "(walls: also rad), angles in rad counter-clockwise from x."
)


def _rounded(values: NDArray[Any], decimals: int) -> Any:
    return np.round(values, decimals).tolist()


def _significant(values: NDArray[np.float64]) -> Any:
    # Significant digits, not decimals: six keep a thin ellipse positive definite.
    if values.ndim:
        return [_significant(value) for value in values]
    return float(f"{float(values):.6g}")


def _feature(kind: str, identity: int, geometry: str, coordinates: Any, properties: dict[str, Any]) -> dict[str, Any]:
    return {
        "type": "Feature",
        "id": f"{kind}-{identity}",
        "geometry": {"type": geometry, "coordinates": coordinates},
        "properties": {"kind": kind, "id": int(identity), **properties},
    }


def _corner_features(corners: CornerMap) -> list[dict[str, Any]]:
    return [
        _feature(
            "corner",
            corners.ids[i],
            "Point",
            _rounded(corners.positions[i], 4),
            {
                "covariance": _significant(corners.covariances[i]),
                "direction": round(float(corners.directions[i]), 5),
                "opening": round(float(corners.openings[i]), 5),
                "convex": bool(corners.convex[i]),
                "observed": int(corners.observed[i]),
                "failed": int(corners.failed[i]),
            },
        )
        for i in range(len(corners.ids))
    ]


def _wall_features(walls: WallMap) -> list[dict[str, Any]]:
    return [
        _feature(
            "wall",
            walls.ids[i],
            "LineString",
            _rounded(walls.end_points[i], 4),
            {
                "end_point_covariances": _significant(walls.end_point_covariances[i]),
                "normal": round(float(walls.normals[i]), 5),
                "line_covariance": _significant(walls.line_covariances[i]),
                "observed": int(walls.observed[i]),
                "failed": int(walls.failed[i]),
            },
        )
        for i in range(len(walls.ids))
    ]


def write_geojson(path: Path, corners: CornerMap, walls: WallMap) -> None:
    """Write the map as a GeoJSON FeatureCollection, one feature a line, positions to 0.1 mm.

    Parameters
    ----------
    path : Path
        The file to write.
    corners, walls
        The map, in the world frame.

    Raises
    ------
    ResultError
        If the file cannot be written, or the map holds a number that is not finite.
    """
    features = [*_corner_features(corners), *_wall_features(walls)]
    try:
        lines = ",\n".join(json.dumps(feature, separators=(",", ":"), allow_nan=False) for feature in features)
    except ValueError as error:
        raise ResultError(f"{path}: not written, the map holds a number that is not finite") from error
    head = {"format": FORMAT, "frame": "local", "unit": "m", "note": _FRAME_NOTE}
    write_text(path, f'{{"type":"FeatureCollection",\n"contourslam":{json.dumps(head)},\n"features":[\n{lines}\n]}}\n')
