"""Every row is there once, whatever dies in between, on a disk and elsewhere."""

import json
from datetime import UTC, datetime

import pytest

from contourslam.errors import ConfigError, MissingExtraError, ResultError
from contourslam.experiments.sweep.place import Place
from contourslam.experiments.sweep.rows import FIXED, failed_row
from contourslam.experiments.sweep.store import Store, read_results


@pytest.fixture(params=["file", "memory"])
def store(request, tmp_path):
    url = str(tmp_path / "results") if request.param == "file" else f"memory://{tmp_path.name}"
    found = Store(url)
    found.write_experiment("test", "", ["a", "b", "c"])
    return found


@pytest.fixture
def row(planned):
    (run,) = planned('detectors = "wu"\n[simulation]\nrooms = "furnished_room"\n')
    plain = failed_row(run, ValueError("no"), started=datetime.now(UTC), seconds=1.0, tries=1)

    def make(key, status="done", **figures):
        return plain | {"key": key, "status": status} | figures

    return make


def rows(store):
    return {row["key"]: row for row in read_results(store.url).to_pylist()}


def test_a_row_is_read_as_it_was_written(store, row):
    store.write_row(row("a", **{"rmse.x": 0.25, "complete": True}))
    (found,) = read_results(store.url).to_pylist()
    assert found["rmse.x"] == 0.25
    assert found["complete"] is True
    assert found["room"] == "furnished_room"
    assert found["recording"] is None
    assert json.loads(found["config"])["config"]["slam"]["walls"] is False
    assert found["started"].tzinfo is not None
    assert list(found)[: len(FIXED)] == list(FIXED)


def test_a_row_that_is_written_twice_is_there_once(store, row):
    store.write_row(row("a"))
    store.compact()
    store.write_row(row("a"))
    store.write_row(row("b"))
    assert sorted(rows(store)) == ["a", "b"]
    assert store.compact() == 2
    assert sorted(rows(store)) == ["a", "b"]
    assert store.status() == {"a": "done", "b": "done"}


def test_rows_with_different_figures_make_one_table(store, row):
    store.write_row(row("a", **{"rmse.x": 1.0}))
    store.write_row(row("b", "failed", **{"relations.translation.mean": 2.0}))
    store.compact()
    store.write_row(row("c"))
    found = rows(store)
    assert found["a"] | {"rmse.x": 1.0, "relations.translation.mean": None} == found["a"]
    assert found["b"]["relations.translation.mean"] == 2.0
    assert list(found) == ["a", "b", "c"]


def test_what_is_done_stands_above_what_failed_wherever_both_are(store, row):
    store.write_row(row("a", "failed"))
    assert store.status() == {"a": "failed"}
    store.compact()
    store.write_row(row("a"))
    assert store.status() == {"a": "done"}
    assert rows(store)["a"]["status"] == "done"
    store.compact()
    store.write_row(row("a", "failed"))
    assert rows(store)["a"]["status"] == "done"
    assert store.status() == {"a": "done"}


def test_a_run_that_failed_again_has_its_last_error(store, row):
    store.write_row(row("a", "failed", error="first"))
    store.compact()
    store.write_row(row("a", "failed", error="second"))
    assert rows(store)["a"]["error"] == "second"


