"""Exact pictures of checkerboards through a lens that is none of the models that are fitted to it."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.geometry.rigid import rigid, rotation_from_vector

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_MARGIN = 0.7  # of white paper around the squares, in squares
_BLACK, _WHITE, _DARK = 35.0, 205.0, 4.0  # grey levels; the last is what is outside of the lens' circle


@dataclass(frozen=True)
class PolynomialLens:
    """A fisheye whose radius is a polynomial of the angle off the axis, f (t + a t^3 + b t^5).

    Parameters
    ----------
    width, height : int
        Of the picture, pixels.
    f : float
        Pixels for each radian at the axis.
    a, b : float
        What a lens is off the equidistant one.
    cx, cy : float
        Where the axis meets the picture, pixels.
    field_of_view_deg : float
        Full angle of the cone that the lens sees.
    """

    width: int
    height: int
    f: float
    a: float
    b: float
    cx: float
    cy: float
    field_of_view_deg: float = 220.0

    @cached_property
    def _curve(self) -> tuple[Floats, Floats]:
        angles = np.linspace(0.0, math.radians(0.5 * self.field_of_view_deg + 4.0), 40_000)
        return angles, self.f * angles * (1.0 + angles**2 * (self.a + self.b * angles**2))

    @cached_property
    def all_rays(self) -> tuple[Floats, Bools]:
        """Rays of all pixels, row by row, and which are within the field of view."""
        rows, columns = np.mgrid[: self.height, : self.width]
        return self.unproject(np.column_stack([columns.ravel(), rows.ravel()]))

    def project(self, rays: ArrayLike) -> tuple[Floats, Bools]:
        """Tell where rays, shape (n, 3), fall, shape (n, 2), and which are within the field of view."""
        rays = np.asarray(rays, dtype=np.float64)
        across = np.hypot(rays[:, 0], rays[:, 1])
        angle = np.arctan2(across, rays[:, 2])
        radius = self.f * angle * (1.0 + angle**2 * (self.a + self.b * angle**2))
        scale = radius / np.maximum(across, 1e-300)
        pixels = np.column_stack([self.cx + scale * rays[:, 0], self.cy + scale * rays[:, 1]])
        return pixels, angle <= math.radians(0.5 * self.field_of_view_deg)

    def unproject(self, pixels: ArrayLike) -> tuple[Floats, Bools]:
        """Tell which unit rays, shape (n, 3), pixels, shape (n, 2), see, and which are within the field of view."""
        offset = np.asarray(pixels, dtype=np.float64) - (self.cx, self.cy)
        radius = np.hypot(offset[:, 0], offset[:, 1])
        angles, radii = self._curve
        angle = np.interp(radius, radii, angles)
        scale = np.sin(angle) / np.maximum(radius, 1e-300)
        rays = np.column_stack([scale * offset[:, 0], scale * offset[:, 1], np.cos(angle)])
        return rays, (radius < radii[-1]) & (angle <= math.radians(0.5 * self.field_of_view_deg))


def render_board(
    lens: PolynomialLens,
    corners: tuple[int, int],
    square: float,
    T_camera_board: Floats,
    *,
    seed: int = 0,
    noise: float = 2.0,
    blur: float = 0.7,
    samples: int = 3,
) -> NDArray[np.uint8]:
    """Render a checkerboard in front of a patchy background: every sample of every pixel follows its true ray.

    Parameters
    ----------
    lens : PolynomialLens
    corners : tuple of (int, int)
        Inner corners along and across.
    square : float
        Side of one square, m.
    T_camera_board : ndarray, shape (4, 4)
        m; the board's origin is its first inner corner.
    seed : int
        Of the light, the background and the noise.
    noise : float
        Standard deviation, grey levels.
    blur : float
        Standard deviation of the lens' own blur, pixels.
    samples : int
        Along each side of a pixel.

    Returns
    -------
    ndarray of uint8, shape (height, width)
    """
    rng = np.random.default_rng(seed)
    rays, seen = lens.all_rays
    waves, phases = rng.normal(0.0, 4.0, (6, 3)), rng.uniform(0.0, 2.0 * math.pi, 6)
    patchy = 110.0 + 12.0 * np.cos(rays @ waves.T + phases).sum(axis=1)
    picture = np.where(seen, patchy, _DARK).reshape(lens.height, lens.width)
    low, high = _region(lens, corners, square, T_camera_board)
    if (high > low).all():
        window = slice(low[1], high[1]), slice(low[0], high[0])
        picture[window] = _board(lens, corners, square, T_camera_board, low, high, samples, picture[window])
    fall = 1.0 - 0.35 * (1.0 - np.clip(rays[:, 2].reshape(picture.shape), -0.4, 1.0))  # light falls to the rim
    picture = _blurred(picture * np.maximum(fall, 0.3) * rng.uniform(0.85, 1.1), blur)
    return np.clip(np.rint(picture + rng.normal(0.0, noise, picture.shape)), 0, 255).astype(np.uint8)


def boards_around(
    corners: tuple[int, int], square: float, count: int, *, farthest_deg: float = 108.0, seed: int = 0
) -> list[Floats]:
    """Place boards all around a lens, from its axis out to where the farthest inner corner is at the rim.

    Parameters
    ----------
    corners : tuple of (int, int)
        Inner corners along and across.
    square : float
        Side of one square, m.
    count : int
    farthest_deg : float
        Angle of the outermost inner corner off the axis, degrees.
    seed : int

    Returns
    -------
    list of ndarray, shape (4, 4)
        ``T_camera_board``, m.
    """
    rng = np.random.default_rng(seed)
    middle = 0.5 * square * np.array([corners[0] - 1.0, corners[1] - 1.0, 0.0])
    half = float(np.linalg.norm(middle))
    places = []
    for i in range(count):
        reach = half / math.tan(math.radians(rng.uniform(13.0, 26.0)))  # at which the board fills so much of the view
        angle = math.radians(farthest_deg) * (i / max(count - 1, 1)) ** 0.7
        angle = max(angle - math.atan(half / reach), 0.0)  # the outermost corner counts, whichever way it is turned
        around = math.pi * (3.0 - math.sqrt(5.0)) * i
        ray = np.array([math.sin(angle) * math.cos(around), math.sin(angle) * math.sin(around), math.cos(angle)])
        axis = np.array([-math.sin(around), math.cos(around), 0.0])
        tilted = rng.uniform(0.0, 2.0 * math.pi)
        tilt = rng.uniform(0.15, 0.6) * np.array([math.cos(tilted), math.sin(tilted), 0.0])
        turn = rotation_from_vector(angle * axis) @ rotation_from_vector((0.0, 0.0, rng.uniform(-3.0, 3.0)))
        turn = turn @ rotation_from_vector(tilt)
        places.append(rigid(turn, reach * ray - turn @ middle))
    return places


def _region(
    lens: PolynomialLens, corners: tuple[int, int], square: float, T_camera_board: Floats
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and one-beyond-last column and row that the board with its margin can fall on."""
    u, v = np.meshgrid(*(np.linspace(-1.0 - _MARGIN, count + _MARGIN, 40) for count in corners))
    points = np.column_stack([u.ravel(), v.ravel(), np.zeros(u.size)]) * square
    pixels, _ = lens.project(points @ T_camera_board[:3, :3].T + T_camera_board[:3, 3])
    size = np.array([lens.width, lens.height])
    low = np.clip(np.floor(pixels.min(axis=0)) - 3, 0, size).astype(np.int64)
    return low, np.clip(np.ceil(pixels.max(axis=0)) + 4, 0, size).astype(np.int64)


