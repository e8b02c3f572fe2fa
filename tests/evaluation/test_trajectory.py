import logging
import subprocess
import sys

import numpy as np
import pytest

from contourslam.errors import MissingExtraError
from contourslam.evaluation.trajectory import absolute_error, relative_error
from contourslam.geometry.poses import between, compose


def test_absolute_error_is_the_distance_to_the_true_position(circle_drive):
    truth = circle_drive()
    error = absolute_error(truth + np.array([0.03, 0.04, 0.02]), truth)
    assert error.translation.rmse == pytest.approx(0.05)
    assert error.translation.max == pytest.approx(0.05)
    assert error.rotation.mean == pytest.approx(0.02)
    assert error.translation.count == len(truth)


def test_alignment_undoes_any_rigid_motion(circle_drive):
    truth = circle_drive()
    error = absolute_error(compose(np.array([3.0, -8.0, 3.0]), truth), truth, aligned=True)
    assert error.translation.max == pytest.approx(0.0, abs=1e-9)
    assert error.rotation.max == pytest.approx(0.0, abs=1e-7)


def test_alignment_does_not_turn_a_straight_path_over():
    truth = np.column_stack([np.linspace(0, 5, 50), np.zeros(50), np.zeros(50)])
    noise = np.random.default_rng(1).normal(0.0, 0.01, 50)
    poses = truth + np.column_stack([np.zeros(50), noise, np.zeros(50)])
    mirrored = truth + np.column_stack([np.zeros(50), -noise, np.zeros(50)])
    error = absolute_error(poses, mirrored, aligned=True)
    assert error.translation.rmse > 0.01  # turned over, the two would agree
    assert error.rotation.max < 0.01


def test_a_robot_that_stood_still_has_no_alignment():
    truth = np.zeros((10, 3))
    assert np.isnan(absolute_error(truth + 0.01, truth, aligned=True).translation.rmse)
    assert absolute_error(truth + 0.01, truth).translation.rmse == pytest.approx(np.hypot(0.01, 0.01))


def test_relative_error_of_a_scaled_odometer_is_its_scale(circle_drive):
    truth = np.column_stack([np.linspace(0, 10, 1001), np.zeros(1001), np.zeros(1001)])
    error = relative_error(truth * np.array([1.02, 1.0, 1.0]), truth)
    assert error.translation.mean == pytest.approx(0.02, rel=1e-3)
    assert error.rotation.max == pytest.approx(0.0, abs=1e-9)
    assert error.translation.count == pytest.approx(900, abs=15)


def test_relative_error_does_not_see_the_frame(circle_drive):
    truth = circle_drive()
    error = relative_error(compose(np.array([1.0, 2.0, 3.0]), truth), truth)
    assert error.translation.max == pytest.approx(0.0, abs=1e-9)


def test_relative_error_agrees_with_its_definition(circle_drive):
    truth = circle_drive(100)
    poses = truth + np.random.default_rng(2).normal(0.0, 0.02, truth.shape)
    error = relative_error(poses, truth, distance=1.0)
    path = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(truth[:, :2], axis=0).T))])
    expected = []
    for i in range(len(truth) - 1):
        j = i + 1 + int(np.argmin(np.abs(path[i + 1 :] - path[i] - 1.0)))
        if abs(path[j] - path[i] - 1.0) <= 0.1:
            difference = between(between(truth[i], truth[j]), between(poses[i], poses[j]))
            expected.append([np.hypot(difference[0], difference[1]), abs(difference[2])])
    assert error.translation.count == len(expected)
    assert error.translation.mean == pytest.approx(np.mean(expected, axis=0)[0], rel=1e-9)
    assert error.rotation.max == pytest.approx(np.max(expected, axis=0)[1], rel=1e-9)


def test_short_and_unknown_trajectories_give_no_number():
    unknown = np.full((5, 3), np.nan)
    for error in (
        absolute_error(np.zeros((5, 3)), unknown),
        absolute_error(np.zeros((5, 3)), unknown, aligned=True),
        relative_error(np.zeros((5, 3)), unknown),
        relative_error(np.zeros((5, 3)), np.zeros((5, 3))),
    ):
        assert np.isnan(error.translation.rmse)
        assert error.translation.count == 0


def test_evo_says_nothing_and_writes_nothing(tmp_path):
    script = (
        "import numpy as np, sys\n"
        "from contourslam.evaluation import trajectory\n"
        "assert not any(m.split('.')[0] in ('evo', 'matplotlib') for m in sys.modules), 'imported too early'\n"
        "truth = np.column_stack([np.linspace(0, 5, 100), np.sin(np.linspace(0, 5, 100)), np.zeros(100)])\n"
        "trajectory.absolute_error(truth + 0.1, truth, aligned=True)\n"
        "trajectory.relative_error(truth + 0.1, truth)\n"
        "assert 'evo.tools.settings' not in sys.modules\n"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        cwd=tmp_path,
        env={"HOME": str(tmp_path), "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert list(tmp_path.iterdir()) == []


def test_evo_logs_nothing(caplog, circle_drive):
    with caplog.at_level(logging.INFO):
        relative_error(circle_drive() + 0.01, circle_drive())
        absolute_error(circle_drive() + 0.01, circle_drive(), aligned=True)
    assert caplog.records == []


def test_without_evo_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "evo", None)
    monkeypatch.setitem(sys.modules, "evo.core.metrics", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'contourslam\[report\]'"):
        absolute_error(np.zeros((5, 3)), np.zeros((5, 3)))
