"""A small painted room and an exact picture of it: each pixel's ray is met with every rectangle, in plain NumPy."""

import io
from dataclasses import dataclass, replace

import numpy as np
from PIL import Image

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.recordings.picture import Picture
from contourslam.scene.lens import Lens
from contourslam.scene.surface import Surface, upright
from contourslam.scene.views import View, Views

WIDE, DEEP, HIGH, BOX = 4.0, 3.0, 2.2, 0.5
CORNERS = np.array([[0.0, 0.0], [WIDE, 0.0], [WIDE, DEEP], [0.0, DEEP]])
BOX_CORNERS = np.array([[1.7, 1.3], [2.2, 1.3], [2.2, 1.8], [1.7, 1.8]])
MODEL = FisheyeModel(220, 220, 1.2, 115.0, 115.0, 0.0, 109.5, 109.5)
POSES = np.array(
    [[2.0 + 1.3 * np.cos(a), 1.5 + 0.85 * np.sin(a), a + np.pi / 2] for a in np.linspace(0.0, 2.0 * np.pi, 18)[:-1]]
)


def place_of_camera() -> np.ndarray:
    """A lens 0.4 m above the floor that looks ahead and 20 degrees up."""
    tilt = np.radians(20.0)
    ahead, right = np.array([np.cos(tilt), 0.0, np.sin(tilt)]), np.array([0.0, -1.0, 0.0])
    out = np.eye(4)
    out[:3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=1)
    out[:3, 3] = 0.1, 0.0, 0.4
    return out


LENS = Lens(MODEL, place_of_camera())


@dataclass(frozen=True)
class Painted:
    """A surface with its paint: an image of 50 pixels to the metre, the top row first."""

    surface: Surface
    paint: np.ndarray


def paint(surface: Surface, rng: np.random.Generator) -> np.ndarray:
    """Soft patches of a colour of the surface's own."""
    rows, columns = max(round(surface.height * 50), 2), max(round(surface.width * 50), 2)
    y, x = np.mgrid[:rows, :columns] / 50.0
    base, swing = rng.uniform(90, 170, 3), rng.uniform(25, 45, 3)
    waves = np.sin(2 * np.pi * x / 0.8 + rng.uniform(0, 6)) * np.cos(2 * np.pi * y / 0.7 + rng.uniform(0, 6))
    return base + swing * waves[..., None]


def painted_room(box: bool = True) -> list[Painted]:
    """Four walls, the floor, and perhaps a box in the middle with its lid."""
    rng = np.random.default_rng(4)
    # Free space is inside: seen from there a wall of the counter-clockwise outline runs from its end to its start.
    surfaces = [upright(f"wall-{n}", "wall", CORNERS[(n + 1) % 4], CORNERS[n], HIGH) for n in range(4)]
    axes = np.eye(3)
    surfaces.append(Surface("floor-0", "floor", np.zeros(3), axes[0], axes[1], WIDE, DEEP))
    if box:
        surfaces += [
            upright(f"contour-{n}", "contour", BOX_CORNERS[n], BOX_CORNERS[(n + 1) % 4], BOX) for n in range(4)
        ]
        surfaces.append(Surface("lid", "top", np.append(BOX_CORNERS[0], BOX), axes[0], axes[1], 0.5, 0.5))
    return [Painted(surface, paint(surface, rng)) for surface in surfaces]


def colours_at(painted: Painted, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Colours at distances along a surface, m, interpolated."""
    rows, columns = painted.paint.shape[:2]
    x = np.clip(u / painted.surface.width * columns - 0.5, 0, columns - 1.001)
    y = np.clip((1 - v / painted.surface.height) * rows - 0.5, 0, rows - 1.001)
    i, j = y.astype(int), x.astype(int)
    fy, fx = (y - i)[:, None], (x - j)[:, None]
    p = painted.paint
    return (p[i, j] * (1 - fx) + p[i, j + 1] * fx) * (1 - fy) + (p[i + 1, j] * (1 - fx) + p[i + 1, j + 1] * fx) * fy


def photograph(room: list[Painted], stand: np.ndarray) -> np.ndarray:
    """What a camera sees, shape (height, width, 3), float; black where it sees nothing."""
    rows, columns = np.indices((MODEL.height, MODEL.width))
    rays, seen = MODEL.unproject(np.stack([columns.ravel(), rows.ravel()], axis=1))
    rays = np.where(seen[:, None], rays, np.nan) @ stand[:3, :3].T
    nearest, out = np.full(len(rays), np.inf), np.zeros((len(rays), 3))
    for painted in room:
        s = painted.surface
        with np.errstate(all="ignore"):
            distance = (s.origin - stand[:3, 3]) @ s.normal / (rays @ s.normal)
            at = stand[:3, 3] + distance[:, None] * rays - s.origin
            u, v = at @ s.across, at @ s.up
            met = (rays @ s.normal < 0) & (distance > 0) & (distance < nearest)
            met &= (u >= 0) & (u <= s.width) & (v >= 0) & (v <= s.height)
        nearest[met] = distance[met]
        out[met] = colours_at(painted, u[met], v[met])
    return out.reshape(MODEL.height, MODEL.width, 3)


def as_picture(image: np.ndarray, stamp: float) -> Picture:
    content = io.BytesIO()
    Image.fromarray(np.clip(image + 0.5, 0, 255).astype(np.uint8)).save(content, format="PNG")
    return Picture(stamp, content.getvalue(), "png")


def photographs(room: list[Painted]) -> list[np.ndarray]:
    """What the camera sees from each of the poses."""
    return [photograph(room, LENS.stand(pose)) for pose in POSES]


def views_of(images: list[np.ndarray]) -> Views:
    """Views from the poses, 2 s apart."""
    taken = [View(as_picture(image, 2.0 * n), POSES[n], 0.0) for n, image in enumerate(images)]
    return Views(tuple(taken), len(taken), 0)


def with_picture(views: Views, number: int, picture: Picture) -> Views:
    """The same views, one with another picture."""
    chosen = list(views.chosen)
    chosen[number] = replace(chosen[number], picture=picture)
    return replace(views, chosen=tuple(chosen))
