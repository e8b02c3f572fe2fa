"""One run is what the other commands would make of it, with every figure that its drive allows."""

import numpy as np
import pytest

from contourslam.detectors import TehChin, Wu
from contourslam.errors import ConfigError, RecordingError
from contourslam.experiments.compare import compare
from contourslam.experiments.replays import Variant
from contourslam.experiments.sweep.own_detector import load_detector
from contourslam.experiments.sweep.work import measure
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import ROOMS
from contourslam.simulation.simulate import simulate

ROOM = '[simulation]\nrooms = "furnished_room"\nduration = 2.0\n'


def test_a_simulated_run_is_that_of_compare(planned):
    (run,) = planned('detectors = "wu"\n' + ROOM + "seeds = [4]\n")
    metrics = measure(run)
    found = compare(
        ROOMS["furnished_room"], [4], detectors=["wu"], simulation=SimulationConfig(duration=2.0)
    ).seeds[0].metrics[Variant("wu", "corners")]  # fmt: skip
    for name in ("scans", "rmse", "odometry_rmse", "nees", "landmarks", "per_scan", "complete"):
        assert metrics[name] == found[name]
    assert metrics["detection"]["precision"] > 0.5


def test_a_drive_is_scanned_anew_for_other_beams_and_measured_anew_for_other_noise(planned, monkeypatch):
    from contourslam.experiments.sweep import work

    for cached in (work.simulated, work._driven, work._ideal_scans):
        cached.cache_clear()
    driven, cast = [], []
    monkeypatch.setattr(work, "drive", lambda *a, _do=work.drive, **k: (driven.append(a), _do(*a, **k))[1])
    monkeypatch.setattr(work, "cast_scans", lambda *a, _do=work.cast_scans: (cast.append(a), _do(*a))[1])
    runs = planned('detectors = ["wu", "teh_chin"]\n' + ROOM + "noise = [0.0, 0.04]\nbeams = [180, 500]\n")
    scans = {run.drive: work.simulated(run.drive).simulated.scans for run in sorted(runs, key=lambda run: run.order)}
    assert (len(driven), len(cast), len(scans)) == (1, 2, 4)
    for drive, found in scans.items():
        config = SimulationConfig(duration=2.0, noise=drive.noise, lidar=drive.model)
        for ours, theirs in zip(found, simulate(ROOMS["furnished_room"], config, 0).scans, strict=True):
            np.testing.assert_array_equal(ours.ranges, theirs.ranges)


def test_a_recording_is_judged_by_the_relations_beside_it(planned, tmp_path, log_of):
    log_of()
    (tmp_path / "still.relations").write_text("0.0 2.0 0.5 0 0 0 0 0\n")
    (run,) = planned('detectors = "wu"\n[recordings]\npaths = "still.log"\n')
    metrics = measure(run)
    assert metrics["scans"] == 25
    assert metrics["relations"]["translation"]["mean"] == pytest.approx(0.5, abs=0.02)
    assert metrics["odometry_relations"]["translation"]["mean"] == pytest.approx(0.5)


def test_a_recording_in_a_store_is_replayed_as_if_it_were_here(planned, tmp_path, log_of):
    import fsspec

    log_of()
    fsspec.filesystem("memory").pipe_file("/far/still.log", (tmp_path / "still.log").read_bytes())
    runs = planned('detectors = "wu"\n[recordings]\npaths = ["still.log", "memory://far/still.log"]\n')
    here, there = map(measure, runs)
    assert there["per_scan"] == here["per_scan"]


def test_a_detector_of_ones_own_is_made_with_adapted_and_used(planned, tmp_path):
    (tmp_path / "mine.py").write_text(
        "from dataclasses import dataclass\nfrom contourslam.detectors import Wu\n\n\n"
        "@dataclass(frozen=True)\nclass Told:\n    adapted: bool\n\n\n"
        "def Mine(adapted):\n    assert Told(adapted).adapted is False\n    return Wu(adapted)\n"
    )
    text = 'detectors = ["wu", "mine"]\n[own_detectors]\nmine = "mine.py:Mine"\n[settings.a]\nadapted = false\n' + ROOM
    runs = planned(text)
    (tmp_path / "mine.py").unlink()  # what was planned is run, wherever the worker is
    wu, mine = map(measure, runs)
    assert (mine["detector"], mine["rmse"]) == ("mine", wu["rmse"])


def test_a_detector_may_come_from_a_module_that_is_the_same_everywhere(planned, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "sweep_test_package").mkdir()
    module = tmp_path / "sweep_test_package" / "mine.py"
    (tmp_path / "sweep_test_package" / "__init__.py").touch()
    (tmp_path / "sweep_test_package" / "beside.py").write_text("from contourslam.detectors import TehChin, Wu\n")
    module.write_text("from .beside import Wu as Mine\n")
    text = 'detectors = "mine"\n[own_detectors]\nmine = "sweep_test_package.mine:Mine"\n' + ROOM
    (run,) = planned(text)
    assert isinstance(load_detector(run.own, adapted=False), Wu)
    module.write_text("from .beside import TehChin as Mine\n")
    with pytest.raises(ConfigError, match="is not the same as where the sweep was started"):
        measure(run)
    # A worker that has run the old one does not take it for the new one.
    (run,) = planned(text)
    assert isinstance(load_detector(run.own, adapted=False), TehChin)


@pytest.mark.parametrize("planned_with", ["nothing", "another"])
def test_a_recording_that_is_another_on_the_worker_is_refused(planned, tmp_path, log_of, planned_with):
    if planned_with == "another":
        (tmp_path / "still.log").write_text("another")
    (run,) = planned('detectors = "wu"\n[recordings]\npaths = "still.log"\n')
    log_of()
    with pytest.raises(RecordingError, match="is not here what it was where the sweep was started"):
        measure(run)
