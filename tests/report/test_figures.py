from dataclasses import replace

import matplotlib
import numpy as np
import pytest

from contourslam.config import Config
from contourslam.detectors import DETECTORS, make_detector
from contourslam.errors import ResultError
from contourslam.landmarks import detect
from contourslam.report.figures.bars import noise_figure, pair_figure, rmse_figure, timing_figure
from contourslam.report.figures.errors import error_figure, nees_figure
from contourslam.report.figures.landmarks import landmark_figure
from contourslam.report.figures.save import save_figure
from contourslam.report.figures.scan import scan_figure
from contourslam.report.figures.style import colour
from contourslam.report.figures.world import world_figure
from contourslam.report.naming import COLOURS, LABELS
from contourslam.report.scan_table import EMPTY_CORNERS, EMPTY_WALLS


def texts(figure):
    return " ".join(text.get_text() for text in figure.findobj(matplotlib.text.Text))


def line(axes, name):
    return next(found for found in axes.get_lines() if found.get_label() == name)


def test_the_map_shows_estimate_truth_and_raw_odometry_where_they_are(make_run):
    run = make_run()
    axes = world_figure(run).axes[0]
    for name, poses in (("estimated path", run.poses), ("true path", run.truth), ("raw odometry", run.odometry)):
        np.testing.assert_array_equal(line(axes, name).get_xydata(), poses[:, :2], err_msg=name)
    np.testing.assert_array_equal(line(axes, "mapped corner, convex").get_xydata(), run.corner_map.positions[1:2])
    assert axes.get_aspect() == 1.0


@pytest.mark.parametrize(("sigma", "factor"), [(0.001, 50), (0.01, 10), (0.05, 2), (0.5, 1)])
def test_the_ellipses_of_the_map_are_two_sigma_times_what_the_legend_says(make_run, sigma, factor):
    run = make_run()
    run.corner_map.covariances[:] = np.diag([0.5 * sigma, sigma]) ** 2
    figure = world_figure(run)
    (ellipses,) = figure.findobj(matplotlib.collections.EllipseCollection)
    assert (f"{factor}× enlarged" in texts(figure)) == (factor > 1)
    axes_lengths = np.sort([ellipses.get_widths()[0], ellipses.get_heights()[0]])
    np.testing.assert_allclose(axes_lengths, [2 * sigma * factor, 4 * sigma * factor])


def test_an_interrupted_run_is_marked_in_the_picture(make_run):
    assert "INCOMPLETE" in texts(world_figure(make_run(complete=False)))
    assert "INCOMPLETE" not in texts(world_figure(make_run()))


