"""A lens is found from pictures of a board, and what they do not tell is said."""

import numpy as np
import pytest

from contourslam.errors import ConfigError
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.recordings.picture import Picture
from contourslam.recordings.png import encode_png
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.calibration import CalibrationError, View, calibrate
from contourslam.robot.camera.from_pictures import PicturesCalibrated, calibrate_from_pictures
from contourslam.simulation.checkerboard import PolynomialLens, boards_around, render_board

pytest.importorskip("cv2")

BOARD = Board(9, 6, 0.025)
CORNERS = BOARD.columns, BOARD.rows
# Neither is of the fitted model's kind.
LENS = PolynomialLens(640, 480, 131.0, -0.028, 0.0022, 323.4, 236.2)
STEREOGRAPHIC = PolynomialLens(1280, 960, 262.0, 0.03, -0.003, 632.1, 488.4)


def png(pixels: np.ndarray) -> Picture:
    return Picture(1.0, encode_png(pixels), "png")


@pytest.fixture(scope="module")
def done() -> PicturesCalibrated:
    """12 pictures of a board, one without it, one damaged, one that shows what another did."""
    places = boards_around(CORNERS, BOARD.square, 12, seed=3)
    pictures = [
        (f"{i:02}", png(render_board(LENS, CORNERS, BOARD.square, T, seed=i, samples=2))) for i, T in enumerate(places)
    ]
    pictures.append(("twin", png(render_board(LENS, CORNERS, BOARD.square, places[4], seed=99))))
    away = places[0] @ np.diag([1.0, 1.0, 1.0, 1.0])
    away[:3, 3] = 0.0, 0.0, -5.0
    pictures.append(("empty", png(render_board(LENS, CORNERS, BOARD.square, away))))
    broken = bytearray(pictures[3][1].data)
    broken[200:-50] = bytes(len(broken) - 250)
    pictures.append(("broken", Picture(1.0, bytes(broken), "png")))
    return calibrate_from_pictures(pictures, BOARD)


def ray_errors_deg(lens: PolynomialLens, model: FisheyeModel) -> np.ndarray:
    rows, columns = np.mgrid[: lens.height : 5, : lens.width : 5]
    pixels = np.column_stack([columns.ravel(), rows.ravel()]).astype(np.float64)
    true, lit = lens.unproject(pixels)
    found, _ = model.unproject(pixels)
    across = np.linalg.norm(np.cross(true[lit], found[lit]), axis=1)
    angles: np.ndarray = np.degrees(np.arctan2(across, (true[lit] * found[lit]).sum(axis=1)))
    return angles


def test_reprojection_is_below_half_a_pixel_out_to_100_degrees(done: PicturesCalibrated) -> None:
    found = done.calibration
    used = [view for view in found.views if view.used]
    assert len(used) >= 11
    assert found.rms < 0.15 and max(view.rms for view in used) < 0.5
    assert max(view.angles_deg[1] for view in used) > 100.0
    assert sum(found.ring_corners) == len(used) * 54 and found.ring_corners[10] > 0


def test_every_ray_is_within_half_a_degree_of_the_true_one(done: PicturesCalibrated) -> None:
    assert ray_errors_deg(LENS, done.calibration.model).max() < 0.5  # NaN, for a pixel without a ray, fails too


def test_boards_are_placed_where_they_were(done: PicturesCalibrated) -> None:
    places = boards_around(CORNERS, BOARD.square, 12, seed=3)
    for view in done.calibration.views:
        true = places[int(view.name)]
        found, wanted = ((T @ np.append(BOARD.middle, 1.0))[:3] for T in (view.T_camera_board, true))
        assert np.linalg.norm(found - wanted) < 0.01 * np.linalg.norm(wanted) + 0.002
        assert view.T_camera_board[:3, 2] @ true[:3, 2] > np.cos(np.radians(1.5))


def test_what_became_of_each_picture_is_told(done: PicturesCalibrated) -> None:
    assert (done.without_board, done.damaged, done.repeated) == (("empty",), ("broken",), ("twin",))
    assert not done.calibration.warnings


def exact_views(lens: PolynomialLens, count: int, noise: float, seed: int = 0, **where: float) -> list[View]:
    """Corners as the lens shows them, without the search for them."""
    rng = np.random.default_rng(seed)
    views = []
    for i, place in enumerate(boards_around(CORNERS, BOARD.square, count, seed=seed, **where)):
        pixels, _ = lens.project(BOARD.points @ place[:3, :3].T + place[:3, 3])
        views.append(View(str(i), pixels + rng.normal(0.0, noise, pixels.shape)))
    return views


