import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from contourslam.config import Config, ContourConfig, LidarConfig
from contourslam.contour import Contours, segment
from contourslam.landmarks import trace
from contourslam.scan import LaserScan

Floats = NDArray[np.float64]
SQUARE = [(-2.0, -1.5), (2.5, -1.5), (2.5, 2.0), (-2.0, 2.0)]
BOX = [(1.0, -0.3), (1.6, -0.3), (1.6, 0.3), (1.0, 0.3)]
QUIET = replace(Config(), lidar=LidarConfig(sigma_range=0.001))


def with_ranges(scan: LaserScan, ranges: Floats) -> LaserScan:
    return replace(scan, ranges=ranges)


def in_beam_order(scan: LaserScan, order: NDArray[np.int64] | slice) -> LaserScan:
    return replace(scan, angles=scan.angles[order], ranges=scan.ranges[order], offsets=scan.offsets[order])


def same_chains(first: Contours, second: Contours) -> None:
    """The same contours, wherever the flat array begins and, on a ring, wherever the ring does."""

    def chains(contours: Contours) -> list[Floats]:
        loops = []
        for i in range(len(contours)):
            chain = contours[i]
            if contours.closed[i]:
                chain = np.roll(chain, -int(np.lexsort(chain.round(9).T)[0]), axis=0)
            loops.append(chain)
        return sorted(loops, key=lambda chain: tuple(chain[0].round(9)))

    assert sorted(first.closed) == sorted(second.closed)
    for a, b in zip(chains(first), chains(second), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)


def test_a_room_seen_all_around_is_one_ring_that_runs_counter_clockwise(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan]
) -> None:
    contours = trace(scan_of(room(SQUARE)), QUIET)
    assert len(contours) == 1
    assert contours.closed[0]
    x, y = contours[0].T
    area = 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
    assert area == pytest.approx(4.5 * 3.5, rel=0.01)
    assert len(contours.points) == 500


def test_a_contour_ends_where_the_range_jumps_and_never_holds_two_surfaces(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan]
) -> None:
    contours = trace(scan_of(room(SQUARE, BOX)), QUIET)
    assert len(contours) == 2
    assert not contours.closed.any()
    on_box = [np.abs(contours[i][:, 0] - 1.0) < 1e-6 for i in range(2)]
    assert sorted(bool(near.all()) for near in on_box) == [False, True]
    assert sorted(bool(near.any()) for near in on_box) == [False, True]


@pytest.mark.parametrize(("missing", "parts"), [(1, 1), (2, 1), (3, 2), (30, 2)])
def test_a_contour_goes_on_over_two_beams_without_a_return_and_no_more(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan], missing: int, parts: int
) -> None:
    scan = scan_of(room(SQUARE), field_of_view=math.pi)
    ranges = scan.ranges.copy()
    ranges[200 : 200 + missing] = np.nan
    contours = trace(with_ranges(scan, ranges), QUIET)
    assert len(contours) == parts
    assert len(contours.points) == 500 - missing


def test_the_ends_of_the_field_of_view_end_the_contour(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan]
) -> None:
    scan = scan_of(room(SQUARE), start=-0.75 * math.pi, field_of_view=1.5 * math.pi)
    contours = trace(scan, QUIET)
    assert list(contours.closed) == [False]
    np.testing.assert_allclose(
        np.arctan2(contours.points[[0, -1], 1], contours.points[[0, -1], 0]), scan.angles[[0, -1]], atol=1e-12
    )


@pytest.mark.parametrize("step_deg", [0.51, 0.7, 0.73, 0.9999, 1.0])
@pytest.mark.parametrize("first", [0.0, 0.4, 0.99])
def test_a_full_turn_is_a_ring_although_the_beams_do_not_divide_it(
    room: Callable[..., Floats], cast: Callable[..., Floats], step_deg: float, first: float
) -> None:
    angles = np.radians(step_deg * (np.arange(int(360.0 / step_deg)) + first))
    scan = LaserScan(0.0, angles, cast(room(SQUARE), (0.0, 0.0), angles), np.zeros(angles.size), 0.05, 30.0)
    assert list(trace(scan, QUIET).closed) == [True]


