"""The derivatives are those of the projection, and exact corners give the exact lens back."""

import numpy as np

from contourslam.geometry.fisheye import FisheyeModel
from contourslam.geometry.rigid import rotation_from_vector
from contourslam.robot.camera.board import Board
from contourslam.robot.camera.bundle import Bundle, fit, project

LENS = np.array([1.6, 620.0, 618.0, 0.4, 641.5, 478.2, -0.02, 0.004, 0.0006, -0.0004])
POINTS = np.array([[0.1, 0.2, 1.0], [1.0, -0.5, 0.1], [-0.9, 0.3, -0.25], [0.01, 0.0, 2.0]])


def test_the_derivatives_are_those_of_the_projection() -> None:
    pixels, by_lens, by_point = project(LENS, POINTS)
    model = FisheyeModel(1280, 960, *LENS)
    np.testing.assert_allclose(pixels, model.project(POINTS)[0], atol=1e-9)
    for i in range(10):
        step = 1e-6 * np.eye(10)[i] * max(abs(LENS[i]), 1.0)
        slope = (project(LENS + step, POINTS)[0] - project(LENS - step, POINTS)[0]) / (2.0 * step[i])
        np.testing.assert_allclose(by_lens[:, :, i], slope, rtol=1e-6, atol=1e-4)
    for i in range(3):
        step = 1e-6 * np.eye(3)[i]
        slope = (project(LENS, POINTS + step)[0] - project(LENS, POINTS - step)[0]) / 2e-6
        np.testing.assert_allclose(by_point[:, :, i], slope, rtol=1e-6, atol=1e-4)


def views(count: int = 8) -> Bundle:
    """Boards a third of a metre away, all around the lens."""
    rng = np.random.default_rng(2)
    turns, places = [], []
    for i in range(count):
        angle, around = np.radians(100.0 * i / (count - 1)), 2.4 * i
        ray = np.array([np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle)])
        towards = rotation_from_vector(np.cross([0.0, 0.0, 1.0], ray) / max(np.sin(angle), 1e-9) * angle)
        turns.append(towards @ rotation_from_vector(rng.normal(0.0, 0.4, 3)))
        places.append(0.33 * ray - turns[-1] @ Board(9, 6, 0.03).middle)
    return Bundle(LENS, np.array(turns), np.array(places))


def test_exact_corners_give_the_exact_lens_back() -> None:
    truth, board = views(), Board(9, 6, 0.03).points
    seen = project(truth.lens, np.einsum("vij,cj->vci", truth.turns, board) + truth.places[:, None])[0]
    off = np.array([0.1, 15.0, -12.0, 0.0, 6.0, -5.0, 0.01, 0.0, 0.0, 0.0])
    start = Bundle(LENS + off, truth.turns @ rotation_from_vector((0.03, -0.02, 0.04)), truth.places + 0.01)
    found = fit(start, board, seen, np.ones(10, dtype=bool), steps=200)
    assert found.rms < 1e-6
    np.testing.assert_allclose(found.bundle.lens[:6], LENS[:6], rtol=1e-4, atol=1e-2)


def test_a_few_false_corners_hardly_move_the_lens_when_they_count_less() -> None:
    truth, board = views(), Board(9, 6, 0.03).points
    seen = project(truth.lens, np.einsum("vij,cj->vci", truth.turns, board) + truth.places[:, None])[0]
    seen[::3, ::10] += 12.0
    everything = np.ones(10, dtype=bool)
    plain = fit(truth, board, seen, everything)
    robust = fit(truth, board, seen, everything, robust=0.5)
    far = [np.abs(found.residuals[1]).max() for found in (plain, robust)]
    assert far[1] < 0.3 < far[0]