def _board(
    lens: PolynomialLens, corners: tuple[int, int], square: float, T_camera_board: Floats,
    low: NDArray[np.int64], high: NDArray[np.int64], samples: int, behind: Floats,
) -> Floats:  # fmt: skip
    """The board within a window, over what is behind it."""
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    x = (np.arange(low[0], high[0])[:, None] + offsets).ravel()
    y = (np.arange(low[1], high[1])[:, None] + offsets).ravel()
    columns, rows = np.meshgrid(x, y)
    rays, seen = lens.unproject(np.column_stack([columns.ravel(), rows.ravel()]))
    turn, origin = T_camera_board[:3, :3], T_camera_board[:3, 3]
    slope = rays @ turn[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (origin @ turn[:, 2]) / slope
        u, v = (((rays * reach[:, None] - origin) @ turn[:, :2]) / square).T
        inside = seen & (reach > 0.0)
        paper = inside & (np.abs(u - 0.5 * (corners[0] - 1)) < 0.5 * (corners[0] + 1) + _MARGIN)
        paper &= np.abs(v - 0.5 * (corners[1] - 1)) < 0.5 * (corners[1] + 1) + _MARGIN
        squares = (u > -1.0) & (u < corners[0]) & (v > -1.0) & (v < corners[1])
        black = squares & ((np.floor(u) + np.floor(v)) % 2.0 == 0.0)
    under = np.repeat(np.repeat(behind, samples, axis=0), samples, axis=1).ravel()
    grey = np.where(paper, np.where(black, _BLACK, _WHITE), under)
    shape = high[1] - low[1], samples, high[0] - low[0], samples
    mean: Floats = grey.reshape(shape).mean(axis=(1, 3))
    return mean


def _blurred(picture: Floats, sigma: float) -> Floats:
    """Blur by a Gaussian, in rows and columns."""
    if sigma <= 0.0:
        return picture
    reach = math.ceil(3.0 * sigma)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        padded = np.pad(picture, [(reach, reach) if axis == a else (0, 0) for a in (0, 1)], mode="edge")
        size = picture.shape[axis]
        picture = sum(
            (weight * np.take(padded, range(i, i + size), axis=axis) for i, weight in enumerate(kernel)),
            np.zeros_like(picture),
        )
    return picture


def scan_board(
    T_lidar_board: Floats,
    corners: tuple[int, int],
    square: float,
    angles: Floats,
    walls: float,
    *,
    margin: float = 0.0,
    noise: float = 0.01,
    seed: int = 0,
) -> Floats:
    """Ranges of a lidar that sees a board in the middle of a square room.

    Parameters
    ----------
    T_lidar_board : ndarray, shape (4, 4)
        m; the board's origin is its first inner corner.
    corners : tuple of (int, int)
        Inner corners along and across.
    square : float
        Side of one square, m.
    angles : ndarray, shape (n,)
        Of the beams, rad.
    walls : float
        Distance of the four walls from the lidar, m.
    margin : float
        Of the board around its squares, m.
    noise : float
        Standard deviation, m.
    seed : int

    Returns
    -------
    ndarray, shape (n,)
        m.
    """
    beams = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(angles.size)])
    ranges = walls / np.abs(beams[:, :2]).max(axis=1)
    turn, origin = T_lidar_board[:3, :3], T_lidar_board[:3, 3]
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (origin @ turn[:, 2]) / (beams @ turn[:, 2])
        local = (beams * reach[:, None] - origin) @ turn[:, :2] - 0.5 * square * (np.array(corners) - 1.0)
        hit = (reach > 0.0) & (reach < ranges)
        hit &= (np.abs(local) < 0.5 * square * (np.array(corners) + 1.0) + margin).all(axis=1)
    ranges = np.where(hit, reach, ranges)
    return ranges + np.random.default_rng(seed).normal(0.0, noise, angles.size)