def test_more_than_a_full_turn_stays_whole_and_makes_no_ring_that_steps_back(
    room: Callable[..., Floats], cast: Callable[..., Floats]
) -> None:
    angles = np.linspace(-math.pi, 1.1 * math.pi, 500)
    scan = LaserScan(0.0, angles, cast(room(SQUARE), (0.0, 0.0), angles), np.zeros(500), 0.05, 30.0)
    contours = trace(scan, QUIET)
    assert list(contours.closed) == [False]
    assert len(contours.points) == 500


@pytest.mark.parametrize("polygons", [(SQUARE,), (SQUARE, BOX)])
@pytest.mark.parametrize("shift", [1, 137, 250, 499])
def test_contours_do_not_depend_on_the_beam_the_scan_begins_with(
    room: Callable[..., Floats],
    scan_of: Callable[..., LaserScan],
    polygons: tuple[list[tuple[float, float]], ...],
    shift: int,
) -> None:
    scan = scan_of(room(*polygons))
    rolled = in_beam_order(scan, np.roll(np.arange(500), -shift))
    same_chains(trace(rolled, QUIET), trace(scan, QUIET))
    unwrapped = replace(rolled, angles=np.unwrap(rolled.angles))
    same_chains(trace(unwrapped, QUIET), trace(scan, QUIET))


@pytest.mark.parametrize("polygons", [(SQUARE,), (SQUARE, BOX)])
def test_clockwise_shuffled_and_zero_to_two_pi_scans_give_the_same_contours(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan], polygons: tuple[list[tuple[float, float]], ...]
) -> None:
    scan = scan_of(room(*polygons))
    expected = trace(scan, QUIET)
    same_chains(trace(in_beam_order(scan, slice(None, None, -1)), QUIET), expected)
    same_chains(trace(in_beam_order(scan, np.random.default_rng(0).permutation(500)), QUIET), expected)
    same_chains(trace(replace(scan, angles=scan.angles % (2.0 * math.pi)), QUIET), expected)
    same_chains(trace(replace(scan, angles=scan.angles + 5.0 * math.pi), QUIET), trace(turned(scan), QUIET))


def turned(scan: LaserScan) -> LaserScan:
    return replace(scan, angles=scan.angles + math.pi)


def test_a_clockwise_scan_over_less_than_a_turn_counts_its_missing_beams_too(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan]
) -> None:
    scan = scan_of(room(SQUARE), field_of_view=math.pi)
    ranges = scan.ranges.copy()
    ranges[100:102] = ranges[300:303] = np.inf
    backwards = in_beam_order(with_ranges(scan, ranges), slice(None, None, -1))
    contours = trace(backwards, QUIET)
    assert len(contours) == 2
    same_chains(contours, trace(with_ranges(scan, ranges), QUIET))


def test_a_mixed_pixel_between_two_surfaces_is_dropped_and_a_steep_wall_is_not(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan]
) -> None:
    scan = scan_of(room(SQUARE, BOX))
    edge = int(np.flatnonzero(np.abs(np.diff(scan.ranges)) > 0.8)[0])
    ranges = scan.ranges.copy()
    ranges[edge + 1] = 0.5 * (ranges[edge] + ranges[edge + 2])
    hanging = ranges[edge + 1] * np.array([math.cos(scan.angles[edge + 1]), math.sin(scan.angles[edge + 1])])
    contours = trace(with_ranges(scan, ranges), QUIET)
    assert np.linalg.norm(contours.points - hanging, axis=1).min() > 0.01
    assert len(contours.points) == 499
    corridor = scan_of(room([(-0.5, -9.0), (0.5, -9.0), (0.5, 9.0), (-0.5, 9.0)]))
    kept = trace(corridor, replace(QUIET, contour=ContourConfig(min_points=1))).points
    assert len(kept) == 500


@pytest.mark.parametrize(("beams", "kept"), [(3, False), (4, True)])
def test_a_contour_of_very_few_points_is_dropped(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan], beams: int, kept: bool
) -> None:
    scan = scan_of(room(SQUARE))
    ranges = scan.ranges.copy()
    ranges[250 : 250 + beams] = 1.0
    contours = trace(with_ranges(scan, ranges), QUIET)
    near = np.isclose(np.hypot(*contours.points.T), 1.0)
    assert near.sum() == (beams if kept else 0)


