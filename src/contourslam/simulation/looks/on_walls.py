"""What hangs on walls, or is let into them: each draws a canvas of its own."""

from collections.abc import Callable

import numpy as np

from contourslam.simulation.looks.canvas import Canvas, smooth
from contourslam.simulation.looks.materials import tone, wood

Artist = Callable[[float, float, float, np.random.Generator], Canvas]
_PALETTES = (
    ((0.93, 0.90, 0.82), (0.13, 0.22, 0.38), (0.86, 0.33, 0.22), (0.95, 0.75, 0.27), (0.25, 0.52, 0.50)),
    ((0.95, 0.94, 0.90), (0.18, 0.18, 0.20), (0.80, 0.20, 0.18), (0.20, 0.42, 0.70), (0.93, 0.78, 0.20)),
    ((0.22, 0.18, 0.30), (0.93, 0.56, 0.36), (0.98, 0.82, 0.58), (0.52, 0.28, 0.46), (0.30, 0.56, 0.66)),
    ((0.90, 0.93, 0.88), (0.20, 0.40, 0.30), (0.55, 0.70, 0.40), (0.92, 0.62, 0.42), (0.35, 0.26, 0.22)),
)


def window(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """A window with two wings and a view of sky, hills and trees."""
    canvas = Canvas(width, height, pixel, (0.95, 0.95, 0.94))
    view = landscape(width - 0.12, height - 0.12, pixel, chance, palette=((0.62, 0.80, 0.96), (0.90, 0.95, 0.98)))
    canvas.put(0.06, 0.06, view)
    canvas.fill(width / 2 - 0.05, width / 2 + 0.05, 0.0, height, (0.94, 0.94, 0.93))
    for x0, x1 in ((0.06, width / 2 - 0.05), (width / 2 + 0.05, width - 0.06)):
        for edge in ((x0, x0 + 0.008, 0.06, height - 0.06), (x0, x1, height - 0.072, height - 0.06)):
            canvas.shade(*edge, 0.6)
    canvas.fill(width / 2 - 0.012, width / 2 + 0.012, 0.45 * height, 0.45 * height + 0.12, (0.6, 0.6, 0.6))
    canvas.fill(0.0, width, 0.0, 0.035, (0.80, 0.80, 0.78))
    return canvas


def door(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """A panelled door in its frame; `height` is that of the opening."""
    white = chance.random() < 0.5
    canvas = wood(width, height, pixel, (0.90, 0.89, 0.86) if white else (0.52, 0.34, 0.22), chance)
    if white:
        canvas.pixels[:] = 0.9 + 0.15 * (canvas.pixels - 0.9)
    inset = 0.12 * width
    for z0, z1 in ((0.10 * height, 0.44 * height), (0.52 * height, 0.93 * height)):
        canvas.shade(inset, width - inset, z0, z1, 0.70)
        canvas.shade(inset + 0.012, width - inset, z0, z1 - 0.012, 1.42)
        canvas.shade(inset + 0.024, width - inset - 0.012, z0 + 0.012, z1 - 0.024, 0.97)
    canvas.fill(0.04 * width, 0.04 * width + 0.045, 0.46 * height, 0.46 * height + 0.14, (0.75, 0.72, 0.62))
    canvas.fill(0.04 * width + 0.01, 0.04 * width + 0.14, 0.495 * height, 0.495 * height + 0.022, (0.62, 0.58, 0.48))
    for edge in ((0.0, 0.012, 0.0, height), (width - 0.012, width, 0.0, height), (0.0, width, height - 0.012, height)):
        canvas.shade(*edge, 0.55)
    return canvas


def landscape(
    width: float,
    height: float,
    pixel: float,
    chance: np.random.Generator,
    palette: tuple[tuple[float, ...], tuple[float, ...]] | None = None,
) -> Canvas:
    """Sky over hills, with a sun and trees; `palette` is the sky's colour above and at the horizon."""
    skies = (((0.20, 0.32, 0.58), (0.97, 0.72, 0.48)), ((0.45, 0.66, 0.86), (0.93, 0.92, 0.84)))
    high, low = palette or skies[int(chance.integers(len(skies)))]
    canvas = Canvas(width, height, pixel)
    part = np.clip(canvas.z / height, 0.0, 1.0)[..., None]
    canvas.pixels[:] = part * np.array(high, np.float32) + (1.0 - part) * np.array(low, np.float32)
    clouds = smooth(canvas.pixels.shape, (0.10 * height / pixel, 0.35 * width / pixel), chance)
    clouds += 0.5 * smooth(canvas.pixels.shape, (0.04 * height / pixel, 0.12 * width / pixel), chance)
    canvas.pixels += 0.35 * np.clip(clouds - 0.2, 0.0, 1.0)[..., None]
    canvas.disc(
        width * chance.uniform(0.15, 0.85), height * chance.uniform(0.6, 0.85), 0.07 * height, (1.0, 0.95, 0.75)
    )
    hues = [chance.uniform(0.30, 0.45), chance.uniform(0.20, 0.30), chance.uniform(0.10, 0.20)]
    for k, (level, green) in enumerate(zip((0.50, 0.36, 0.20), hues, strict=True)):
        ridge = height * (level + 0.14 * smooth((1, canvas.pixels.shape[1]), (1.0, 0.3 * width / pixel), chance))
        canvas.pixels[canvas.z < ridge] = np.array([green * 0.8, green + 0.22 - 0.03 * k, green * (1.6 - 0.5 * k)])
    for _ in range(5):
        x, z, size = chance.uniform(0, width), height * chance.uniform(0.08, 0.22), height * chance.uniform(0.06, 0.12)
        canvas.fill(x - 0.1 * size, x + 0.1 * size, z - size, z, (0.25, 0.18, 0.12))
        canvas.disc(x, z + 0.5 * size, size, (0.12, chance.uniform(0.28, 0.42), 0.14), squeeze=1.3)
    return canvas


def abstract(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """A composition of circles and bars."""
    hues = _PALETTES[int(chance.integers(len(_PALETTES)))]
    canvas = Canvas(width, height, pixel, hues[0])
    for _ in range(7):
        hue, x, z = hues[int(chance.integers(1, len(hues)))], chance.uniform(0, width), chance.uniform(0, height)
        kind, size = int(chance.integers(3)), min(width, height) * chance.uniform(0.1, 0.32)
        if kind == 0:
            canvas.disc(x, z, size, hue)
            canvas.disc(x, z, 0.55 * size, hues[int(chance.integers(len(hues)))])
        elif kind == 1:
            canvas.fill(x - size, x + size, z - 0.25 * size, z + 0.25 * size, hue)
        else:
            slope, offset = chance.uniform(-1.5, 1.5), z
            canvas.pixels[np.abs(canvas.z - offset - slope * (canvas.x - x)) < 0.2 * size] = np.array(hue, np.float32)
    return canvas


def waves(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """Bands of colour that rise and fall."""
    hues = np.array(_PALETTES[int(chance.integers(len(_PALETTES)))], dtype=np.float32)
    canvas = Canvas(width, height, pixel)
    swing = 0.10 * height * np.sin(2 * np.pi * canvas.x / width * chance.uniform(0.7, 1.6) + chance.uniform(0, 6))
    canvas.pixels[:] = hues[np.floor(7.0 * (canvas.z + swing) / height).astype(np.int64) % len(hues)]
    return canvas


def framed(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """A painting or print in a frame, most with a white mount."""
    artist: Artist = (landscape, abstract, waves)[int(chance.integers(3))]
    frame = wood(width, height, pixel, tone((0.45, 0.32, 0.20), chance.uniform(0.4, 1.4)), chance)
    mount = 0.09 * min(width, height) if chance.random() < 0.7 else 0.0
    frame.fill(0.03, width - 0.03, 0.03, height - 0.03, (0.95, 0.94, 0.91))
    inset = 0.03 + mount
    frame.put(inset, inset, artist(width - 2 * inset, height - 2 * inset, pixel, chance))
    return frame


def poster(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """An unframed print with lines of print below it."""
    canvas = Canvas(width, height, pixel, (0.94, 0.93, 0.90))
    artist: Artist = (abstract, waves, landscape)[int(chance.integers(3))]
    canvas.put(0.03, 0.25 * height, artist(width - 0.06, 0.72 * height, pixel, chance))
    canvas.fill(0.05, width - 0.05 - chance.uniform(0.0, 0.3) * width, 0.14 * height, 0.20 * height, (0.12, 0.12, 0.14))
    for line in range(3):
        z = (0.10 - 0.03 * line) * height
        canvas.fill(0.05, width * chance.uniform(0.5, 0.9), z, z + 0.012 * height, (0.35, 0.35, 0.37))
    return canvas


def notice_board(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """Cork with sheets pinned to it."""
    canvas = Canvas(width, height, pixel, (0.74, 0.56, 0.36))
    canvas.grain(0.15, (0.012, 0.012), chance)
    for _ in range(max(3, int(7 * width))):
        w, h = ((0.21, 0.297), (0.148, 0.21), (0.09, 0.09))[int(chance.integers(3))]
        x, z = chance.uniform(0.04, width - w - 0.04), chance.uniform(0.04, max(0.05, height - h - 0.04))
        hue = ((0.96, 0.96, 0.94), (0.98, 0.92, 0.45), (0.65, 0.85, 0.95), (0.96, 0.72, 0.75))[int(chance.integers(4))]
        canvas.fill(x, x + w, z, z + h, hue)
        for line in np.arange(0.12, 0.85, 0.12).tolist():
            end = x + w * chance.uniform(0.5, 0.9)
            canvas.fill(x + 0.1 * w, end, z + line * h, z + line * h + max(0.004, pixel), (0.35, 0.35, 0.40))
        canvas.disc(x + w / 2, z + h - 0.015, 0.010, (0.80, 0.15, 0.15))
    canvas.fill(0.0, width, 0.0, 0.025, (0.75, 0.75, 0.75))
    canvas.fill(0.0, width, height - 0.025, height, (0.75, 0.75, 0.75))
    return canvas


def whiteboard(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """A whiteboard with a drawing in three colours."""
    canvas = Canvas(width, height, pixel, (0.97, 0.97, 0.97))
    pens = ((0.10, 0.15, 0.60), (0.75, 0.10, 0.10), (0.05, 0.45, 0.20))
    for pen in pens:
        x0, z0, span = (
            chance.uniform(0.05, 0.6) * width,
            chance.uniform(0.3, 0.8) * height,
            chance.uniform(0.2, 0.35) * width,
        )
        curve = z0 + 0.12 * height * np.sin((canvas.x - x0) / span * chance.uniform(5, 12))
        on = (np.abs(canvas.z - curve) < 0.010) & (canvas.x > x0) & (canvas.x < x0 + span)
        canvas.pixels[on] = np.array(pen, dtype=np.float32)
        for z in (chance.uniform(0.1, 0.9, 3) * height).tolist():
            canvas.fill(x0, x0 + chance.uniform(0.1, 0.3), z, z + 0.012, pen)
    rim = (
        (0, width, 0, 0.03),
        (0, width, height - 0.02, height),
        (0, 0.02, 0, height),
        (width - 0.02, width, 0, height),
    )
    for x0, x1, z0, z1 in rim:
        canvas.fill(x0, x1, z0, z1, (0.70, 0.71, 0.72))
    return canvas


def radiator(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """White ribs."""
    canvas = Canvas(width, height, pixel, (0.92, 0.92, 0.90))
    canvas.pixels *= (0.84 + 0.16 * np.abs(np.sin(np.pi * canvas.x / 0.06)))[..., None]
    canvas.shade(0.0, width, height - 0.03, height, 0.85)
    canvas.shade(0.0, width, 0.0, 0.03, 0.8)
    return canvas


def sign(width: float, height: float, pixel: float, chance: np.random.Generator) -> Canvas:
    """A sign of a workshop: a bar, an arrow or stripes on a strong colour."""
    hue = ((0.10, 0.45, 0.25), (0.95, 0.78, 0.10), (0.12, 0.30, 0.62), (0.78, 0.14, 0.12))[int(chance.integers(4))]
    canvas = Canvas(width, height, pixel, hue)
    if chance.random() < 0.4:
        canvas.pixels[((canvas.x + canvas.z) % 0.3 < 0.15)] = np.float32(0.08)
        canvas.fill(0.15 * width, 0.85 * width, 0.25 * height, 0.75 * height, hue)
    canvas.fill(0.2 * width, 0.75 * width, 0.45 * height, 0.55 * height, (0.97, 0.97, 0.97))
    canvas.disc(0.75 * width, 0.5 * height, 0.12 * min(width, height), (0.97, 0.97, 0.97))
    return canvas
