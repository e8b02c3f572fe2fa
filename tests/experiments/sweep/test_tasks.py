"""What fails is a row and stops nothing; what is done is not done again."""

import itertools

import pytest

from contourslam.experiments.sweep import tasks
from contourslam.experiments.sweep.cost import expected_seconds
from contourslam.experiments.sweep.store import Store, read_results
from contourslam.experiments.sweep.tasks import TRIES, Task, do_runs, pieces, stop
from contourslam.experiments.sweep.versions import program

ROOM = '[simulation]\nrooms = "furnished_room"\nduration = 1.0\n'


@pytest.fixture
def do(tmp_path):
    """Do runs here, without Dask, and give the table's rows."""
    store = Store(f"memory://{tmp_path.name}")

    def run(runs, session="a", tell=lambda *_: None):
        store.write_experiment("test", "", [run.key for run in runs])
        do_runs(Task(session, program(), store.url, tuple(runs)), tell)
        return read_results(store.url).to_pylist()

    run.store = store
    return run


def test_a_run_that_fails_is_a_row_with_its_error_and_the_next_is_done(planned, do, tmp_path):
    (tmp_path / "mine.py").write_text("def Mine(adapted):\n    raise LookupError('not\\nmine')\n")
    told = []
    text = 'detectors = ["mine", "wu"]\n[own_detectors]\nmine = "mine.py:Mine"\n' + ROOM
    failed, done = do(planned(text), tell=lambda *said: told.append(said))
    assert (failed["status"], failed["error_type"], failed["error"]) == ("failed", "LookupError", "not\nmine")
    assert "raise LookupError" in failed["traceback"]
    assert failed["rmse.x"] is None
    assert (done["status"], done["error"], done["tries"]) == ("done", None, 1)
    assert done["rmse.x"] < 0.1
    assert told == [(failed["key"], "failed"), (done["key"], "done")]


def test_a_recording_that_is_missing_or_damaged_is_a_row_that_says_so(planned, do, tmp_path, log_of):
    log_of(end="FLASER 180 1.0 2.")
    rows = do(planned('detectors = "wu"\n[recordings]\npaths = ["missing.log", "still.log"]\n'))
    assert [(row["recording"], row["status"], row["error_type"]) for row in rows] == [
        ("missing", "failed", "RecordingError"),
        ("still", "failed", "RecordingError"),
    ]
    assert "missing.log" in rows[0]["error"]
    assert "cut short in line 26" in rows[1]["error"]
    assert rows[1]["scans"] == 25.0


def test_what_has_a_row_is_not_begun_again(planned, do):
    runs = planned('detectors = "wu"\n' + ROOM + "noise = [0.0, 0.01, 0.02]\n")
    do(runs[:2])
    assert len(do(runs, session="b")) == 3
    assert do.store.starts() == {run.key: 1 for run in runs}


def test_a_run_that_ends_its_worker_again_and_again_becomes_a_row_that_failed(planned, do, monkeypatch):
    (run,) = planned('detectors = "wu"\n' + ROOM)
    for _ in range(TRIES):
        do.store.begin("a", run.key)
    (row,) = do([run])
    assert (row["status"], row["error_type"]) == ("failed", "WorkerDiedError")
    do.store.forget_failed([run.key])
    (row,) = do([run], session="another")  # a new sweep tries anew
    assert row["status"] == "done"


def test_a_task_that_is_told_to_stop_ends_after_the_run_it_is_at(planned, do, monkeypatch):
    monkeypatch.setattr(tasks, "_stopped", set())
    runs = planned('detectors = "wu"\n' + ROOM + "noise = [0.0, 0.01, 0.02]\n")
    assert len(do(runs, tell=lambda *_: stop("a"))) == 1


@pytest.mark.parametrize("processes", [1, 2, 7])
def test_pieces_hold_every_run_once_and_none_holds_two_drives(planned, processes):
    runs = planned(
        'detectors = ["wu", "teh_chin"]\n'
        + ROOM
        + "seeds = 5\n[[sweep]]\nnoise = [0.0, 0.01, 0.02]\n[[sweep]]\nbeams = [180, 360]\n[[sweep]]\nseeds = [9]\n"
    )
    cut = pieces(runs, processes)
    assert sorted(run.key for piece in cut for run in piece) == sorted(run.key for run in runs)
    assert all(len({run.drive.shared for run in piece}) == 1 for piece in cut)
    assert len(cut) >= min(3 * processes, len(runs))  # the last ones leave nobody idle for long
    for piece in cut:  # the same scans side by side
        groups = [key for key, _ in itertools.groupby(piece, key=lambda run: run.drive)]
        assert len(groups) == len(set(groups))


def test_the_cost_is_told_by_what_is_like_it(planned, do):
    runs = planned('detectors = ["wu", "teh_chin"]\n' + ROOM + "seeds = 2\n")
    assert expected_seconds(runs, do.store.read()) is None
    rows = do(runs[:2])
    here = {row["detector"]: row["seconds"] for row in rows}
    assert expected_seconds(runs[2:], do.store.read()) == pytest.approx(sum(here.values()))


def test_no_drive_is_simulated_twice_where_there_are_enough_for_all(planned):
    runs = planned('detectors = ["wu", "teh_chin"]\n' + ROOM + "seeds = 8\n")
    assert len(pieces(runs, 2)) == 8