@pytest.mark.parametrize("scans", [0, 1, 2])
def test_a_run_that_hardly_began_is_drawn(tmp_path, make_run, scans):
    run = make_run(scans=3)
    rows = (
        "stamps",
        "poses",
        "covariances",
        "odometry",
        "nis",
        "nis_dof",
        "matched_count",
        "corner_count",
        "wall_count",
    )
    run = replace(
        run,
        **{name: getattr(run, name)[:scans] for name in rows},
        truth=None,
        corner_map=EMPTY_CORNERS,
        wall_map=EMPTY_WALLS,
    )
    save_figure(world_figure(run), tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 1000


def test_the_errors_are_wrapped_and_bounded_by_two_sigma(make_run):
    run = make_run()
    run.poses[:, 2] += 2.0 * np.pi
    panels = error_figure(run).axes
    sigma = np.sqrt(run.covariances[0].diagonal())
    for axes, scale, bound in zip(panels, (100.0, 100.0, np.degrees(1.0)), sigma, strict=True):
        assert np.abs(line(axes, "error").get_ydata()).max() < 6 * scale * bound
        band = axes.collections[0].get_paths()[0].vertices
        assert band[:, 1].max() == pytest.approx(2 * scale * bound)


def test_bars_of_the_landmarks_add_up_to_their_chances():
    figure = landmark_figure("wu", np.array([10, 40, 0]), np.array([5, 0, 3]))
    counts, rates = figure.axes
    tops = [bar.get_y() + bar.get_height() for bar in counts.patches]
    assert max(tops) == 40
    assert tops[3:] == [40, 15, 3]
    np.testing.assert_allclose(rates.lines[0].get_ydata(), [0.0, 1 / 3, 1.0])
    assert "13.8 %" in texts(figure)


def test_every_comparison_is_drawn_in_the_colour_of_its_detector(tmp_path):
    names = list(DETECTORS)
    errors = np.full((3, 3), 0.01)
    errors[1] = np.nan
    figures = [
        rmse_figure(dict.fromkeys(names, (0.01, 0.002)), {"wu": 0.2}, odometry=0.3, bound=0.0005),
        noise_figure(np.array([0.0, 0.01, 0.02]), dict.fromkeys(names, errors), odometry=0.4),
        pair_figure(dict.fromkeys(names, 0.03), dict.fromkeys(names, 0.01), names=("raw", "refined"), ylabel="cm"),
        timing_figure({name: {"contour": 1e-4, "detection": 2e-4} for name in names}, ("detection", "contour")),
        nees_figure(np.arange(9.0), dict.fromkeys(names, np.full(9, 3.0)), bounds=(1.0, 6.0), runs=2),
    ]
    for i, figure in enumerate(figures):
        save_figure(figure, tmp_path / f"{i}.svg")
        assert all(LABELS[name] in texts(figure) for name in names)
    assert len({colour(name) for name in names}) == len(names) == len(COLOURS)
    assert colour("my own") == colour("my own")


def test_unknown_nees_leaves_a_gap_and_no_warning():
    values = np.array([np.nan] * 4 + [3.0] * 4)
    figure = nees_figure(np.arange(8.0), {"wu": values}, bounds=(1.0, 6.0), runs=1, seconds=1.0)
    drawn = line(figure.axes[0], "Wu").get_ydata()
    assert np.isnan(drawn[:4]).all()
    np.testing.assert_allclose(drawn[4:], 3.0)


@pytest.mark.parametrize("name", DETECTORS)
def test_a_scan_is_drawn_with_each_of_its_corners(tmp_path, room_scan, name):
    detector = make_detector(name)
    detection = detect(room_scan(np.array([2.0, 1.5, 0.3])), detector, Config(detector=name))
    figure = scan_figure(detection, name, threshold=detector.threshold, title="scan 3")
    assert len(detection.corners) == 4
    assert "corner, concave (4)" in texts(figure)
    assert "scan 3" in texts(figure)
    plane, along = figure.axes
    np.testing.assert_array_equal(line(plane, "corner, concave (4)").get_xydata(), detection.corners.positions)
    assert along.get_ylabel() == "response"
    save_figure(figure, tmp_path / "scan.png")


def test_a_scan_that_sees_nothing_is_drawn(tmp_path, room_scan):
    scan = room_scan(np.array([2.0, 1.5, 0.3]))
    blind = replace(scan, ranges=np.full(scan.ranges.shape, np.inf))
    detector = make_detector("wu")
    figure = scan_figure(detect(blind, detector, Config()), "wu", threshold=detector.threshold)
    save_figure(figure, tmp_path / "scan.png")
    assert "contour (0)" in texts(figure)


def test_the_same_figure_gives_the_same_bytes(tmp_path, make_run):
    for name in ("a.svg", "b.svg", "a.png", "b.png"):
        save_figure(error_figure(make_run(scans=20)), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_a_figure_that_cannot_be_written_is_said(tmp_path, make_run):
    (tmp_path / "in_the_way").write_text("")
    with pytest.raises(ResultError, match="cannot be made"):
        save_figure(error_figure(make_run(scans=5)), tmp_path / "in_the_way" / "a.svg")


def test_drawing_leaves_the_settings_of_matplotlib_alone(make_run):
    before = dict(matplotlib.rcParams)
    error_figure(make_run(scans=5))
    assert dict(matplotlib.rcParams) == before
