"""Every combination once; what a run's result depends on is in its key, and nothing else."""

import shutil
from pathlib import Path

import pytest

from contourslam.errors import ConfigError
from contourslam.experiments.sweep import runs as runs_module
from contourslam.experiments.sweep import versions
from contourslam.experiments.sweep.plan import plan
from contourslam.experiments.sweep.tasks import other_program

SMALL = 'detectors = ["wu"]\n[simulation]\nrooms = "furnished_room"\n'


def keys(runs):
    return {run.key for run in runs}


def test_every_combination_is_there_once(planned):
    runs = planned(
        SMALL.replace('["wu"]', '["wu", "teh_chin"]') + "noise = [0.0, 0.01]\nbeams = [180, 360]\nseeds = 3\n"
    )
    assert len(runs) == len(keys(runs)) == 2 * 2 * 2 * 3


def test_what_two_grids_have_in_common_is_run_once_also_where_one_leaves_to_the_lidar_what_the_other_says(planned):
    runs = planned(SMALL + "[[sweep]]\nnoise = [0.0, 0.01]\n[[sweep]]\nbeams = [180, 500]\n")
    assert sorted((run.drive.noise, run.drive.beams) for run in runs) == [(0.0, 500), (0.01, 180), (0.01, 500)]


def test_a_grown_experiment_keeps_the_keys_that_it_had(planned):
    few = keys(planned(SMALL + "seeds = 2\n"))
    many = keys(planned('name = "other"\n' + SMALL.replace('["wu"]', '["wu", "teh_chin"]') + "seeds = 4\n"))
    assert few < many


@pytest.mark.parametrize(
    "more",
    ["noise = 0.02\n", "beams = 400\n", "speed = 0.3\n", 'lidar = "ydlidar_x4"\n', "duration = 9.0\n", "seeds = [1]\n"],
)
def test_whatever_is_varied_makes_another_key(planned, more):
    assert not keys(planned(SMALL)) & keys(planned(SMALL + more))


def test_a_setting_and_a_changed_program_make_another_key(planned, monkeypatch):
    plain = keys(planned(SMALL + "[settings.a]\n"))
    assert not plain & keys(planned(SMALL + "[settings.a]\nslam.walls = true\n"))
    monkeypatch.setattr(runs_module, "program", lambda: "0.0.0+another")
    assert not plain & keys(planned(SMALL + "[settings.a]\n"))


def test_a_setting_stands_above_what_the_data_sheet_of_a_simulated_lidar_says(planned):
    plain, told = planned(SMALL + "noise = 0.03\n[settings.a]\n[settings.b]\nlidar.sigma_range = 0.5\n")
    assert (plain.config.lidar.sigma_range, told.config.lidar.sigma_range) == (0.03, 0.5)


def test_runs_of_one_drive_stand_together(planned):
    runs = planned(SMALL + "seeds = 2\n[[sweep]]\nnoise = 0.0\n[[sweep]]\nnoise = 0.05\n")
    assert [run.drive.seed for run in runs] == [0, 0, 1, 1]


def test_a_recording_is_known_by_its_content_and_not_by_its_place(planned, tmp_path):
    text = 'detectors = "wu"\n[recordings]\npaths = "logs/*.log"\n'
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "a.log").write_text("one")
    first = planned(text)
    (tmp_path / "logs" / "a.log").rename(tmp_path / "logs" / "b.log")
    assert keys(planned(text)) == keys(first)
    (tmp_path / "logs" / "b.log").write_text("two")
    assert not keys(planned(text)) & keys(first)
    (tmp_path / "logs" / "b.relations.txt").write_text("some")
    judged = planned(text)
    assert judged[0].drive.relations == str(tmp_path / "logs" / "b.relations.txt")
    (tmp_path / "logs" / "b.relations.txt").write_text("others")
    assert not keys(planned(text)) & keys(judged)


