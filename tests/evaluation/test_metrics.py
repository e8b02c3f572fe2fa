import json
import sys

import numpy as np
import pytest

from contourslam.evaluation.cramer_rao import CramerRaoBound
from contourslam.evaluation.detection import DetectionScore
from contourslam.evaluation.metrics import aggregate, run_metrics
from contourslam.evaluation.relations import JudgedRelations, RelationErrors
from contourslam.geometry.poses import compose

KEYS = {
    "back_end", "loops", "quality",
    "detector", "scans", "complete", "skipped", "rmse", "online_rmse", "odometry_rmse", "ate", "rpe", "nees",
    "nees_inside", "inside_two_sigma", "nis", "nis_inside", "fnr", "fnr_median", "fnr_walls",
    "fnr_walls_median", "landmarks",
    "per_scan", "seconds", "scans_per_second",
}  # fmt: skip


def test_a_consistent_run_measures_what_was_put_in(make_run):
    found = run_metrics(make_run(steps=2000))
    assert set(found) == KEYS
    assert found["rmse"]["x"] == pytest.approx(0.01, rel=0.05)
    assert found["rmse"]["y"] == pytest.approx(np.hypot(0.004, 0.02), rel=0.05)
    assert found["rmse"]["theta"] == pytest.approx(np.sqrt(14e-6), rel=0.05)
    assert found["odometry_rmse"]["theta"] == pytest.approx(0.05)
    assert found["ate"]["rmse"] == pytest.approx(np.hypot(found["rmse"]["x"], found["rmse"]["y"]))
    assert found["ate"]["aligned_rmse"] <= found["ate"]["rmse"]
    assert found["nees"] == pytest.approx(3.0, abs=0.2)
    assert found["nees_inside"] == pytest.approx(0.95, abs=0.03)
    assert found["nis"] == pytest.approx(1.0, abs=0.05)
    assert all(share == pytest.approx(0.954, abs=0.02) for share in found["inside_two_sigma"].values())
    assert found["fnr"] == pytest.approx(7 / 30)
    assert found["landmarks"] == {"corners": 3, "walls": 0}
    assert found["scans_per_second"] == pytest.approx(5000.0)
    assert found["skipped"] == {"no odometry": 2}
    assert found["rpe"]["rmse"] > 0.0


def test_metrics_are_json_without_nan(make_run):
    truth = make_run().truth
    lost = make_run(truth=np.full_like(truth, np.nan))
    nothing = make_run(steps=0, truth=None, seconds={})
    for run in (make_run(), make_run(truth=None), lost, nothing):
        again = json.loads(json.dumps(run_metrics(run), allow_nan=False))
        assert set(again) == KEYS


def test_without_truth_the_errors_are_unknown_and_the_rest_is_kept(make_run):
    found = run_metrics(make_run(truth=None))
    unknown = {key for key in KEYS if found[key] is None}
    unknown_here = {"rmse", "online_rmse", "odometry_rmse", "ate", "rpe", "nees", "nees_inside", "inside_two_sigma"}
    assert unknown == unknown_here | {"fnr_walls", "fnr_walls_median", "quality"}


def test_a_truth_in_another_frame_is_aligned_at_the_first_pose(make_run):
    run = make_run()
    poses, covariances = run.poses.copy(), run.covariances.copy()
    poses[0], covariances[0] = run.truth[0], 0.0
    run = make_run(poses=poses, covariances=covariances, odometry=run.truth)
    here = run_metrics(run)
    frame = np.array([5.0, -3.0, 2.0])
    rotation = np.array([[np.cos(2.0), -np.sin(2.0), 0.0], [np.sin(2.0), np.cos(2.0), 0.0], [0.0, 0.0, 1.0]])
    elsewhere = make_run(
        poses=compose(frame, poses),
        odometry=compose(frame, run.truth),
        covariances=rotation @ covariances @ rotation.T,
    )
    aligned = run_metrics(elsewhere, aligned=True)
    for key in ("rmse", "ate", "inside_two_sigma"):
        assert aligned[key] == pytest.approx(here[key])
    assert aligned["nees"] == pytest.approx(here["nees"])
    assert aligned["odometry_rmse"]["x"] == pytest.approx(0.0, abs=1e-9)
    assert run_metrics(elsewhere)["rmse"]["x"] > 1.0


def test_relations_bound_and_detection_are_reported_if_given(make_run):
    errors = RelationErrors(np.array([0.1, 0.3]), np.array([0.0, 0.2]), 1)
    relations = JudgedRelations(np.zeros((2, 2)), errors, None, errors)
    bound = CramerRaoBound(np.full((4, 3), np.inf), np.tile([0.001, 0.002, 0.003], (4, 1)))
    ones = np.ones(4, dtype=np.int64)
    detection = DetectionScore(2 * ones, ones, ones, ones, np.full(4, 0.01), np.empty(0), 4, 3)
    found = run_metrics(make_run(), relations=relations, bound=bound, detection=detection)
    assert found["relations"]["translation"] == pytest.approx({"mean": 0.2, "sd": 0.1, "median": 0.2, "max": 0.3})
    assert found["odometry_relations"]["outside"] == 1
    assert found["cramer_rao"] == {
        "scan": {"x": None, "y": None, "theta": None},
        "filtered": pytest.approx({"x": 0.001, "y": 0.002, "theta": 0.003}),
    }
    assert found["detection"]["precision"] == 0.5
    assert found["detection"]["repeatability"] == 0.75
    assert found["detection"]["raw_rms_error"] is None
    json.dumps(found, allow_nan=False)


def test_a_core_install_reports_what_needs_no_extra(make_run, monkeypatch):
    full = run_metrics(make_run())
    for module in ("evo", "evo.core.metrics", "scipy", "scipy.special"):
        monkeypatch.setitem(sys.modules, module, None)
    found = run_metrics(make_run())
    for key in ("ate", "rpe", "nees_inside", "nis_inside"):
        assert found[key] is None
    for key in ("rmse", "nees", "nis", "fnr", "inside_two_sigma"):
        assert found[key] == full[key]


def test_the_mean_over_seeds_is_taken_key_by_key(make_run):
    runs = [run_metrics(make_run(seed)) for seed in range(5)]
    found = aggregate(runs)
    values = [run["rmse"]["x"] for run in runs]
    assert found["rmse"]["x"] == pytest.approx({"mean": np.mean(values), "sd": np.std(values, ddof=1), "n": 5})
    assert found["detector"] == "matched_filter"
    assert found["complete"] is True
    assert found["nees"]["mean"] == pytest.approx(3.0, abs=0.3)
    assert found["skipped"]["no odometry"] == {"mean": 2.0, "sd": 0.0, "n": 5}
    json.dumps(found, allow_nan=False)


def test_what_some_runs_do_not_know_is_averaged_over_the_others(make_run):
    runs = [run_metrics(make_run(0)), run_metrics(make_run(1, truth=None, detector="wu", complete=False))]
    found = aggregate(runs)
    assert found["rmse"]["x"] == {"mean": runs[0]["rmse"]["x"], "sd": None, "n": 1}
    assert found["fnr"]["n"] == 2
    assert found["fnr_walls"] is None
    assert found["detector"] is None
    assert found["complete"] is False
    assert aggregate([]) == {}