def boards_before(
    T_lidar_camera: Floats, corners: tuple[int, int], square: float, count: int, *, seed: int = 0
) -> list[Floats]:
    """Place boards that the lidar's plane cuts, each tilted differently, where a camera sees them.

    Parameters
    ----------
    T_lidar_camera : ndarray, shape (4, 4)
        m.
    corners : tuple of (int, int)
        Inner corners along and across.
    square : float
        Side of one square, m.
    count : int
    seed : int

    Returns
    -------
    list of ndarray, shape (4, 4)
        ``T_lidar_board``, m.
    """
    rng = np.random.default_rng(seed)
    middle = 0.5 * square * np.array([corners[0] - 1.0, corners[1] - 1.0, 0.0])
    places: list[Floats] = []
    while len(places) < count:
        bearing, reach = rng.uniform(-math.pi, math.pi), rng.uniform(0.7, 2.2)
        # The board faces the lidar (its z axis points away from who sees it), then is tilted.
        facing = np.array([[math.sin(bearing), 0.0, math.cos(bearing)], [-math.cos(bearing), 0.0, math.sin(bearing)],
                           [0.0, -1.0, 0.0]])  # fmt: skip
        tilt = rotation_from_vector((rng.uniform(-0.7, 0.7), rng.uniform(-0.7, 0.7), 0.0))
        turn = facing @ tilt @ rotation_from_vector((0.0, 0.0, rng.uniform(-0.3, 0.3)))
        at = reach * np.array([math.cos(bearing), math.sin(bearing), 0.0]) + (0.0, 0.0, rng.uniform(-0.08, 0.08))
        seen = T_lidar_camera[:3, :3].T @ (at - T_lidar_camera[:3, 3])
        # A lens that looks up from above the board sees it only at its rim.
        if math.acos(seen[2] / float(np.linalg.norm(seen))) < math.radians(100.0):
            places.append(rigid(turn, at - turn @ middle))
    return places
