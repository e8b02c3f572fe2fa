"""Helpers for every folder: rooms made of line segments, a ray caster in plain NumPy, contours made by hand."""

import math
import shutil
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import settings
from numpy.typing import ArrayLike, NDArray

from contourslam.contour import Contours
from contourslam.scan import LaserScan

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
Floats = NDArray[np.float64]
Rooms = Callable[..., Floats]
Scans = Callable[..., LaserScan]

# The first call of a kernel compiles it, which no deadline allows for; and a failure must come back on the next run.
settings.register_profile("contourslam", deadline=None, derandomize=True, database=None)
settings.load_profile("contourslam")


def _room(*polygons: ArrayLike) -> Floats:
    """Closed polygons as segments, shape (k, 2, 2)."""
    loops = [np.asarray(polygon, dtype=float) for polygon in polygons]
    return np.concatenate([np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in loops])


def _cast(segments: Floats, origins: ArrayLike, directions: ArrayLike) -> Floats:
    """Distance from each origin along each direction (rad) to the first segment; inf where there is none."""
    directions = np.asarray(directions, dtype=float)
    origins = np.broadcast_to(np.asarray(origins, dtype=float), (directions.size, 2))
    dx, dy = np.cos(directions)[:, None], np.sin(directions)[:, None]
    ax, ay = (segments[:, 0, i] - origins[:, i, None] for i in range(2))
    ex, ey = segments[:, 1].T - segments[:, 0].T
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (ax * ey - ay * ex) / (dx * ey - dy * ex)
        where = (ax * dy - ay * dx) / (dx * ey - dy * ex)
        hit = (where >= 0.0) & (where <= 1.0) & (along > 0.0)
    return np.where(hit, along, np.inf).min(axis=1)


def _scan_of(
    segments: Floats,
    pose: Sequence[float] = (0.0, 0.0, 0.0),
    *,
    beams: int = 500,
    start: float = -math.pi,
    field_of_view: float = 2.0 * math.pi,
    sigma: float = 0.0,
    seed: int | np.random.Generator = 0,
) -> LaserScan:
    """A lidar standing still at `pose` in a room."""
    angles = start + field_of_view / beams * np.arange(beams)
    ranges = _cast(segments, pose[:2], angles + pose[2])
    ranges = ranges + sigma * np.random.default_rng(seed).standard_normal(beams)
    return LaserScan(0.0, angles, ranges, np.zeros(beams), 0.05, 30.0)


def _contour_of(points: ArrayLike, *, closed: bool = False, spacing: float = 0.0) -> Contours:
    """One contour."""
    rows = np.ascontiguousarray(points, dtype=float).reshape(-1, 2)
    n = len(rows)
    return Contours(rows, np.array([0, n]), np.array([closed]), spacing, np.arange(n, dtype=float))


def _corner_of(turn: float, side: int, spacing: float = 0.05) -> Floats:
    """`side` steps straight on, a turn by so many radians (positive: to the left), `side` steps; the corner is 0, 0."""
    before = np.stack([np.arange(-side, 1) * spacing, np.zeros(side + 1)], axis=1)
    steps = np.arange(1, side + 1)[:, None] * spacing
    return np.concatenate([before, steps * [[math.cos(turn), math.sin(turn)]]])


@pytest.fixture(scope="session")
def room() -> Rooms:
    return _room


@pytest.fixture(scope="session")
def cast() -> Callable[..., Floats]:
    return _cast


@pytest.fixture(scope="session")
def scan_of() -> Scans:
    return _scan_of


@pytest.fixture(scope="session")
def contour_of() -> Callable[..., Contours]:
    return _contour_of


@pytest.fixture(scope="session")
def corner_of() -> Callable[..., Floats]:
    return _corner_of


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are made, but their files are empty drawings: to draw them takes ten times as long as all the rest."""
    empty = '<svg xmlns="http://www.w3.org/2000/svg" width="8" height="8"/>'
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda figure, path, **more: path.write_text(empty))


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A real browser, skipped where there is none; for the tests of a file, for two at once cannot be in a process."""
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine")
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    options = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-background-networking"]
    with api.sync_playwright() as playwright:
        found = playwright.chromium.launch(executable_path=CHROMIUM, args=options)
        yield found
        found.close()
