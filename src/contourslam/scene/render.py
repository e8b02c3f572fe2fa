"""Pictures of a scene, drawn without graphics hardware: each rectangle is met by the rays of the pixels it covers."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contourslam.kernels import kernel

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

_NEAR = 0.05  # m


@dataclass(frozen=True, slots=True)
class Eye:
    """A pinhole camera that looks at a scene.

    Attributes
    ----------
    place : ndarray, shape (3,)
        World frame, m.
    axes : ndarray, shape (3, 3)
        Its rows are the directions to the right, down and ahead.
    focal : float
        Focal length, pixels.
    width, height : int
        Pixels.
    """

    place: Floats
    axes: Floats
    focal: float
    width: int
    height: int


def look_at(place: Floats, target: Floats, view_deg: float, width: int, height: int) -> Eye:
    """Point a camera at a place; `view_deg` is its angle of view across the width, degrees."""
    ahead = (target - place) / np.linalg.norm(target - place)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    focal = 0.5 * width / math.tan(math.radians(0.5 * view_deg))
    return Eye(place, np.stack([right, np.cross(ahead, right), ahead]), focal, width, height)


@dataclass(frozen=True, slots=True)
class Panels:
    """Rectangles to be drawn, one row each.

    Attributes
    ----------
    frames : ndarray, shape (n, 11)
        Lower left corner, unit vectors across and up, width and height, m.
    starts : ndarray of int, shape (n,)
        First texel of each in `texels`.
    shapes : ndarray of int, shape (n, 2)
        Rows and columns of its texture.
    texels : ndarray of uint8, shape (t, 4)
        Red, green, blue, and 0 where there is nothing.
    """

    frames: Floats
    starts: NDArray[np.int64]
    shapes: NDArray[np.int64]
    texels: Bytes


def panels(rectangles: list[tuple[Floats, Bytes]]) -> Panels:
    """Put rectangles together: each a frame of shape (11,) and a texture of shape (rows, columns, 4)."""
    sizes = [texture.shape[0] * texture.shape[1] for _, texture in rectangles]
    return Panels(
        np.array([frame for frame, _ in rectangles]),
        np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int64),
        np.array([texture.shape[:2] for _, texture in rectangles], dtype=np.int64),
        np.concatenate([texture.reshape(-1, 4) for _, texture in rectangles]),
    )


def render(scene: Panels, eye: Eye, background: tuple[int, int, int], samples: int = 2) -> Bytes:
    """Draw a picture; rectangles are seen from their front only.

    Parameters
    ----------
    scene : Panels
    eye : Eye
    background : tuple of int
        Red, green, blue.
    samples : int
        Rays for each pixel in both directions, so that edges are smooth.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
    """
    rows, columns = eye.height * samples, eye.width * samples
    depth = np.full((rows, columns), np.inf)
    fine = np.empty((rows, columns, 3), np.float32)
    fine[:] = background
    _draw(scene.frames, scene.starts, scene.shapes, scene.texels, eye.place, eye.axes, eye.focal * samples, depth, fine)
    means = fine.reshape(eye.height, samples, eye.width, samples, 3).mean(axis=(1, 3))
    return np.asarray(np.clip(means + 0.5, 0.0, 255.0), np.uint8)


@kernel
def _draw(
    frames: Floats,
    starts: NDArray[np.int64],
    shapes: NDArray[np.int64],
    texels: Bytes,
    place: Floats,
    axes: Floats,
    focal: float,
    depth: Floats,
    out: NDArray[np.float32],
) -> None:
    rows, columns = depth.shape
    corner, across, up, normal, ray = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for n in range(frames.shape[0]):
        width, height = frames[n, 9], frames[n, 10]
        for k in range(3):  # into the camera's frame
            corner[k] = across[k] = up[k] = 0.0
            for j in range(3):
                corner[k] += axes[k, j] * (frames[n, j] - place[j])
                across[k] += axes[k, j] * frames[n, 3 + j]
                up[k] += axes[k, j] * frames[n, 6 + j]
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            normal[k] = across[a] * up[b] - across[b] * up[a]
        before = corner[0] * normal[0] + corner[1] * normal[1] + corner[2] * normal[2]
        if before >= 0.0:  # its back
            continue
        left, right, top, bottom = 1e18, -1e18, 1e18, -1e18
        behind = 0
        for i in range(4):
            u, v = width * (i % 2), height * (i // 2)
            z = corner[2] + u * across[2] + v * up[2]
            if z < _NEAR:
                behind += 1
                continue
            x = focal * (corner[0] + u * across[0] + v * up[0]) / z
            y = focal * (corner[1] + u * across[1] + v * up[1]) / z
            left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
        if behind == 4:
            continue
        if behind > 0:
            left, right, top, bottom = -columns, columns, -rows, rows
        r, c = shapes[n, 0], shapes[n, 1]
        first, last = max(int(top + 0.5 * rows) - 1, 0), min(int(bottom + 0.5 * rows) + 2, rows)
        for row in range(first, last):
            for column in range(max(int(left + 0.5 * columns) - 1, 0), min(int(right + 0.5 * columns) + 2, columns)):
                ray[0], ray[1], ray[2] = (column + 0.5 - 0.5 * columns) / focal, (row + 0.5 - 0.5 * rows) / focal, 1.0
                facing = ray[0] * normal[0] + ray[1] * normal[1] + ray[2] * normal[2]
                if facing >= 0.0:
                    continue
                z = before / facing
                if z < _NEAR or z >= depth[row, column]:
                    continue
                u = v = 0.0
                for k in range(3):
                    off = z * ray[k] - corner[k]
                    u += off * across[k]
                    v += off * up[k]
                if u < 0.0 or v < 0.0 or u > width or v > height:
                    continue
                x = min(max(u / width * c - 0.5, 0.0), c - 1.0)
                y = min(max((1.0 - v / height) * r - 0.5, 0.0), r - 1.0)
                i, j = int(y), int(x)
                nearest = starts[n] + int(y + 0.5) * c + int(x + 0.5)
                if texels[nearest, 3] == 0:
                    continue
                depth[row, column] = z
                fy, fx = y - i, x - j
                i1, j1 = min(i + 1, r - 1), min(j + 1, c - 1)
                for k in range(3):
                    above = texels[starts[n] + i * c + j, k] * (1.0 - fx) + texels[starts[n] + i * c + j1, k] * fx
                    below = texels[starts[n] + i1 * c + j, k] * (1.0 - fx) + texels[starts[n] + i1 * c + j1, k] * fx
                    out[row, column, k] = above * (1.0 - fy) + below * fy
