"""Materials: what furniture, walls and floors are made of. Each draws a canvas of its own."""

from collections.abc import Callable

import numpy as np

from contourslam.simulation.looks.canvas import Canvas, Colour, smooth

Draw = Callable[[float, float, float, Colour, np.random.Generator], Canvas]
_WHITE = np.ones(3)


def tone(colour: Colour, factor: float) -> np.ndarray:
    """A colour made darker, or lighter where the factor is above 1."""
    base = np.asarray(colour, dtype=np.float64)
    return base * factor if factor <= 1.0 else base + (factor - 1.0) * (_WHITE - base)


def wood(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """Veneer whose grain runs along the longer side."""
    canvas = Canvas(width, height, pixel, colour)
    across = width < height
    length = (0.03, 0.9) if across else (0.9, 0.03)
    fine = (0.25 * length[0], 0.25 * length[1])
    spot = (0.6, 0.05) if across else (0.05, 0.6)
    rings = smooth(canvas.pixels.shape, (spot[0] / pixel, spot[1] / pixel), chance)
    canvas.pixels *= (1.0 + 0.05 * np.sin(12.0 * rings))[..., None]
    canvas.grain(0.09, length, chance)
    canvas.grain(0.06, fine, chance)
    return canvas


def fabric(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """Coarse cloth with seams every half metre or so."""
    canvas = Canvas(width, height, pixel, colour)
    canvas.grain(0.10, (0.012, 0.012), chance)
    canvas.grain(0.08, (0.15, 0.15), chance)
    for k in range(1, max(1, round(width / 0.6))):
        at = k * width / max(1, round(width / 0.6))
        canvas.shade(at - 0.006, at + 0.006, 0.0, height, 0.7)
    canvas.shade(0.0, width, 0.0, 0.015, 0.75)
    return canvas


def cardboard(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """A moving box: tape along its middle, a label, arrows for which side is up."""
    canvas = Canvas(width, height, pixel, colour)
    canvas.grain(0.04, (0.5, 0.006), chance)
    canvas.grain(0.05, (0.2, 0.2), chance)
    canvas.fill(0.0, width, height / 2 - 0.025, height / 2 + 0.025, tone(colour, 1.25))
    ink = (0.25, 0.20, 0.16)
    if min(width, height) > 0.3:
        for x in (0.16 * width, 0.16 * width + 0.05):
            canvas.fill(x, x + 0.012, 0.12 * height, 0.12 * height + 0.08, ink)
            canvas.disc(x + 0.006, 0.12 * height + 0.08, 0.016, ink)
        x0, z0 = width * chance.uniform(0.45, 0.6), height * chance.uniform(0.60, 0.68)
        canvas.fill(x0, x0 + 0.15, z0, z0 + 0.10, (0.93, 0.92, 0.88))
        for line in range(3):
            canvas.fill(
                x0 + 0.015, x0 + chance.uniform(0.07, 0.13), z0 + 0.02 + 0.025 * line, z0 + 0.03 + 0.025 * line, ink
            )
    return canvas


def metal(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """An office cabinet of painted steel: drawers with handles and labels."""
    canvas = Canvas(width, height, pixel, colour)
    canvas.grain(0.04, (0.4, 0.4), chance)
    if min(width, height) < 0.25:
        return canvas
    columns, rows = max(1, round(width / 0.6)), max(1, round(height / 0.35))
    for i in range(columns):
        for j in range(rows):
            x0, z0, w, h = i * width / columns, j * height / rows, width / columns, height / rows
            _outline(canvas, x0 + 0.006, x0 + w - 0.006, z0 + 0.006, z0 + h - 0.006, 0.006, 0.6)
            canvas.fill(x0 + 0.35 * w, x0 + 0.65 * w, z0 + 0.55 * h, z0 + 0.55 * h + 0.02, (0.80, 0.80, 0.80))
            canvas.fill(x0 + 0.40 * w, x0 + 0.60 * w, z0 + 0.70 * h, z0 + 0.70 * h + 0.035, (0.94, 0.93, 0.88))
    return canvas


def cabinet(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """The wooden front of a cupboard or sideboard: doors with panels and knobs, above a dark plinth."""
    canvas = wood(width, height, pixel, colour, chance)
    doors = max(1, round(width / 0.5))
    for k in range(doors):
        x0, x1 = k * width / doors + 0.008, (k + 1) * width / doors - 0.008
        _outline(canvas, x0, x1, 0.08, height - 0.02, 0.005, 0.45)
        inset = min(0.07, 0.2 * (x1 - x0))
        for z0, z1 in (
            ((0.08, height - 0.02),) if height < 1.2 else ((0.08, 0.45 * height), (0.45 * height, height - 0.02))
        ):
            _outline(canvas, x0 + inset, x1 - inset, z0 + inset, z1 - inset, 0.008, 0.65)
            canvas.shade(x0 + inset + 0.008, x1 - inset - 0.008, z0 + inset + 0.008, z1 - inset - 0.008, 1.12)
        canvas.disc(x1 - 0.03 if k % 2 == 0 else x0 + 0.03, 0.52 * height, 0.016, (0.85, 0.78, 0.55))
    canvas.fill(0.0, width, 0.0, 0.06, tone(colour, 0.45))
    return canvas


def books(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """A row of books' spines."""
    canvas, x = Canvas(width, height, pixel, (0.10, 0.08, 0.07)), 0.0
    while x < width:
        thick, high = chance.uniform(0.015, 0.05), height * chance.uniform(0.78, 1.0)
        hue = (
            tone(chance.uniform(0.1, 0.85, 3), 1.0) if chance.random() < 0.6 else tone(colour, chance.uniform(0.6, 1.4))
        )
        canvas.fill(x + 0.001, x + thick - 0.001, 0.0, high, hue)
        canvas.fill(x + 0.003, x + thick - 0.003, 0.7 * high, 0.7 * high + 0.02, tone(hue, 1.6))
        canvas.fill(x + 0.003, x + thick - 0.003, 0.12 * high, 0.12 * high + 0.008, tone(hue, 1.4))
        x += thick
    return canvas


def leaves(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """Foliage."""
    canvas = Canvas(width, height, pixel, tone(colour, 0.4))
    for _ in range(int(220 * width * height) + 60):
        x, z = chance.uniform(0, width), chance.uniform(0, height)
        hue = tone(colour, chance.uniform(0.6, 1.35)) * chance.uniform(0.85, 1.15, 3)
        # A leaf over the right edge goes on at the left: the canvas is wound round a column.
        for shift in (-width, 0.0, width):
            canvas.disc(x + shift, z, chance.uniform(0.02, 0.045), hue, squeeze=chance.uniform(0.4, 1.6))
    return canvas


def plain(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """Painted plaster, a little uneven."""
    canvas = Canvas(width, height, pixel, colour)
    canvas.grain(0.03, (0.5, 0.5), chance)
    canvas.grain(0.025, (0.02, 0.02), chance)
    return canvas


def striped(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """Wallpaper: stripes with a row of small flowers in every second one."""
    canvas = Canvas(width, height, pixel, colour)
    each = 0.16
    phase = (canvas.x % (2 * each)) / each
    canvas.pixels *= np.where(phase < 1.0, 1.0, 0.90).astype(np.float32)[..., None]
    canvas.pixels[:, ((canvas.x % each) < 0.008)[0]] *= np.float32(0.82)
    x, z = canvas.x % (2 * each) - 0.5 * each, canvas.z % 0.24 - 0.12
    petals = np.hypot(x, z) < 0.026 * (1.2 + 0.6 * np.cos(5.0 * np.arctan2(z, x)))
    canvas.pixels[petals] *= np.array([0.80, 0.62, 0.60], dtype=np.float32)
    canvas.pixels[np.hypot(x, z) < 0.010] = np.array([0.85, 0.72, 0.35], dtype=np.float32)
    canvas.grain(0.02, (0.6, 0.6), chance)
    return canvas


def brick(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """A wall of bricks, 25 by 7.5 cm with the mortar."""
    canvas = Canvas(width, height, pixel)
    course = np.floor(canvas.z / 0.075).astype(np.int64)
    along = canvas.x + 0.125 * (course % 2)
    number = np.floor(along / 0.25).astype(np.int64)
    tones = chance.uniform(0.72, 1.08, (int(course.max()) + 1, int(number.max()) + 1, 1)).astype(np.float32)
    tones = tones * chance.uniform(0.93, 1.07, (*tones.shape[:2], 3)).astype(np.float32)
    canvas.pixels[:] = np.asarray(colour, dtype=np.float32) * tones[course, number]
    canvas.grain(0.12, (0.012, 0.012), chance)
    mortar = (canvas.z % 0.075 < 0.011) | (along % 0.25 < 0.011)
    canvas.pixels[mortar] = np.array([0.74, 0.71, 0.67], dtype=np.float32)
    canvas.grain(0.05, (0.4, 0.4), chance)
    return canvas


def parquet(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """Floor boards 0.14 m wide, 1.2 m long, laid with a third of a board's shift."""
    canvas = Canvas(width, height, pixel)
    row = np.floor(canvas.z / 0.14).astype(np.int64)
    along = canvas.x + 0.4 * (row % 3)
    number = np.floor(along / 1.2).astype(np.int64)
    tones = chance.uniform(0.80, 1.06, (int(row.max()) + 1, int(number.max()) + 1, 1)).astype(np.float32)
    tones = tones * chance.uniform(0.97, 1.03, (*tones.shape[:2], 3)).astype(np.float32)
    canvas.pixels[:] = np.asarray(colour, dtype=np.float32) * tones[row, number]
    canvas.grain(0.08, (0.7, 0.015), chance)
    canvas.grain(0.06, (0.25, 0.03), chance)
    canvas.pixels[(canvas.z % 0.14 < 0.006) | (along % 1.2 < 0.006)] *= np.float32(0.55)
    return canvas


def tiles(width: float, height: float, pixel: float, colour: Colour, chance: np.random.Generator) -> Canvas:
    """Square tiles of 0.5 m with grey joints."""
    canvas = Canvas(width, height, pixel)
    i, j = np.floor(canvas.z / 0.5).astype(np.int64), np.floor(canvas.x / 0.5).astype(np.int64)
    tones = chance.uniform(0.90, 1.04, (int(i.max()) + 1, int(j.max()) + 1, 1)).astype(np.float32)
    canvas.pixels[:] = np.asarray(colour, dtype=np.float32) * tones[i, j]
    canvas.grain(0.06, (0.08, 0.08), chance)
    canvas.grain(0.05, (0.6, 0.6), chance)
    canvas.pixels[(canvas.z % 0.5 < 0.010) | (canvas.x % 0.5 < 0.010)] = np.array([0.42, 0.42, 0.42], dtype=np.float32)
    return canvas


def _outline(canvas: Canvas, x0: float, x1: float, z0: float, z1: float, line: float, factor: float) -> None:
    canvas.shade(x0, x1, z0, z0 + line, factor)
    canvas.shade(x0, x1, z1 - line, z1, factor)
    canvas.shade(x0, x0 + line, z0, z1, factor)
    canvas.shade(x1 - line, x1, z0, z1, factor)
