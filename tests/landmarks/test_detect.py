import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from contourslam.config import Config, LidarConfig
from contourslam.contour import Contours
from contourslam.detectors import DETECTORS, make_detector
from contourslam.landmarks import detect, find_landmarks, trace
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
Scans = Callable[..., LaserScan]
Rooms = Callable[..., Floats]
SQUARE = [(-2.0, -1.5), (2.5, -1.5), (2.5, 2.0), (-2.0, 2.0)]
BOX = [(0.9, -0.4), (1.5, -0.6), (1.7, 0.0), (1.1, 0.2)]


@dataclass(frozen=True)
class FarthestFromChord:
    """A fifth detector: how far a point lies from the chord between its neighbours five points away."""

    equalized: bool = True
    threshold: float = 0.08

    def respond(self, contours: Contours) -> Floats:
        response = np.zeros(len(contours.points))
        for i in range(len(contours)):
            chain, start = contours[i], contours.starts[i]
            for k in range(5, len(chain) - 5):
                chord, arm = chain[k + 5] - chain[k - 5], chain[k] - chain[k - 5]
                response[start + k] = abs(chord[0] * arm[1] - chord[1] * arm[0]) / max(np.hypot(*chord), 1e-9)
        return response

    def reach(self, contours: Contours) -> int:
        return 5


def test_a_fifth_detector_needs_no_change_of_ours(room: Rooms, scan_of: Scans) -> None:
    scan = scan_of(room(SQUARE), (0.2, 0.1, 0.4), sigma=0.005)
    fifth = detect(scan, FarthestFromChord(), Config())
    ours = detect(scan, make_detector("matched_filter"), Config())
    assert len(fifth.corners) == len(ours.corners) == 4
    order = [int(np.argmin(np.linalg.norm(fifth.corners.positions - p, axis=1))) for p in ours.corners.positions]
    np.testing.assert_allclose(fifth.corners.positions[order], ours.corners.positions, atol=0.003)


@pytest.mark.parametrize("adapted", [True, False])
@pytest.mark.parametrize("name", list(DETECTORS))
def test_every_stage_of_a_detection_fits_the_one_before(room: Rooms, scan_of: Scans, name: str, adapted: bool) -> None:
    detector = make_detector(name, adapted=adapted)
    found = detect(scan_of(room(SQUARE, BOX), sigma=0.01), detector, Config())
    assert (found.curve is found.contours) == (not detector.equalized)
    assert found.response.shape == (len(found.curve.points),)
    assert (found.response[found.candidates] >= detector.threshold).all()
    assert (np.diff(found.candidates) > 0).all()
    assert 0 < len(found.corners) <= len(found.candidates)
    assert len(found.walls) >= 4
    # A raw vertex is a point of the raw contours, near to the point of the curve that it came from.
    for vertex in found.corners.vertices:
        assert np.linalg.norm(found.contours.points - vertex, axis=1).min() == 0.0
        assert np.linalg.norm(found.curve.points[found.candidates] - vertex, axis=1).min() < 0.15


def test_the_curve_is_spaced_by_the_greater_of_length_and_noise(room: Rooms, scan_of: Scans) -> None:
    scan = scan_of(room(SQUARE), sigma=0.01)
    for sigma, spacing in ((0.001, 0.05), (0.02, 0.12)):
        config = Config(lidar=LidarConfig(sigma_range=sigma))
        assert detect(scan, make_detector("wu"), config).curve.spacing == pytest.approx(spacing)


def test_stages_are_reported_in_their_order_and_walls_only_where_asked_for(room: Rooms, scan_of: Scans) -> None:
    contours = trace(scan_of(room(SQUARE)), Config())
    stages: list[str] = []
    found = find_landmarks(contours, make_detector("wu"), Config(), stages.append, walls=False)
    assert stages == ["equalization", "detection", "refinement", "walls"]
    assert len(found.walls) == 0
    assert found.walls.lines.shape == (0, 2)
    stages.clear()
    find_landmarks(contours, make_detector("wu", adapted=False), Config(), stages.append)
    assert stages == ["detection", "refinement", "walls"]


def test_the_same_scan_gives_the_same_landmarks_and_is_left_as_it_was(room: Rooms, scan_of: Scans) -> None:
    scan = scan_of(room(SQUARE, BOX), sigma=0.01)
    contours = trace(scan, Config())
    before = contours.points.copy()
    first, second = (find_landmarks(contours, make_detector("matched_filter"), Config()) for _ in range(2))
    np.testing.assert_array_equal(first.corners.positions, second.corners.positions)
    np.testing.assert_array_equal(first.walls.lines, second.walls.lines)
    np.testing.assert_array_equal(contours.points, before)


@pytest.mark.parametrize("name", list(DETECTORS))
@pytest.mark.parametrize("beams", [0, 1, 5])
def test_a_scan_of_hardly_any_beams_has_no_landmarks(name: str, beams: int) -> None:
    scan = LaserScan(0.0, np.arange(beams) * 0.01, np.full(beams, 2.0), np.zeros(beams), 0.1, 10.0)
    for adapted in (True, False):
        found = detect(scan, make_detector(name, adapted=adapted), Config())
        assert len(found.corners) == len(found.walls) == len(found.candidates) == 0


@pytest.mark.parametrize("name", list(DETECTORS))
def test_ranges_of_every_bad_kind_leave_the_corners_where_they_are(room: Rooms, scan_of: Scans, name: str) -> None:
    scan = scan_of(room(SQUARE), sigma=0.005)
    rng = np.random.default_rng(2)
    ranges = scan.ranges.copy()
    bad = rng.choice(500, 25, replace=False)
    ranges[bad] = rng.choice([math.nan, math.inf, 0.0, -1.0, 30.0, 99.0], 25)
    found = detect(replace(scan, ranges=ranges), make_detector(name), Config())
    assert len(found.corners) >= 3
    for position in found.corners.positions:
        assert np.linalg.norm(np.array(SQUARE) - position, axis=1).min() < 0.02


def test_motion_is_undone_whatever_the_mount(room: Rooms, cast: Callable[..., Floats]) -> None:
    beams, speed = 500, 1.0
    offsets = np.linspace(0.0, 0.1, beams)
    angles = -math.pi + 2.0 * math.pi / beams * np.arange(beams)
    origins = np.stack([speed * offsets, np.zeros(beams)], axis=1)
    scan = LaserScan(0.0, angles, cast(room(SQUARE), origins, angles), offsets, 0.05, 30.0)
    times = np.array([0.0, 0.1])
    motion = (times, np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]))
    for contours in (trace(scan, Config(), motion), trace(scan, Config(), motion, np.array([0.3, 0.2, 0.0]))):
        x, y = contours.points.T
        off = np.min([np.abs(x + 2.0), np.abs(x - 2.5), np.abs(y + 1.5), np.abs(y - 2.0)], axis=0)
        assert off.max() < 1e-9
    still = trace(scan, Config()).points
    assert np.abs(np.hypot(*still.T) - scan.ranges).max() < 1e-12