def test_recordings_have_names_that_tell_them_apart(planned, tmp_path):
    for name in ("a/drive.log", "b/drive.log", "c/other.log"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(name)
    runs = planned('detectors = "wu"\n[recordings]\npaths = "*/*.log"\n')
    assert [run.drive.name for run in runs] == ["a/drive.log", "b/drive.log", "c/other.log"]
    shutil.rmtree(tmp_path / "b")
    runs = planned('detectors = "wu"\n[recordings]\npaths = "*/*.log"\n')
    assert [run.drive.name for run in runs] == ["drive", "other"]


def test_relations_are_those_that_the_experiment_names(planned, tmp_path):
    (tmp_path / "a.log").write_text("one")
    (tmp_path / "known.txt").write_text("some")
    (run,) = planned('detectors = "wu"\n[recordings]\npaths = "a.log"\n[recordings.relations]\n"a.log" = "known.txt"\n')
    assert Path(run.drive.relations).name == "known.txt"


def test_a_pattern_without_a_match_is_refused_and_a_missing_file_is_a_run_that_fails(planned):
    with pytest.raises(ConfigError, match="no file matches"):
        planned('[recordings]\npaths = "logs/*.log"\n')
    (run,) = planned('detectors = "wu"\n[recordings]\npaths = "logs/a.log"\n')
    assert "cannot be read" in run.drive.identity


def test_a_recording_in_a_store_is_found_by_its_pattern(planned):
    import fsspec

    store = fsspec.filesystem("memory")
    store.pipe_file("/logs/a.log", b"one")
    first = planned('detectors = "wu"\n[recordings]\npaths = "memory://logs/*.log"\n')
    assert [run.drive.url for run in first] == ["memory:///logs/a.log"]
    store.pipe_file("/logs/a.log", b"three")
    assert not keys(planned('detectors = "wu"\n[recordings]\npaths = "memory://logs/*.log"\n')) & keys(first)


@pytest.mark.parametrize(
    ("place", "said"),
    [
        ("mine.py", "must be FILE.py:FACTORY or MODULE:FACTORY"),
        ("miné.py:Mine", "cannot be read"),
        ("mine.py:Mien", "has no Mien; did you mean Mine?"),
        ("broken.py:Mine", "is not Python"),
        ("no_such_module:Mine", "there is no Python module"),
    ],
)
def test_a_detector_that_cannot_be_is_told_before_anything_is_run(written, tmp_path, place, said):
    (tmp_path / "mine.py").write_text("class Mine:\n    pass\n")
    (tmp_path / "broken.py").write_text("class Mine:\n")
    with pytest.raises(ConfigError, match=r"own_detectors\.mine") as error:
        plan(written(f'{SMALL}[own_detectors]\nmine = "{place}"\n'))
    assert said in str(error.value)


def test_a_detector_may_not_take_the_name_of_one_of_the_package(written, tmp_path):
    (tmp_path / "mine.py").write_text("class Mine:\n    pass\n")
    with pytest.raises(ConfigError, match="wu is a detector of the package"):
        plan(written(SMALL + '[own_detectors]\nwu = "mine.py:Mine"\n'))


def test_planning_runs_nothing_of_a_detectors_file(planned, tmp_path):
    (tmp_path / "mine.py").write_text("raise SystemExit\nMine = None\n")
    text = SMALL.replace('["wu"]', '"mine"') + '[own_detectors]\nmine = "mine.py:Mine"\n'
    before = keys(planned(text))
    (tmp_path / "mine.py").write_text("raise SystemExit\nMine = None  # changed\n")
    assert not keys(planned(text)) & before


def test_another_factory_of_the_same_file_makes_another_key(planned, tmp_path):
    (tmp_path / "mine.py").write_text("from contourslam.detectors import TehChin as B, Wu as A\n")
    text = SMALL.replace('["wu"]', '"mine"') + '[own_detectors]\nmine = "mine.py:A"\n'
    assert not keys(planned(text)) & keys(planned(text.replace("mine.py:A", "mine.py:B")))


def test_other_libraries_make_another_key(planned, monkeypatch):
    plain = versions.program()
    found = versions.libraries() | {"mujoco": "0.0.1"}
    monkeypatch.setattr(versions, "libraries", lambda: found)
    other = versions.program.__wrapped__()
    assert other.rpartition(".")[0] == plain.rpartition(".")[0]
    assert other != plain
    assert "has other libraries (of numpy," in other_program("tcp://a:1", other, plain)
