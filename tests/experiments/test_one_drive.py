"""The experiments on a single drive: noise, refinement, adaptations, and all of them together."""

from dataclasses import replace

import numpy as np
import pytest

from contourslam.config import Config
from contourslam.experiments import adaptation as adaptation_module
from contourslam.experiments.adaptation import adaptation
from contourslam.experiments.known_room import LEAST_SIGMA, localisation_bound, told, true_room
from contourslam.experiments.noise import noise_sweep
from contourslam.experiments.parallel import Observer
from contourslam.experiments.refinement import corner_score, refinement
from contourslam.experiments.study import study
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import FURNISHED_ROOM
from contourslam.simulation.simulate import simulate

DETECTORS = ("matched_filter", "teh_chin")


@pytest.fixture(scope="module")
def run():
    return simulate(FURNISHED_ROOM, SimulationConfig(duration=6.0), 0)


def test_more_noise_gives_more_error_with_every_detector(run):
    sweep = noise_sweep(run, (0.0, 0.05), detectors=DETECTORS)
    assert sweep.complete
    np.testing.assert_array_equal(sweep.levels, [0.0, 0.05])
    for name in DETECTORS:
        rmse = sweep.rmse(name)
        assert rmse.shape == (2, 3)
        assert np.hypot(*rmse[0, :2]) < np.hypot(*rmse[1, :2]) < 0.2


def test_a_stopped_sweep_keeps_the_levels_done(run):
    done = []
    observer = Observer(progress=lambda count, total: done.append(count), stopped=lambda: len(done) >= 3)
    sweep = noise_sweep(run, (0.01, 0.02, 0.03), detectors=DETECTORS, observer=observer)
    assert not sweep.complete
    np.testing.assert_array_equal(sweep.levels, [0.01, 0.02])
    assert np.isfinite(sweep.rmse("matched_filter")).all()
    assert np.isnan(sweep.rmse("teh_chin")[1]).all()


def test_refined_corners_lie_closer_to_the_true_ones_than_raw_vertices(run):
    outcome = refinement(run, detectors=DETECTORS, every=6)
    assert outcome.complete
    for name in DETECTORS:
        score = outcome.scores[name]
        assert score.rms_error < 0.5 * score.raw_rms_error
        assert score.precision > 0.9
        assert score.recall > 0.7
        assert outcome.refined[name]["rmse"]["x"] != outcome.raw[name]["rmse"]["x"]


def test_the_motion_during_a_scan_does_not_blur_the_score(run):
    config = told(Config(), run.lidar)
    score = corner_score(run, config, every=6)
    # The same scans, taken as if the robot had stood still, put the corners centimetres away.
    still = replace(run, scans=tuple(replace(scan, offsets=np.zeros_like(scan.offsets)) for scan in run.scans))
    assert score.rms_error < corner_score(still, config, every=6).rms_error


def test_faithful_and_adapted_detectors_run_on_the_same_drive(run, monkeypatch):
    seen = []
    real = adaptation_module.measure

    def measure(settings, *args, **kwargs):
        seen.extend(settings)
        return real(settings, *args, **kwargs)

    monkeypatch.setattr(adaptation_module, "measure", measure)
    outcome = adaptation(run, detectors=DETECTORS)
    assert [setting.config.adapted for setting in seen] == [False, True]
    assert seen[0].run is seen[1].run is run
    assert set(outcome.faithful) == set(outcome.adapted) == set(DETECTORS)
    assert outcome.complete


def test_the_pipeline_is_told_what_the_data_sheet_says(run):
    sheet = told(Config(detector="wu"), replace(run.lidar, sigma_range=0.0, mount_x=0.17))
    assert sheet.lidar.sigma_range == LEAST_SIGMA
    assert sheet.lidar.mount_x == 0.17
    assert sheet.detector == "wu"


def test_the_true_room_is_cut_at_the_height_of_the_lidar():
    low, high = true_room(FURNISHED_ROOM, 0.2), true_room(FURNISHED_ROOM, 1.5)
    assert len(low.positions) > len(high.positions) > 4
    assert len(low.positions) == len(low.openings)


def test_a_lidar_without_noise_has_no_bound(run):
    config = told(Config(), run.lidar)
    assert localisation_bound(run.with_noise(0.0), config) is None
    bound, doubled = localisation_bound(run, config), localisation_bound(run.with_noise(0.02), config)
    assert 1e-4 < bound.scan_rms[0] < 2e-3
    np.testing.assert_allclose(doubled.scan_rms, 2 * bound.scan_rms)


def test_a_study_runs_all_experiments_and_tells_of_each():
    stages = []

    def observe(stage):
        stages.append(stage)
        return Observer()

    short = SimulationConfig(duration=1.5)
    whole = study(FURNISHED_ROOM, [0], detectors=["wu"], simulation=short, noise_levels=(0.01,), observe=observe)
    assert stages == ["comparison", "noise sweep", "refinement", "adaptation"]
    assert whole.complete
    assert whole.noise.complete
    assert whole.refinement.complete
    assert whole.adaptation.complete
    bare = study(FURNISHED_ROOM, [0], detectors=["wu"], simulation=short, noise_levels=(), details=False)
    assert bare.complete
    assert bare.noise is bare.refinement is bare.adaptation is None


@pytest.mark.parametrize(("stage", "left_out"), [("comparison", 3), ("noise sweep", 2), ("refinement", 1)])
def test_a_study_stopped_in_a_stage_leaves_out_the_later_ones(stage, left_out):
    short = SimulationConfig(duration=1.0)
    observe = {stage: Observer(stopped=lambda: True)}
    stopped = study(
        FURNISHED_ROOM,
        [0],
        detectors=["wu"],
        simulation=short,
        noise_levels=(0.01,),
        observe=lambda name: observe.get(name, Observer()),
    )
    assert not stopped.complete
    assert [stopped.noise, stopped.refinement, stopped.adaptation].count(None) == left_out
