"""Results show themselves in a notebook: as well-formed HTML, escaped, and small however large they are."""

import math
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from contourslam.config import Config, SlamConfig
from contourslam.contour import Contours
from contourslam.detectors import DETECTORS, make_detector
from contourslam.display import MOST, Sketch, card, metres
from contourslam.errors import ConfigError, RecordingError, ScanError
from contourslam.landmarks import detect, find_corners
from contourslam.maps import SavedMap
from contourslam.recordings import Recording, Topic
from contourslam.replay import replay
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap

LARGE = 200_000  # bytes
SVG = "{http://www.w3.org/2000/svg}"
NASTY = '<script>alert("1&2")</script>'


def parsed(thing) -> ElementTree.Element:
    """Its HTML, which is XML too; it is small and asks for nothing from elsewhere."""
    text = thing if isinstance(thing, str) else thing._repr_html_()
    assert len(text.encode()) < LARGE
    assert "<script" not in text
    assert all(word not in text for word in ("src=", "href=", "url(", "nan", "inf "))
    return ElementTree.fromstring(text)


def texts(root: ElementTree.Element) -> list[str]:
    return [text for text in root.itertext() if text]


def corner_map(n: int) -> CornerMap:
    rng = np.random.default_rng(1)
    return CornerMap(
        np.arange(n), rng.normal(0.0, 50.0, (n, 2)), np.tile(1e-4 * np.eye(2), (n, 1, 1)), np.zeros(n), np.ones(n),
        np.ones(n, dtype=bool), np.full(n, 9), np.ones(n, dtype=np.int64),
    )  # fmt: skip


def wall_map(n: int) -> WallMap:
    rng = np.random.default_rng(2)
    return WallMap(
        np.arange(n), rng.normal(0.0, 50.0, (n, 2, 2)), np.zeros((n, 2, 2, 2)), np.zeros(n), np.zeros((n, 2, 2)),
        np.full(n, 9), np.ones(n, dtype=np.int64),
    )  # fmt: skip


@pytest.fixture(scope="module")
def scan(room, scan_of):
    return scan_of(
        room([(-3, -2), (4, -2), (4, 3), (-3, 3)], [(1, 1), (2, 1), (2, 1.8), (1, 1.8)]), beams=360, sigma=0.01
    )


@pytest.fixture(scope="module")
def result(scan):
    def messages():
        for i in range(5):
            yield Odometry(float(i), np.array([0.0, 0.0, 0.0]))
            yield replace(scan, stamp=float(i))

    return replay(messages(), Config(slam=SlamConfig(walls=True)))


def test_every_kind_of_result_is_well_formed_with_a_drawing_and_figures(scan, result) -> None:
    seen = detect(scan, make_detector("wu"), Config())
    kept = SavedMap(result.corner_map, result.wall_map)
    for thing in (scan, seen, seen.contours, seen.curve, result, result.corner_map, result.wall_map, kept):
        root = parsed(thing)
        (drawing,) = root.iter(f"{SVG}svg")
        assert drawing.get("role") == "img"
        assert drawing.get("aria-label")
        assert list(root.iter("tr"))


def test_results_without_anything_in_them_show_that(result) -> None:
    nothing = Contours(np.empty((0, 2)), np.zeros(1, np.int64), np.zeros(0, np.bool_), 0.0, np.empty(0))
    empty_scan = LaserScan(0.0, np.empty(0), np.empty(0), np.empty(0), 0.1, 10.0)
    blind = LaserScan(0.0, np.zeros(3), np.array([np.nan, np.inf, 0.0]), np.zeros(3), 0.1, math.inf)
    no_run = replace(
        result, stamps=np.empty(0), poses=np.empty((0, 3)), odometry=np.empty((0, 3)), truth=np.empty((0, 3)),
        corner_map=corner_map(0), wall_map=wall_map(0),
    )  # fmt: skip
    for thing in (nothing, empty_scan, no_run, corner_map(0), wall_map(0), SavedMap(corner_map(0), wall_map(0))):
        parsed(thing)
    assert "3, 0" in texts(parsed(blind))


