"""The map as GeoJSON: corners as points, walls as lines, each with its covariance and its record of being seen.

A building's map is to stay small, so what follows from the rest is left out, and numbers have no more digits than they
have meaning: positions 0.1 mm, angles 0.001 rad, standard deviations three digits. Standard deviations and not
covariances, because these stay covariances however they are rounded.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.atomic import write_text
from contourslam.errors import ResultError
from contourslam.geometry.angles import wrap
from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]

FORMAT = 2
USUAL_ALONG = 0.05
"""Standard deviation of a wall's ends along it that is left out, m."""
_FRAME_NOTE = (
    "Coordinates are metres in the map's own plane (x, y), not longitude and latitude; angles are in rad, "
    "counter-clockwise from x. Points are corners, with ellipse = standard deviations along its axes (m, m) and "
    "direction of the longer axis; lines are walls, run from right to left as seen from free space, with sigma = "
    "standard deviations of direction (rad) and distance (m) at the middle and their correlation, along = that of the "
    f"end points along the wall (m), {USUAL_ALONG} where left out. seen = how often seen, and how often missed."
)
_CORRELATION = 0.999
"""The largest that is written: one of 1 is no covariance."""
_NORMAL_SLACK = 5e-4
"""A normal this close (rad, and at an end of the wall m) to the one that follows from the end points is left out."""


def across_variances(ends: Floats, line_covariances: Floats) -> Floats:
    """Variance of a wall's end points across it, which its line covariance implies.

    Parameters
    ----------
    ends : ndarray, shape (w, 2, 2)
        First and last point, m.
    line_covariances : ndarray, shape (w, 2, 2)
        Of direction and distance at the wall's middle, rad and m.

    Returns
    -------
    ndarray, shape (w, 2)
        m².
    """
    half = 0.5 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    # Turning the line about its middle moves an end across by its distance from there.
    turn, both, shift = line_covariances[:, 0, 0], line_covariances[:, 0, 1], line_covariances[:, 1, 1]
    return np.stack([shift - 2.0 * at * both + at * at * turn for at in (-half, half)], axis=-1)


def normals(ends: Floats) -> Floats:
    """Direction of the normal from free space into a wall that runs from right to left, rad, shape (w,)."""
    run = ends[:, 1] - ends[:, 0]
    return wrap(np.arctan2(-run[:, 0], run[:, 1]))


def spread(along: Floats, across: Floats, angles: Floats) -> Floats:
    """Covariances, shape (n, 2, 2), from the variances along a direction and across it."""
    axes = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    sides = np.stack([-axes[:, 1], axes[:, 0]], axis=-1)
    return along[:, None, None] * _outer(axes) + across[:, None, None] * _outer(sides)


def _outer(vectors: Floats) -> Floats:
    return vectors[:, :, None] * vectors[:, None, :]


def _decimals(value: Any, decimals: int) -> Any:
    values = np.round(value, decimals) + 0.0  # no minus zero
    return values.tolist()


def _digits(value: float) -> float:
    return float(f"{value:.3g}")


def _feature(identity: str, geometry: str, coordinates: Floats, properties: dict[str, Any]) -> dict[str, Any]:
    return {
        "type": "Feature",
        "id": identity,
        "geometry": {"type": geometry, "coordinates": _decimals(coordinates, 4)},
        "properties": properties,
    }


def _corner_features(corners: CornerMap) -> list[dict[str, Any]]:
    variances, axes = np.linalg.eigh(corners.covariances)
    sigmas = np.sqrt(np.maximum(variances, 0.0))
    # An axis has no sign: its angle is kept in [0, pi).
    angles = np.arctan2(axes[:, 1, 1], axes[:, 0, 1]) % np.pi
    return [
        _feature(
            f"c{corners.ids[i]}",
            "Point",
            corners.positions[i],
            {
                "ellipse": [_digits(sigmas[i, 1]), _digits(sigmas[i, 0]), _decimals(angles[i], 4)],
                "direction": _decimals(corners.directions[i], 3),
                "opening": _decimals(corners.openings[i], 3),
                "convex": bool(corners.convex[i]),
                "seen": [int(corners.observed[i]), int(corners.failed[i])],
            },
        )
        for i in range(len(corners.ids))
    ]


def _wall_features(walls: WallMap) -> list[dict[str, Any]]:
    sigmas = np.sqrt(np.maximum(walls.line_covariances[:, (0, 1), (0, 1)], 0.0))
    product = np.maximum(sigmas.prod(axis=1), 1e-300)
    correlations = np.clip(walls.line_covariances[:, 0, 1] / product, -_CORRELATION, _CORRELATION)
    tangents = np.stack([-np.sin(walls.normals), np.cos(walls.normals)], axis=-1)
    lengths = np.linalg.norm(walls.end_points[:, 1] - walls.end_points[:, 0], axis=1)
    follows = np.abs(wrap(normals(walls.end_points) - walls.normals)) * lengths <= _NORMAL_SLACK * (1.0 + lengths)
    along = np.sqrt(np.maximum(np.einsum("wi,weij,wj->we", tangents, walls.end_point_covariances, tangents), 0.0))
    return [
        _feature(
            f"w{walls.ids[i]}",
            "LineString",
            walls.end_points[i],
            {
                "sigma": [*map(_digits, sigmas[i]), _decimals(correlations[i], 3)],
                "seen": [int(walls.observed[i]), int(walls.failed[i])],
                **_along(along[i]),
                **({} if follows[i] else {"normal": _decimals(walls.normals[i], 5)}),
            },
        )
        for i in range(len(walls.ids))
    ]


def _along(sigmas: Floats) -> dict[str, Any]:
    first, last = map(_digits, sigmas)
    if first == last == USUAL_ALONG:
        return {}
    return {"along": first if first == last else [first, last]}


def write_geojson(path: Path, corners: CornerMap, walls: WallMap) -> None:
    """Write the map as a GeoJSON FeatureCollection, one feature a line, positions to 0.1 mm.

    A wall's normal and the covariance of its end points across it are left out: they follow from its end points and
    its line covariance.

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
    try:
        features = [*_corner_features(corners), *_wall_features(walls)]
        lines = ",\n".join(json.dumps(feature, separators=(",", ":"), allow_nan=False) for feature in features)
    except (ValueError, np.linalg.LinAlgError) as error:
        raise ResultError(f"{path}: not written, the map holds a number that is not finite") from error
    head = {"format": FORMAT, "frame": "local", "unit": "m", "note": _FRAME_NOTE}
    write_text(path, f'{{"type":"FeatureCollection",\n"contourslam":{json.dumps(head)},\n"features":[\n{lines}\n]}}\n')
