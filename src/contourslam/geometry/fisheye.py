"""A fisheye camera: which pixel sees which ray, both ways, beyond 90 degrees off the axis too."""

import math
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contourslam.errors import ConfigError

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_MOST_PIXELS = 2**26  # what a file says is not believed beyond
_STEPS = 12  # of Newton's method, which starts within a part in a thousand of the answer
_CLOSE = 1e-10  # in units of the plane at distance 1; 1e-7 pixels
_BEYOND = math.radians(3.0)  # how far beyond the field of view a ray is still told, so that its edge is not lost


@dataclass(frozen=True)
class FisheyeModel:
    """Mei's unified camera model with distortion, as ``cv2.omnidir`` has it.

    A ray is put on the unit sphere, seen from a point `xi` behind its centre, distorted, and scaled to pixels. Pixel
    centres are at whole numbers. The camera's frame is OpenCV's: x right, y down, z out of the lens.

    Parameters
    ----------
    width, height : int
        Of the picture, pixels.
    xi : float
        Distance of the point of projection from the sphere's centre, in radii; 0 is a pinhole camera.
    fx, fy, skew : float
        Scale, pixels.
    cx, cy : float
        Where the axis meets the picture, pixels.
    k1, k2, p1, p2 : float
        Distortion along the radius and across it.
    field_of_view_deg : float
        Full angle of the cone that the lens sees.

    Raises
    ------
    ConfigError
        If a value is out of its range, or the picture's radius does not rise with the angle all through the field of
        view, so that a pixel would see two rays.

    References
    ----------
    C. Mei and P. Rives, Single View Point Omnidirectional Camera Calibration from Planar Grids, ICRA 2007.
    """

    width: int
    height: int
    xi: float
    fx: float
    fy: float
    skew: float
    cx: float
    cy: float
    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    field_of_view_deg: float = 220.0

    def __post_init__(self) -> None:
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        if not all(isinstance(value, int | float) and math.isfinite(value) for value in values.values()):
            raise ConfigError(f"a fisheye model has a value that is no finite number: {values}")
        if not (self.width > 0 and self.height > 0 and self.fx > 0.0 and self.fy > 0.0 and self.xi >= 0.0):
            raise ConfigError("a fisheye model needs width, height, fx and fy above 0 and xi of at least 0")
        if self.width * self.height > _MOST_PIXELS:
            raise ConfigError(f"a fisheye model of {self.width:g} x {self.height:g} pixels is larger than any camera's")
        if not 0.0 < self.field_of_view_deg < 360.0:
            raise ConfigError(f"field_of_view_deg must lie between 0 and 360, got {self.field_of_view_deg:g}")
        rises = math.degrees(self._radii[0][-1])
        if rises < 0.5 * self.field_of_view_deg - 1e-6:
            raise ConfigError(
                f"this fisheye model maps one ray to a pixel only out to {rises:.1f} degrees off the axis, not to half "
                f"its field of view of {self.field_of_view_deg:g} degrees; calibrate it anew"
            )

    @property
    def half_view(self) -> float:
        """Greatest angle off the axis that the lens sees, rad."""
        return math.radians(0.5 * self.field_of_view_deg)

    @property
    def matrix(self) -> Floats:
        """Camera matrix K as OpenCV has it, shape (3, 3)."""
        return np.array([[self.fx, self.skew, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    @property
    def distortion(self) -> Floats:
        """Distortion D as ``cv2.omnidir`` has it: k1, k2, p1, p2."""
        return np.array([self.k1, self.k2, self.p1, self.p2])

    def project(self, rays: ArrayLike) -> tuple[Floats, Bools]:
        """Tell where rays fall in the picture.

        Parameters
        ----------
        rays : array_like, shape (n, 3)
            Camera frame; of any length above 0.

        Returns
        -------
        pixels : ndarray, shape (n, 2)
            Column and row. Rays beyond the lens' sight have their pixel by the formula, or NaN where it has none.
        seen : ndarray of bool, shape (n,)
            Whether the ray is within the field of view and its pixel within the picture.
        """
        rays = np.asarray(rays, dtype=np.float64).reshape(-1, 3)
        with np.errstate(all="ignore"):
            unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
            depth = unit[:, 2] + self.xi
            plane = np.where(depth > 1e-9, unit[:, :2].T / depth, np.nan)
            x, y = self._distort(plane[0], plane[1])
            pixels = np.column_stack([self.fx * x + self.skew * y + self.cx, self.fy * y + self.cy])
            seen = self._in_view(unit) & self._in_picture(pixels)
        return pixels, seen

    def unproject(self, pixels: ArrayLike) -> tuple[Floats, Bools]:
        """Tell which rays pixels see.

        Parameters
        ----------
        pixels : array_like, shape (n, 2)
            Column and row; fractions count.

        Returns
        -------
        rays : ndarray, shape (n, 3)
            Unit rays, camera frame; NaN where no ray falls on the pixel.
        seen : ndarray of bool, shape (n,)
            Whether the pixel is within the picture and its ray within the field of view.
        """
        pixels = np.asarray(pixels, dtype=np.float64).reshape(-1, 2)
        with np.errstate(all="ignore"):
            y = (pixels[:, 1] - self.cy) / self.fy
            x = (pixels[:, 0] - self.cx - self.skew * y) / self.fx
            u, v = self._undistort(x, y)
            square = u * u + v * v
            # The farther of the ray's two points on the sphere has z > -1/xi, which is all that a lens can see.
            scale = (self.xi + np.sqrt(1.0 + (1.0 - self.xi**2) * square)) / (1.0 + square)
            rays = np.column_stack([scale * u, scale * v, scale - self.xi])
            seen = self._in_view(rays) & self._in_picture(pixels)
        return rays, seen

    def _in_view(self, unit: Floats) -> Bools:
        inside: Bools = np.arctan2(np.hypot(unit[:, 0], unit[:, 1]), unit[:, 2]) <= self.half_view + 1e-9
        return inside

    def _in_picture(self, pixels: Floats) -> Bools:
        half = 0.5 * np.array([self.width, self.height])
        inside: Bools = np.all(np.abs(pixels + 0.5 - half) <= half, axis=1)
        return inside

    def _distort(self, u: Floats, v: Floats) -> tuple[Floats, Floats]:
        square = u * u + v * v
        radial = 1.0 + square * (self.k1 + self.k2 * square)
        x = u * radial + 2.0 * self.p1 * u * v + self.p2 * (square + 2.0 * u * u)
        y = v * radial + self.p1 * (square + 2.0 * v * v) + 2.0 * self.p2 * u * v
        return x, y

    @cached_property
    def _radii(self) -> tuple[Floats, Floats, Floats]:
        """Angles off the axis, radii on the plane and distorted ones, as far out as the last rise, without p1, p2."""
        angles = np.linspace(0.0, min(self.half_view + _BEYOND, math.pi), 1024)
        with np.errstate(all="ignore"):
            depth = np.cos(angles) + self.xi
            plane = np.where(depth > 1e-6, np.sin(angles) / depth, np.nan)
            radii = plane * (1.0 + plane**2 * (self.k1 + self.k2 * plane**2))
            rises = (np.diff(radii) > 0.0) & (np.diff(plane) > 0.0)
        last = len(rises) if rises.all() else int(np.argmin(rises))
        return angles[: last + 1], plane[: last + 1], radii[: last + 1]

    def _undistort(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        _, plane, radii = self._radii
        radius = np.hypot(x, y)
        # What lies farther out than any ray of the lens is left alone: there the steps would not settle.
        start = np.interp(radius, radii, plane, right=np.nan) / np.maximum(radius, 1e-300)
        start = np.where((radius > radii[-1]) & (radius < 1.02 * radii[-1]), plane[-1] / radii[-1], start)
        u, v = start * x, start * y
        for _ in range(_STEPS):
            off_x, off_y = self._distort(u, v)
            off_x, off_y = off_x - x, off_y - y
            square = u * u + v * v
            radial, slope = 1.0 + square * (self.k1 + self.k2 * square), 2.0 * self.k1 + 4.0 * self.k2 * square
            across = slope * u * v + 2.0 * (self.p1 * u + self.p2 * v)
            along_x = radial + slope * u * u + 2.0 * self.p1 * v + 6.0 * self.p2 * u
            along_y = radial + slope * v * v + 6.0 * self.p1 * v + 2.0 * self.p2 * u
            area = along_x * along_y - across * across
            u, v = u - (along_y * off_x - across * off_y) / area, v - (along_x * off_y - across * off_x) / area
            if not (np.hypot(off_x, off_y) > _CLOSE).any():
                break
        off_x, off_y = self._distort(u, v)
        # Beyond the last rise the method could find a ray on the falling side.
        good = (np.hypot(off_x - x, off_y - y) < 10.0 * _CLOSE) & (np.hypot(u, v) <= plane[-1] * 1.05)
        return np.where(good, u, np.nan), np.where(good, v, np.nan)