def test_a_crash_after_the_table_was_written_doubles_nothing(store, row, monkeypatch):
    store.write_row(row("a"))
    monkeypatch.setattr(Place, "remove", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        store.compact()
    monkeypatch.undo()
    assert store.status_of("a") == "done"
    assert list(rows(store)) == ["a"]


def test_rows_that_no_longer_belong_to_the_experiment_are_kept_and_left_out(store, row):
    store.write_row(row("a"))
    store.write_row(row("old"))
    store.compact()
    assert list(rows(store)) == ["a"]
    assert sorted(read_results(store.url, every=True).column("key").to_pylist()) == ["a", "old"]


def test_results_belong_to_one_experiment(store):
    with pytest.raises(ResultError, match="holds the results of 'test', not of 'other'"):
        store.write_experiment("other", "", [])


def test_each_start_of_a_run_is_marked_and_counted_by_session(store):
    assert [store.begin("s", "a"), store.begin("s", "a"), store.begin("t", "a"), store.begin("s", "b")] == [1, 2, 1, 1]
    assert store.starts() == {"a": 3, "b": 1}
    store.remove_starts()
    assert store.starts() == {}


def test_a_sweep_without_a_row_has_an_empty_table(store):
    assert read_results(store.url).num_rows == 0
    assert store.compact() == 0


def test_what_is_no_result_is_told(tmp_path):
    with pytest.raises(ResultError, match="holds no results of a sweep"):
        read_results(str(tmp_path))
    with pytest.raises(ConfigError, match="nowhere"):
        Store("nowhere://a")


@pytest.mark.parametrize("content", [b"", b"PAR1 x", b"PAR1 cut short"])
def test_a_damaged_row_is_left_out_and_told_and_done_again(store, row, content):
    store.write_row(row("a"))
    store._place.write("parts/b.done.parquet", content)
    assert store.status() == {"a": "done"}
    assert store.damaged == ("parts/b.done.parquet",)
    assert list(rows(store)) == ["a"]
    store.forget_failed(["b"])
    assert store.status_of("b") is None
    store.write_row(row("b"))
    assert list(rows(store)) == ["a", "b"]


def test_a_damaged_table_is_named(store, row):
    store.write_row(row("a"))
    store.compact()
    (name,) = store._tables()
    store._place.write(name, b"PAR1 cut short")
    with pytest.raises(ResultError, match=rf"{name}: cannot be read .*; remove it"):
        read_results(store.url)


def test_two_that_bring_rows_together_at_once_lose_none(store, row, monkeypatch):
    other = Store(store.url)
    store.write_row(row("a"))
    write = store._place.write

    def meanwhile(name, content):  # after the rows were read, and before their table is there
        monkeypatch.setattr(store._place, "write", write)
        other.write_row(row("b"))
        assert other.compact() == 2
        write(name, content)

    monkeypatch.setattr(store._place, "write", meanwhile)
    assert store.compact() == 2
    assert list(rows(store)) == ["a", "b"]
    store.write_row(row("c"))
    assert store.compact() == other.compact() == 3
    assert len(store._tables()) == 1
    assert store._parts() == []


def test_rows_that_another_brings_together_while_they_are_read_are_all_read(store, row, monkeypatch):
    listed, other = store._tables, Store(store.url)
    store.write_row(row("a"))
    store.compact()
    store.write_row(row("b"))

    def meanwhile():
        found = listed()
        monkeypatch.setattr(store, "_tables", listed)
        other.compact()
        return found

    monkeypatch.setattr(store, "_tables", meanwhile)
    assert sorted(store.status()) == ["a", "b"]


def test_a_worker_knows_what_another_sweep_did_and_brought_into_a_table(store, row):
    worker, other = Store(store.url), Store(store.url)
    assert worker.status_of("a") is None
    other.write_row(row("a"))
    other.write_row(row("b", "failed"))
    other.compact()
    assert worker.status_of("a") == "done"
    assert worker.status_of("b") is None  # it may be there since before it was to be done again


def test_results_of_one_file_as_they_were_once_written_are_read_and_kept(store, row):
    store.write_row(row("a"))
    store.compact()
    store._place.remove(*store._tables())
    assert list(rows(store)) == ["a"]
    store.write_row(row("b"))
    assert store.compact() == 2
    store._place.remove("results.parquet")
    assert list(rows(store)) == ["a", "b"]


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"name": "test", "keys": 3}'])
def test_what_is_no_note_of_an_experiment_is_told(tmp_path, content):
    (tmp_path / "experiment.json").write_text(content)
    store = Store(str(tmp_path))
    for attempt in (lambda: store.write_experiment("test", "", []), lambda: read_results(store.url)):
        with pytest.raises(ResultError, match=r"experiment\.json: is none of a sweep"):
            attempt()


def test_a_file_in_place_of_the_folder_is_told(tmp_path):
    (tmp_path / "results").write_text("a file")
    store = Store(str(tmp_path / "results"))
    for attempt in (store.status, store.planned, lambda: store.begin("s", "a")):
        with pytest.raises(ResultError, match="results"):
            attempt()


def test_a_store_that_shows_half_a_file_never_shows_half_a_row(tmp_path, row, monkeypatch):
    store = Store(f"memory://{tmp_path.name}")
    monkeypatch.setattr(store._place, "_whole", False)
    system = store._place._system
    store.write_row(row("a"))
    pipe = type(system).pipe_file
    seen = []

    def halfway(self, path, content):
        pipe(self, path, content[: len(content) // 2])
        seen.append(Store(store.url).status())
        pipe(self, path, content)

    monkeypatch.setattr(type(system), "pipe_file", halfway)
    store.write_row(row("b"))
    assert seen == [{"a": "done"}]
    assert store.status() == {"a": "done", "b": "done"}


def test_a_store_whose_library_is_missing_names_it(monkeypatch):
    import fsspec

    def missing(url):
        raise ImportError("Install s3fs to access S3")

    monkeypatch.setattr(fsspec.core, "url_to_fs", missing)
    with pytest.raises(MissingExtraError, match="s3://bucket/a: Install s3fs"):
        Store("s3://bucket/a")


def test_a_disk_that_takes_nothing_is_told(tmp_path, row):
    (tmp_path / "results").write_text("a file")
    with pytest.raises(ResultError, match="cannot be"):
        Store(str(tmp_path / "results")).write_row(row("a"))