def test_huge_results_stay_small(result) -> None:
    n = 100_000
    way = np.cumsum(np.random.default_rng(0).normal(size=(n, 3)), axis=0)
    huge = replace(
        result, stamps=np.arange(n, dtype=float), poses=way, odometry=way + 1.0, truth=way + 2.0,
        corner_map=corner_map(20_000), wall_map=wall_map(20_000),
    )  # fmt: skip
    for thing in (huge, huge.corner_map, huge.wall_map, SavedMap(huge.corner_map, huge.wall_map)):
        parsed(thing)


def test_what_people_wrote_is_escaped(result, tmp_path) -> None:
    kept = SavedMap(corner_map(2), wall_map(2), about={NASTY: NASTY})
    skipped = replace(result, skipped={NASTY: 1})

    class Odd(Recording):
        start = end = None
        messages = None

        def topics(self):
            return [Topic(NASTY, NASTY, 3)]

    Odd.__abstractmethods__ = frozenset()
    for thing in (kept, skipped, Odd(tmp_path / "<b>&.bag"), card(NASTY, {NASTY: NASTY})):
        assert any(NASTY in text or "<b>&" in text for text in texts(parsed(thing)))


def test_a_damaged_recording_says_so(tmp_path) -> None:
    class Damaged(Recording):
        start = end = None
        messages = None

        def topics(self):
            raise RecordingError("cut off at byte 7")

    Damaged.__abstractmethods__ = frozenset()
    assert "cut off at byte 7" in texts(parsed(Damaged(tmp_path / "x.bag")))


def test_a_run_says_how_far_it_is_off(result) -> None:
    off = replace(result, truth=result.poses + np.array([0.3, 0.4, 0.0]))
    assert "0.50 m" in texts(parsed(off))


def test_a_drawing_has_one_scale_and_y_up() -> None:
    sketch = Sketch("two points")
    sketch.way([(0.0, 0.0), (2.0, 1.0)], "red")
    (path,) = ElementTree.fromstring(sketch.svg()).iter(f"{SVG}path")
    (x0, y0), (x1, y1) = (map(float, word.split()) for word in path.get("d")[1:].split("L"))
    assert x1 - x0 == pytest.approx(2.0 * (y0 - y1))
    assert y1 < y0


def test_of_very_many_points_some_are_drawn_and_none_that_is_not_finite() -> None:
    sketch = Sketch("many")
    points = np.random.default_rng(0).normal(size=(10 * MOST, 2))
    points[5] = np.nan
    sketch.dots(points, "red")
    assert sketch.svg().count("h0") == MOST
    alone = Sketch("one")
    alone.dots([(3.0, 3.0)], "red")
    ElementTree.fromstring(alone.svg())


def test_lengths_are_told_as_people_read_them() -> None:
    assert metres(0.0042) == "4.2 mm"
    assert metres(12.3456) == "12.35 m"


@pytest.mark.parametrize("name", DETECTORS)
def test_corners_come_from_two_arrays_as_two_arrays(scan, name) -> None:
    positions, beams = find_corners(scan.ranges, scan.angles, name)
    true = np.array([(-3, -2), (4, -2), (-3, 3), (1, 1)], dtype=float)  # those that can be seen well from the middle
    assert len(positions) == len(beams) >= 4
    nearest = np.hypot(*(positions[:, None] - true).transpose(2, 0, 1)).min(axis=1)
    assert nearest.max() < 0.05
    ends = np.stack([scan.ranges * np.cos(scan.angles), scan.ranges * np.sin(scan.angles)], axis=-1)
    assert np.hypot(*(ends[beams] - positions).T).max() < 0.1


def test_corners_of_no_returns_are_none_and_of_nonsense_an_error() -> None:
    angles = np.linspace(-3.0, 3.0, 50)
    positions, beams = find_corners(np.full(50, np.inf), angles)
    assert positions.shape == (0, 2)
    assert beams.shape == (0,)
    assert find_corners([], [])[0].shape == (0, 2)
    with pytest.raises(ScanError):
        find_corners(np.ones(3), angles)
    with pytest.raises(ConfigError):
        find_corners(np.ones(50), angles, "nobody")
