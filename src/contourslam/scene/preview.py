"""Two pictures of a scene: from above like a doll's house, and from where the robot drove."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.scene.build import Scene, coverage
from contourslam.scene.render import Eye, Panels, look_at, panels, render
from contourslam.scene.surface import Surface

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

_BACKGROUND = (250, 250, 248)
_WIDTH, _HEIGHT = 1400, 900
_RIM, _RIM_COLOUR = 0.07, (92, 92, 96)  # m; the upper edges of walls get one, so that one sees where they are
_SIDE_LIGHT = 0.08  # by which surfaces that face one way are darker than those that face the other
_EYE_LEVEL = 1.5  # m
_MOST_TEXELS = 12_000_000


def doll_house(scene: Scene) -> Bytes:
    """Draw a scene from above and aside; walls that turn their back to the viewer are left out.

    Returns
    -------
    ndarray of uint8, shape (rows, columns, 3)
    """
    drawn = _panels(scene, rims=True)
    low, high = _bounds(scene.surfaces)
    azimuth = math.radians(70.0 if high[0] - low[0] >= high[1] - low[1] else 20.0)
    eye = _frame(low, high, azimuth, math.radians(52.0))
    return render(drawn, eye, _BACKGROUND)


def from_inside(scene: Scene, poses: Floats) -> Bytes:
    """Draw a scene at the height of a person's eyes, from the place on the way with the widest view over it.

    Parameters
    ----------
    scene : Scene
    poses : ndarray, shape (n, 3)
        The way of the base.

    Returns
    -------
    ndarray of uint8, shape (rows, columns, 3)
    """
    walls = [s for s in scene.surfaces if s.kind == "wall"]
    middle = np.average([s.segment.mean(axis=0) for s in walls], axis=0, weights=[s.width for s in walls])
    places = poses[:: max(len(poses) // 200, 1), :2]
    away = np.hypot(*(places - middle).T)
    place = places[int(np.argmax(np.minimum(away, 6.0)))]
    top = max(s.origin[2] + s.height for s in walls)
    level = min(_EYE_LEVEL, 0.6 * top)
    ahead = (middle - place) / max(float(np.hypot(*(middle - place))), 1e-6)
    target = np.append(place + 3.0 * ahead, level - 0.45)
    eye = look_at(np.append(place - 0.3 * ahead, level), target, 95.0, _WIDTH, _HEIGHT)
    return render(_panels(scene, rims=False), eye, (238, 240, 242))


def _panels(scene: Scene, *, rims: bool) -> Panels:
    total = sum(texture.shape[0] * texture.shape[1] for texture in scene.textures)
    step = math.ceil(math.sqrt(total / _MOST_TEXELS))
    drawn = []
    for surface, texture in zip(scene.surfaces, scene.textures, strict=True):
        light = 1.0 - _SIDE_LIGHT * (0.5 + 0.5 * float(surface.normal[0])) * (surface.kind != "floor")
        shown = coverage(surface, texture.shape[:2])[..., None] * np.uint8(255)
        image = np.concatenate([(texture * light).astype(np.uint8), shown], axis=2)
        drawn.append((_row(surface), np.ascontiguousarray(image[::step, ::step])))
        if rims and surface.kind != "floor":
            drawn += _rims(surface)
    return panels(drawn)


def _rims(surface: Surface) -> list[tuple[Floats, Bytes]]:
    """The upper side of a wall, as thick as it may be, and its foot, which shows where a wall is left out."""
    colour = np.array([[[*_RIM_COLOUR, 255]]], np.uint8)
    back = np.append(-surface.normal[:2], 0.0)
    rows = []
    for height in (surface.origin[2] + surface.height, 0.005):
        corner = np.append(surface.origin[:2], height)
        rows.append((np.concatenate([corner, surface.across, back, [surface.width, _RIM]]), colour))
    return rows


def _row(surface: Surface) -> Floats:
    return np.concatenate([surface.origin, surface.across, surface.up, [surface.width, surface.height]])


def _bounds(surfaces: tuple[Surface, ...]) -> tuple[Floats, Floats]:
    corners = np.concatenate(
        [s.at(np.array([0.0, s.width, 0.0, s.width]), np.array([0, 0, 1, 1]) * s.height) for s in surfaces]
    )
    return corners.min(axis=0), corners.max(axis=0)


def _frame(low: Floats, high: Floats, azimuth: float, elevation: float) -> Eye:
    """A camera far enough away to see a whole box."""
    middle = 0.5 * (low + high)
    ahead = np.array(
        [math.cos(azimuth) * math.cos(elevation), math.sin(azimuth) * math.cos(elevation), -math.sin(elevation)]
    )
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    distance, step = 1.0, 1.0
    view = 30.0
    for _ in range(60):
        eye = look_at(middle - distance * ahead, middle, view, _WIDTH, _HEIGHT)
        local = (corners - eye.place) @ eye.axes.T
        fits = bool((local[:, 2] > 0.1).all())
        if fits:
            pixels = np.abs(eye.focal * local[:, :2] / local[:, 2:])
            fits = bool((pixels[:, 0] < 0.47 * _WIDTH).all() and (pixels[:, 1] < 0.47 * _HEIGHT).all())
        if fits and step < 0.02 * distance:
            return eye
        if fits:
            distance, step = distance - step, 0.5 * step
        distance += step
        step = step if fits else 1.3 * step
    return eye
