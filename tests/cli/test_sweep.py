"""The command says what there is, what failed, what it would cost; its processes are tried in experiments/sweep."""

import json
from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="the extra sweep is not installed")
pytest.importorskip("mujoco", reason="the extra simulation is not installed")

from contourslam.cli import main
from contourslam.cli.interrupt import INTERRUPTED
from contourslam.experiments.sweep import engine
from contourslam.experiments.sweep.engine import Outcome
from contourslam.experiments.sweep.store import Store
from contourslam.experiments.sweep.tasks import Task, do_runs
from contourslam.experiments.sweep.versions import program

TEXT = 'name = "small"\ndetectors = "wu"\n[simulation]\nrooms = "furnished_room"\nduration = 1.0\n'
FAILING = "".join((TEXT.replace('"wu"', '["wu", "bad"]'), '[own_detectors]\nbad = "bad.py:Bad"\n'))


@pytest.fixture
def sweep(tmp_path, monkeypatch, capsys):
    """Run the command on an experiment, with its runs done in this process."""

    def here(runs, store, *, jobs, scheduler, observer, say):
        over: list[tuple[str, str]] = []
        do_runs(Task("session", program(), store.url, tuple(runs)), lambda *told: over.append(told))
        observer.progress(len(over), len(runs))
        failed = sum(status == "failed" for _, status in over)
        return Outcome(len(over) - failed, failed, True)

    monkeypatch.setattr(engine, "sweep", here)
    monkeypatch.chdir(tmp_path)

    def run(text, *words):
        Path("experiment.toml").write_text(text)
        code = main(["sweep", "experiment.toml", "-o", "results", *words])
        said = capsys.readouterr()
        return code, json.loads(said.out) if "--json" in words and said.out else said.out, said.err

    return run


def test_what_is_there_is_not_done_again_and_what_is_new_is(sweep):
    assert sweep(TEXT, "--json")[1] | {"runs": 1, "done": 1, "now": 1, "failed": []} == sweep(TEXT, "--json")[1] | {
        "now": 1
    }
    code, said, note = sweep(TEXT + "seeds = 3\n")
    assert (code, said.partition(": ")[2]) == (0, "3 of 3 runs done, 2 of them now\n")
    assert "1 of 3 runs are there already" in note
    assert set(Store("results").starts().values()) == {1}
    assert not list(Path("results/parts").iterdir())


def test_a_dry_run_says_how_many_and_what_they_would_cost_and_leaves_nothing(sweep):
    _, said, _ = sweep(TEXT + "seeds = 5\n", "--dry-run")
    assert said == "5 runs: 0 done, 0 failed, 5 left\nwhat is left would take: unknown before the first is done\n"
    assert not Path("results").exists()
    sweep(TEXT)
    _, said, _ = sweep(TEXT + "seeds = 5\n", "--dry-run", "--json")
    assert (said["runs"], said["done"], said["left"]) == (5, 1, 4)
    assert 0.0 < said["seconds"] < 100.0
    assert "one core" in sweep(TEXT + "seeds = 5\n", "--dry-run")[1]


def test_what_failed_is_named_and_done_again_where_that_is_wanted(sweep, tmp_path):
    (tmp_path / "bad.py").write_text("def Bad(adapted):\n    raise OSError('it is not the day')\n")
    code, said, complaint = sweep(FAILING)
    assert code == 1
    assert "1 of 2 runs done" in said
    assert "bad, default, furnished_room, seed 0, noise 0.01 m, 500 beams: OSError: it is not the day" in complaint
    assert "--retry-failed" in complaint
    sweep(FAILING)
    assert set(Store("results").starts().values()) == {1}
    code, said, _ = sweep(FAILING, "--retry-failed", "--json")
    assert (code, said["done"], [failed["error_type"] for failed in said["failed"]]) == (1, 1, ["OSError"])
    assert sorted(Store("results").starts().values()) == [1, 2]


def test_an_interrupted_sweep_says_how_to_go_on(sweep, monkeypatch):
    monkeypatch.setattr(engine, "sweep", lambda *_, **__: Outcome(0, 0, False))
    code, said, complaint = sweep(TEXT)
    assert code == INTERRUPTED
    assert "0 of 1 runs done" in said
    assert "the same command goes on from there" in complaint


def test_compact_makes_the_table_and_runs_nothing(sweep, monkeypatch):
    sweep(TEXT)
    code, said, _ = sweep(TEXT + "seeds = 2\n", "--compact", "--json")
    assert (code, said["runs"], said["done"], said["now"]) == (0, 2, 1, 0)
    assert Store("results").starts() == {}


def test_compact_says_what_is_left_and_not_that_all_is_there(sweep):
    sweep(TEXT)
    code, said, notes = sweep(TEXT + "seeds = 3\n", "--compact")
    assert (code, said.partition(": ")[2]) == (0, "1 of 3 runs done, 0 of them now\n")
    assert notes == "contourslam: 2 of 3 runs are left; the same command without --compact does them\n"
    assert not sweep(TEXT + "seeds = 3\n", "--compact", "--json")[1]["complete"]


@pytest.mark.parametrize("words", [(), ("--dry-run",), ("--compact",)])
def test_results_of_another_experiment_are_left_alone(sweep, words):
    sweep(TEXT)
    code, _, complaint = sweep(TEXT.replace("small", "large"), *words)
    assert code == 1
    assert "holds the results of 'small', not of 'large'" in complaint


def test_what_is_wrong_in_the_file_is_one_line(sweep):
    code, _, complaint = sweep(TEXT + "beems = 3\n")
    assert code == 1
    assert complaint == (
        "contourslam: error: experiment.toml, line 6: simulation.beems: is unknown; did you mean beams?\n"
    )


def test_another_sweep_that_writes_its_experiment_meanwhile_changes_no_word_of_this_one(sweep, monkeypatch):
    here = engine.sweep

    def meanwhile(runs, store, **options):
        store.write_experiment("small", "", ["another"])
        return here(runs, store, **options)

    monkeypatch.setattr(engine, "sweep", meanwhile)
    code, said, complaint = sweep(TEXT, "--json")
    assert (code, said["runs"], said["done"]) == (0, 1, 1), complaint


def test_a_damaged_row_is_told_and_done_again(sweep):
    sweep(TEXT)
    (table,) = Path("results/tables").iterdir()
    table.unlink()
    Path("results/results.parquet").unlink()
    (key,) = Store("results").planned().keys
    Path(f"results/parts/{key}.done.parquet").write_bytes(b"PAR1 x")
    code, said, complaint = sweep(TEXT, "--json")
    assert (code, said["done"], said["now"]) == (0, 1, 1)
    assert f"{key}.done.parquet is damaged; its run counts as not done" in complaint