@pytest.mark.parametrize("beams", [0, 1, 2, 3])
def test_hardly_any_beams_give_no_contour(beams: int) -> None:
    scan = LaserScan(0.0, np.arange(beams) * 0.01, np.ones(beams), np.zeros(beams), 0.1, 10.0)
    contours = trace(scan, Config())
    assert len(contours) == 0
    assert contours.points.shape == (0, 2)
    assert list(contours.starts) == [0]


def test_a_scan_without_any_return_gives_no_contour(scan_of: Callable[..., LaserScan]) -> None:
    scan = scan_of(np.array([[[50.0, -1.0], [50.0, 1.0]]]))
    assert len(trace(scan, Config())) == 0


def test_a_changing_number_of_beams_gives_the_same_ring(
    room: Callable[..., Floats], scan_of: Callable[..., LaserScan]
) -> None:
    for beams in (360, 419, 420, 733, 1440):
        contours = trace(scan_of(room(SQUARE), beams=beams), QUIET)
        assert list(contours.closed) == [True]
        assert len(contours.points) == beams


def test_beams_at_uneven_angles_are_taken_as_they_are(room: Callable[..., Floats], cast: Callable[..., Floats]) -> None:
    rng = np.random.default_rng(3)
    angles = -math.pi + 2.0 * math.pi / 700 * (np.arange(700) + rng.uniform(-0.4, 0.4, 700))
    scan = LaserScan(0.0, angles, cast(room(SQUARE), (0.0, 0.0), angles), np.zeros(700), 0.05, 30.0)
    contours = trace(scan, QUIET)
    assert list(contours.closed) == [True]
    assert len(contours.points) == 700


def twin(
    points: Floats,
    bearings: Floats,
    beams: NDArray[np.int64],
    ring: bool,
    count: int,
    sigma: float,
    config: ContourConfig,
) -> list[list[tuple[float, float]]]:
    """Borges and Aldon's cuts with plain lists; the ring's contour that crosses the first beam is joined at the end."""
    reach = [math.hypot(x, y) for x, y in points]
    allowance, shallowest = config.breakpoint_sigmas * sigma, math.radians(config.breakpoint_angle_deg)
    keep = []
    for i in range(len(points)):
        if 2 <= i < len(points) - 2:
            steps = [reach[i + k + 1] - reach[i + k] for k in (-2, -1, 0, 1)]
            least = min(abs(steps[1]), abs(steps[2]))
            if steps[1] * steps[2] > 0 and least >= allowance and max(abs(steps[0]), abs(steps[3])) < 0.3 * least:
                continue
        keep.append(i)

    def goes_on(a: int, b: int) -> bool:
        if (beams[b] - beams[a]) % count - 1 > config.max_missing:
            return False
        step = abs(bearings[b] - bearings[a])
        step = min(step, 2.0 * math.pi - step)
        limit = config.max_gap
        if step < shallowest:
            limit = min(limit, min(reach[a], reach[b]) * math.sin(step) / math.sin(shallowest - step) + allowance)
        return math.dist(points[a], points[b]) <= limit

    chains: list[list[int]] = []
    for i in keep:
        if chains and goes_on(chains[-1][-1], i):
            chains[-1].append(i)
        else:
            chains.append([i])
    if ring and len(chains) > 1 and goes_on(keep[-1], keep[0]):
        chains[0] = chains.pop() + chains[0]
    return [[tuple(points[i]) for i in chain] for chain in chains if len(chain) >= config.min_points]


@given(st.integers(0, 10_000), st.booleans())
def test_the_kernel_agrees_with_plain_lists(seed: int, ring: bool) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(5, 80))
    span = 2.0 * math.pi if ring else math.pi
    angles = -0.5 * span + span / count * np.arange(count)
    surfaces = np.repeat(rng.uniform(0.5, 4.0, count), rng.integers(1, 9, count))[:count]
    ranges = surfaces + rng.normal(0.0, 0.005, count)
    beams = np.flatnonzero(rng.random(count) > 0.1)
    if beams.size < 2:
        return
    points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=1)[beams]
    config = ContourConfig(min_points=2)
    contours = segment(points, angles[beams], beams, count, 0.01, config)
    expected = twin(points, angles[beams], beams, ring, count, 0.01, config)
    if contours.closed.any():
        assert len(contours) == len(expected) == 1
        assert set(map(tuple, contours[0])) == set(expected[0])
    else:
        actual = [[tuple(point) for point in contours[i]] for i in range(len(contours))]
        assert sorted(actual) == sorted(expected)