@pytest.mark.parametrize("lens", [LENS, STEREOGRAPHIC], ids=["equal-area", "stereographic"])
@pytest.mark.parametrize("seed", range(2))
def test_the_start_is_good_enough_for_any_lens(lens: PolynomialLens, seed: int) -> None:
    found = calibrate(lens.width, lens.height, BOARD, exact_views(lens, 12, 0.1, seed))
    assert found.rms < 0.25
    assert np.nanmax(ray_errors_deg(lens, found.model)) < 1.0


def test_no_lens_of_this_kind_fits_the_corners_better() -> None:
    """OpenCV's own fit ends where this one does, for which corners that are far off count less."""
    cv2 = pytest.importorskip("cv2")
    views = exact_views(LENS, 12, 0.1)
    board, seen = [BOARD.points.reshape(1, -1, 3)] * 12, [view.corners.reshape(1, -1, 2) for view in views]
    until = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-8)
    theirs = cv2.omnidir.calibrate(board, seen, (LENS.width, LENS.height), None, None, None, 0, until)[0]
    assert calibrate(LENS.width, LENS.height, BOARD, views).rms == pytest.approx(theirs, rel=0.01)


def test_the_uncertainty_told_is_that_of_repeated_calibrations() -> None:
    """The spread over 5 noises of one ray at 60 degrees."""
    rays, told = [], []
    exact = exact_views(LENS, 10, 0.0)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        views = [View(v.name, v.corners + rng.normal(0.0, 0.5, v.corners.shape)) for v in exact]
        found = calibrate(LENS.width, LENS.height, BOARD, views)
        x, y = LENS.project(np.array([[np.sin(np.pi / 3.0), 0.0, 0.5]]))[0][0]
        rays.append(found.model.unproject([[x, y]])[0][0])
        told.append(found.ring_sigma_deg[5])
    spread = np.degrees(np.std(np.array(rays), axis=0).max())
    assert 0.3 * spread < np.median(told) < 5.0 * spread  # told is the worst of all directions


def test_a_view_that_is_far_off_is_left_out_and_named() -> None:
    views = exact_views(LENS, 14, 0.1)
    rng = np.random.default_rng(0)
    views[5] = View("moved", views[5].corners + rng.normal(0.0, 6.0, views[5].corners.shape))
    found = calibrate(LENS.width, LENS.height, BOARD, views)
    assert [view.name for view in found.views if not view.used] == ["moved"]
    assert found.rms < 0.25
    assert any("moved" in text for text in found.warnings)


def test_thin_coverage_is_told() -> None:
    near_the_axis = calibrate(LENS.width, LENS.height, BOARD, exact_views(LENS, 14, 0.1, farthest_deg=60.0))
    assert any("no corner was seen farther than" in text for text in near_the_axis.warnings)
    right_only = [v for v in exact_views(LENS, 36, 0.1) if v.corners[:, 0].mean() > LENS.cx - 20.0]
    found = calibrate(LENS.width, LENS.height, BOARD, right_only)
    assert any("the left of the picture" in text for text in found.warnings)
    few = calibrate(LENS.width, LENS.height, BOARD, exact_views(LENS, 6, 0.1))
    assert any("only 6 pictures" in text for text in few.warnings)


def test_too_few_or_senseless_views_are_refused() -> None:
    with pytest.raises(CalibrationError, match="found in 3 pictures"):
        calibrate(640, 480, BOARD, exact_views(LENS, 3, 0.1))
    rng = np.random.default_rng(0)
    with pytest.raises(CalibrationError, match="check --board"):
        calibrate(640, 480, BOARD, [View(str(i), rng.uniform(0, 480, (54, 2))) for i in range(8)])


def test_pictures_of_different_size_are_refused() -> None:
    pictures = [("a", png(np.zeros((48, 64), np.uint8))), ("b", png(np.zeros((64, 48), np.uint8)))]
    with pytest.raises(CalibrationError, match="b: is 48 by 64 pixels, those before it 64 by 48"):
        calibrate_from_pictures(pictures, BOARD)
    with pytest.raises(CalibrationError, match="no picture that can be read"):
        calibrate_from_pictures([], BOARD)


@pytest.mark.parametrize("text", ["9", "9x", "9x9", "2x5", "9*6", "-9x6", ""])
def test_a_board_without_sense_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="board"):
        Board.parse(text, 0.025)


def test_a_board_is_read_as_it_is_written() -> None:
    assert Board.parse(" 9 x 6 ", 0.03) == Board(9, 6, 0.03)
    with pytest.raises(ConfigError, match="above 0 m"):
        Board.parse("9x6", 0.0)
