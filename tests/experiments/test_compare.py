import numpy as np
import pytest

from contourslam.config import Config
from contourslam.experiments.compare import compare
from contourslam.experiments.parallel import Observer
from contourslam.experiments.replays import MODES, Variant
from contourslam.recordings import open_recording
from contourslam.scan import LaserScan
from contourslam.simulation.config import SimulationConfig
from contourslam.simulation.rooms import FURNISHED_ROOM

DETECTORS = ("matched_filter", "wu")
DRIVE = SimulationConfig(duration=6.0)


@pytest.fixture(scope="module")
def told():
    return []


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return tmp_path_factory.mktemp("compare") / "seed_3"


@pytest.fixture(scope="module")
def comparison(told, recording):
    observer = Observer(progress=lambda done, total: told.append((done, total)))
    return compare(
        FURNISHED_ROOM, (3, 4), detectors=DETECTORS, simulation=DRIVE, recording=recording, observer=observer
    )


def test_every_seed_is_replayed_once_per_detector_without_and_with_walls(comparison, told):
    assert comparison.complete
    assert [runs.seed for runs in comparison.seeds] == [3, 4]
    wanted = {Variant(detector, mode) for detector in DETECTORS for mode in MODES}
    for runs in comparison.seeds:
        assert set(runs.metrics) == set(runs.nees) == wanted
        assert {variant.detector for variant in wanted} == set(DETECTORS)
        for variant, metrics in runs.metrics.items():
            assert metrics["detector"] == variant.detector
            assert (metrics["landmarks"]["walls"] > 0) == (variant.mode == "walls")
    assert told[-1] == (8, 8)


def test_all_replays_of_a_seed_are_of_one_drive(comparison):
    for runs in comparison.seeds:
        drives = {str(metrics["odometry_rmse"]) for metrics in runs.metrics.values()}
        assert len(drives) == 1
    assert len({str(comparison.runs("wu", "corners")[i]["odometry_rmse"]) for i in (0, 1)}) == 2


def test_the_filter_beats_the_wheels_and_does_not_beat_the_bound(comparison):
    for detector in DETECTORS:
        for mode in MODES:
            for run in comparison.runs(detector, mode):
                error = np.hypot(run["rmse"]["x"], run["rmse"]["y"])
                bound = np.hypot(run["cramer_rao"]["filtered"]["x"], run["cramer_rao"]["filtered"]["y"])
                assert bound < error < np.hypot(run["odometry_rmse"]["x"], run["odometry_rmse"]["y"])


def test_the_table_holds_mean_and_spread_over_the_seeds(comparison):
    values = [run["rmse"]["x"] for run in comparison.runs("wu", "corners")]
    found = comparison.table("corners")["wu"]["rmse"]["x"]
    assert found["n"] == 2
    assert found["mean"] == pytest.approx(np.mean(values))
    assert found["sd"] == pytest.approx(np.std(values, ddof=1))


def test_nees_is_averaged_over_the_seeds_with_its_bounds(comparison):
    average = comparison.nees("wu", "walls")
    assert average.runs == 2
    assert average.lower < 3 < average.upper
    seeds = [runs.nees[Variant("wu", "walls")] for runs in comparison.seeds]
    assert average.average[20] == pytest.approx((seeds[0][20] + seeds[1][20]) / 2)


def test_the_first_drive_is_recorded_and_replayed_from_the_recording(comparison, recording):
    messages = list(open_recording(recording).messages())
    scans = [message for message in messages if isinstance(message, LaserScan)]
    first = comparison.first("wu", "corners")
    np.testing.assert_allclose([scan.stamp for scan in scans], first.stamps, atol=1e-8)
    assert comparison.seeds[1].results == {}
    unrecorded = compare(FURNISHED_ROOM, [3], detectors=["wu"], simulation=DRIVE)
    # A recorded range is a 32-bit number: nearly the same run, but not the very same.
    again = unrecorded.first("wu", "corners")
    np.testing.assert_allclose(again.poses, first.poses, atol=1e-3)
    assert (again.poses != first.poses).any()


def test_several_processes_give_the_same_numbers_as_one():
    short = SimulationConfig(duration=1.0)
    alone, beside = (compare(FURNISHED_ROOM, (4, 3), detectors=["wu"], simulation=short, jobs=jobs) for jobs in (1, 2))
    for one, other in zip(alone.seeds, beside.seeds, strict=True):
        assert one.seed == other.seed
        for variant, metrics in one.metrics.items():
            assert metrics["rmse"] == other.metrics[variant]["rmse"]
            assert metrics["nees"] == other.metrics[variant]["nees"]


def test_a_stopped_comparison_keeps_what_is_done_and_says_that_it_is_not_complete():
    done = []
    observer = Observer(progress=lambda count, total: done.append(count), stopped=lambda: len(done) >= 3)
    short = SimulationConfig(duration=1.0)
    stopped = compare(FURNISHED_ROOM, (0, 1), detectors=DETECTORS, simulation=short, observer=observer)
    assert not stopped.complete
    assert [len(runs.metrics) for runs in stopped.seeds] == [3]
    assert set(stopped.table("corners")) == {"matched_filter", "wu"}
    assert set(stopped.table("walls")) == {"matched_filter"}


def test_an_interrupted_replay_is_not_counted(monkeypatch):
    from dataclasses import replace

    from contourslam.experiments import replays

    real, calls = replays.replay, []

    def interrupted(*args, **kwargs):
        calls.append(1)
        # Two warm-ups come first; Ctrl-C falls into the second of the two replays.
        return replace(real(*args, **kwargs), complete=len(calls) < 4)

    monkeypatch.setattr(replays, "replay", interrupted)
    short = SimulationConfig(duration=1.0)
    comparison = compare(FURNISHED_ROOM, [0, 1], detectors=["wu"], simulation=short)
    assert not comparison.complete
    assert len(comparison.seeds) == 1
    assert len(comparison.runs("wu", "corners")) == 1
    assert comparison.runs("wu", "walls") == []
    assert comparison.first("wu", "walls") is not None  # kept for its figures


def test_the_pipeline_is_told_the_noise_of_the_simulated_lidar():
    noisy = SimulationConfig(duration=1.0, noise=0.03)
    comparison = compare(FURNISHED_ROOM, [0], detectors=["wu"], config=Config(), simulation=noisy)
    assert comparison.config.lidar.sigma_range == 0.03
    assert comparison.config.lidar.mount_x == noisy.lidar.mount_x
