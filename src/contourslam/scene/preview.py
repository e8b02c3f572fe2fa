"""Two pictures of a scene: from above like a doll's house, and from where the robot drove."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.scene.build import Scene, coverage
from contourslam.scene.floor import sights
from contourslam.scene.occlusion import occluders
from contourslam.scene.render import Eye, Panels, look_at, panels, render
from contourslam.scene.surface import FLAT, Surface

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

_BACKGROUND = (250, 250, 248)
_WIDTH, _HEIGHT = 1400, 900
_MARGIN = 24  # pixels
_RIM, _RIM_COLOUR = 0.07, (92, 92, 96)  # m; the upper edges of walls get one, so that one sees where they are
_SIDE_LIGHT = 0.08  # by which surfaces that face one way are darker than those that face the other
_EYE_LEVEL = 1.5  # m
_VIEW_DEG, _DIRECTIONS = 92.0, 72
_MOST_TEXELS = 12_000_000


def doll_house(scene: Scene) -> Bytes:
    """Draw a scene from above and aside; walls that turn their back to the viewer are left out.

    Returns
    -------
    ndarray of uint8, shape (rows, columns, 3)
    """
    low, high = _bounds(scene.surfaces)
    azimuth = math.radians(70.0 if high[0] - low[0] >= high[1] - low[1] else 20.0)
    eye = _frame(low, high, azimuth, math.radians(52.0))
    return _cropped(render(_panels(scene, rims_from=eye.axes[2]), eye, _BACKGROUND))


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
    top = max(s.height for s in scene.surfaces if s.kind not in FLAT)
    level = min(_EYE_LEVEL, 0.6 * top)
    place, direction = _outlook(poses, occluders(scene.surfaces))
    ahead = np.array([math.cos(direction), math.sin(direction)])
    eye = look_at(np.append(place, level), np.append(place + 3.0 * ahead, level - 0.5), _VIEW_DEG, _WIDTH, _HEIGHT)
    return render(_panels(scene, rims_from=None), eye, (238, 240, 242))


def _outlook(poses: Floats, blocks: Floats) -> tuple[Floats, float]:
    """The place on the way and the direction (rad) with the widest view, nothing being close before it."""
    best = (-1.0, poses[0, :2], float(poses[0, 2]))
    angles = np.linspace(0.0, 2.0 * math.pi, _DIRECTIONS, endpoint=False)
    half = round(_DIRECTIONS * _VIEW_DEG / 720.0)
    for place in poses[:: max(len(poses) // 150, 1), :2]:
        ends = sights(np.ascontiguousarray(place), angles, blocks, 12.0)
        away = np.hypot(*(ends - place).T)
        around = np.stack([np.roll(away, -k) for k in range(-half, half + 1)])
        worth = np.minimum(around, 7.0).mean(axis=0) * np.minimum(around.min(axis=0), 1.5)
        if worth.max() > best[0]:
            best = (float(worth.max()), place, float(angles[int(np.argmax(worth))]))
    return best[1], best[2]


def _cropped(image: Bytes) -> Bytes:
    """Only what is drawn, with a margin."""
    drawn = (image != np.array(_BACKGROUND, np.uint8)).any(axis=2)
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    if not len(rows):
        return image
    first = np.maximum([rows[0] - _MARGIN, columns[0] - _MARGIN], 0)
    return np.ascontiguousarray(image[first[0] : rows[-1] + _MARGIN, first[1] : columns[-1] + _MARGIN])


def _panels(scene: Scene, *, rims_from: Floats | None) -> Panels:
    total = sum(texture.shape[0] * texture.shape[1] for texture in scene.textures)
    step = math.ceil(math.sqrt(total / _MOST_TEXELS))
    drawn = []
    for surface, texture in zip(scene.surfaces, scene.textures, strict=True):
        light = 1.0 - _SIDE_LIGHT * (0.5 + 0.5 * float(surface.normal[0])) * (surface.kind not in FLAT)
        shown = coverage(surface, texture.shape[:2])[..., None] * np.uint8(255)
        image = np.concatenate([(texture * light).astype(np.uint8), shown], axis=2)
        drawn.append((_row(surface), np.ascontiguousarray(image[::step, ::step])))
        if rims_from is not None and surface.kind not in FLAT:
            drawn.append(_rim(surface, rims_from))
    return panels(drawn)


def _rim(surface: Surface, ahead: Floats) -> tuple[Floats, Bytes]:
    """The upper side of a wall, as if it were so thick, or the foot of one that turns its back to the viewer."""
    colour = np.array([[[*_RIM_COLOUR, 255]]], np.uint8)
    shown = float(surface.normal @ ahead) < 0.0
    corner = surface.origin + (surface.height if shown else 0.005) * surface.up
    back = np.append(-surface.normal[:2], 0.0)
    thick = _RIM if surface.kind in ("wall", "behind") else 0.4 * _RIM
    return np.concatenate([corner, surface.across, back, [surface.width, thick]]), colour


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
