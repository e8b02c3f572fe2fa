"""Floors and ceilings."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.simulation.looks import materials
from contourslam.simulation.looks.canvas import Canvas, Pixels
from contourslam.simulation.looks.surface import Surface
from contourslam.simulation.looks.walls import Kind
from contourslam.simulation.pieces import Box
from contourslam.simulation.room import Room

Floats = NDArray[np.float64]
_CEILING_PIXEL = 0.02  # m; nothing on a ceiling is fine
_SHADE = 0.10  # m; how far from what stands on it the floor is darker
_RUGS = (
    ((0.55, 0.16, 0.15), (0.93, 0.85, 0.68), (0.14, 0.20, 0.36)),
    ((0.20, 0.34, 0.40), (0.90, 0.88, 0.80), (0.80, 0.52, 0.25)),
)


def draw_floor(room: Room, kind: Kind, pixel: float, chance: np.random.Generator) -> Surface:
    """The floor under the whole room, with a rug at home and lanes in a hall, darker around what stands on it."""
    low, size = _extent(room)
    if kind == "home":
        canvas = materials.parquet(*size, pixel, (0.72, 0.52, 0.34), chance)
        _lay_rug(canvas, chance)
    elif kind == "office":
        canvas = materials.tiles(*size, pixel, (0.58, 0.61, 0.64), chance)
    else:
        canvas = Canvas(*size, pixel, (0.62, 0.62, 0.60))
        canvas.grain(0.08, (1.5, 1.5), chance)
        canvas.grain(0.06, (0.05, 0.05), chance)
        for k in range(1, int(size[0] / 4.0) + 1):
            canvas.shade(4.0 * k, 4.0 * k + 0.02, 0.0, size[1], 0.6)
        for z in (0.25 * size[1], 0.25 * size[1] + 3.0):
            canvas.fill(0.0, size[0], z, z + 0.10, (0.92, 0.76, 0.12))
    for piece in room.pieces:
        if piece.bottom < 0.05:
            half = np.array([piece.length, piece.width]) / 2 if isinstance(piece, Box) else np.full(2, piece.radius)
            yaw = math.radians(piece.yaw_deg) if isinstance(piece, Box) else 0.0
            _shade_round(canvas, np.array([piece.x, piece.y]) - low, half, yaw)
    corner = np.array([low[0], low[1] + size[1], 0.0])
    right, down = np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0])
    return Surface("floor", corner, right, down, *size, canvas.image(), pixel)


def draw_ceiling(room: Room, kind: Kind, chance: np.random.Generator) -> Surface:
    """White plaster with a round lamp at home, panels of light in an office, tubes in a hall."""
    low, size = _extent(room)
    canvas = Canvas(*size, _CEILING_PIXEL, (0.93, 0.93, 0.92))
    canvas.grain(0.02, (1.0, 1.0), chance)
    if kind == "home":
        x, z = 0.48 * size[0], 0.52 * size[1]
        glow = np.exp(-np.hypot(canvas.x - x, canvas.z - z) / 0.6)[..., None].astype(np.float32)
        canvas.pixels += 0.07 * glow
        canvas.disc(x, z, 0.27, (0.62, 0.55, 0.42))
        canvas.disc(x, z, 0.25, (1.0, 0.98, 0.90))
    else:
        panel, each = ((0.6, 0.6), (2.4, 2.4)) if kind == "office" else ((1.8, 0.15), (3.6, 3.0))
        for x in np.arange(each[0] / 2, size[0], each[0]).tolist():
            for z in np.arange(each[1] / 2, size[1], each[1]).tolist():
                edges = x - panel[0] / 2, x + panel[0] / 2, z - panel[1] / 2, z + panel[1] / 2
                canvas.fill(*edges, (1.0, 1.0, 1.0))
                canvas.shade(edges[0], edges[1], edges[2], edges[2] + 0.03, 0.7)
                canvas.shade(edges[0], edges[1], edges[3] - 0.03, edges[3], 0.7)
        step = 0.6 if kind == "office" else 2.5  # joints between its panels
        canvas.pixels[(canvas.x % step < 0.02) | (canvas.z % step < 0.02)] *= np.float32(0.85)
    corner = np.array([low[0], low[1], room.wall_height])
    right, down = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    return Surface("ceiling", corner, right, down, *size, canvas.image(), _CEILING_PIXEL)


def _extent(room: Room) -> tuple[Floats, tuple[float, float]]:
    """Lower left corner and size of the rectangle around the outline, m."""
    points = np.array(room.outline)
    low, high = points.min(axis=0), points.max(axis=0)
    return low, (float(high[0] - low[0]), float(high[1] - low[1]))


def _lay_rug(canvas: Canvas, chance: np.random.Generator) -> None:
    ground, light, dark = _RUGS[int(chance.integers(len(_RUGS)))]
    w, h = min(2.8, 0.45 * canvas.width), min(1.9, 0.40 * canvas.height)
    x0, z0 = (canvas.width - w) / 2 - 0.05 * canvas.width, (canvas.height - h) / 2 - 0.04 * canvas.height
    rug = Canvas(w, h, canvas.pixel, ground)
    inward = np.minimum(np.minimum(rug.x, w - rug.x), np.minimum(rug.z, h - rug.z))
    for edge, thick, hue in ((0.05, 0.03, light), (0.12, 0.10, dark), (0.25, 0.02, light)):
        rug.pixels[(inward > edge) & (inward < edge + thick)] = np.array(hue, dtype=np.float32)
    x, z = (rug.x - w / 2) / 0.45, (rug.z - h / 2) / 0.45
    diamonds = np.abs(((x + z) % 1.0) - 0.5) + np.abs(((x - z) % 1.0) - 0.5)
    rug.pixels[(inward > 0.3) & (diamonds < 0.22)] = np.array(light, dtype=np.float32)
    rug.pixels[(inward > 0.3) & (diamonds < 0.12)] = np.array(dark, dtype=np.float32)
    rug.grain(0.12, (0.010, 0.010), chance)
    canvas.put(x0, z0, rug)


def _shade_round(canvas: Canvas, middle: Floats, half: Floats, yaw: float) -> None:
    """Darken the floor under and around a footprint."""
    reach = float(np.hypot(*half)) + 3 * _SHADE
    x0, x1, z0, z1 = middle[0] - reach, middle[0] + reach, middle[1] - reach, middle[1] + reach
    part: Pixels = canvas.part(x0, x1, z0, z1)
    if part.size == 0:
        return
    first = round(max(x0, 0.0) / canvas.pixel), round(max(canvas.height - z1, 0.0) / canvas.pixel)
    x = canvas.x[:, first[0] : first[0] + part.shape[1]] - middle[0]
    z = canvas.z[first[1] : first[1] + part.shape[0]] - middle[1]
    along, across = np.cos(yaw) * x + np.sin(yaw) * z, np.cos(yaw) * z - np.sin(yaw) * x
    away = np.hypot(np.maximum(np.abs(along) - half[0], 0.0), np.maximum(np.abs(across) - half[1], 0.0))
    part *= (1.0 - 0.45 * np.exp(-away / _SHADE))[..., None].astype(np.float32)
