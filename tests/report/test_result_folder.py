import dataclasses
import itertools
import json

import numpy as np
import pytest

from contourslam.config import Config, SlamConfig
from contourslam.errors import ContourslamError, ResultError
from contourslam.evaluation.metrics import run_metrics
from contourslam.geometry.poses import interpolate
from contourslam.recordings import read_trajectory
from contourslam.report.occupancy import OccupancyGrid
from contourslam.report.result_folder import read_metrics, read_result_folder, to_json, write_result_folder
from contourslam.report.scan_table import read_scan_table, write_scan_table
from contourslam.slam.dense import dense_trajectory
from contourslam.slam.result import OdometryReadings


def written(folder, run, **options):
    config = Config(detector=run.detector, slam=SlamConfig(walls=True))
    write_result_folder(folder, run, config, run_metrics(run), command="contourslam run x.mcap", **options)
    return config


def test_a_run_comes_back_from_its_folder(tmp_path, make_run):
    run = make_run("wu")
    config = written(tmp_path / "deep" / "out", run)
    back = read_result_folder(tmp_path / "deep" / "out")
    assert back.config == config
    assert back.result.detector == "wu"
    np.testing.assert_array_equal(back.result.stamps, run.stamps)
    for name in ("poses", "covariances", "odometry", "truth", "nis"):
        np.testing.assert_allclose(getattr(back.result, name), getattr(run, name), rtol=1e-9, atol=1e-15, err_msg=name)
    for name in ("nis_dof", "matched_count", "corner_count", "wall_count"):
        np.testing.assert_array_equal(getattr(back.result, name), getattr(run, name), err_msg=name)
    np.testing.assert_allclose(back.result.corner_map.positions, run.corner_map.positions, atol=1e-4)
    again, once = run_metrics(back.result), run_metrics(run)
    assert again["rmse"] == pytest.approx(once["rmse"], rel=1e-6)
    assert again["nees"] == pytest.approx(once["nees"], rel=1e-6)


def test_the_folder_holds_what_was_promised(tmp_path, make_run):
    run = make_run()
    grid = OccupancyGrid()
    grid.add(np.zeros((1, 2)), np.ones((1, 2)))
    written(tmp_path, run, grid=grid)
    names = {path.name for path in tmp_path.iterdir()}
    promised = {"trajectory.tum", "map.geojson", "map.pgm", "map.yaml", "metrics.json", "config.yaml", "map.svg"}
    assert names == promised | {"scans.csv"}
    stamps, poses = read_trajectory(tmp_path / "trajectory.tum")
    np.testing.assert_allclose(stamps, run.stamps)
    np.testing.assert_allclose(poses, run.poses, atol=1e-9)
    assert (tmp_path / "map.svg").read_text().startswith("<svg ")
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert metrics["command"] == "contourslam run x.mcap"
    assert metrics["complete"] is True
    assert metrics["rmse"]["x"] < 0.02


def test_a_run_without_truth_and_without_a_map_is_kept_too(tmp_path, make_run):
    from dataclasses import replace

    from contourslam.report.scan_table import EMPTY_CORNERS, EMPTY_WALLS

    run = replace(make_run(scans=1), truth=None, corner_map=EMPTY_CORNERS, wall_map=EMPTY_WALLS)
    written(tmp_path, run)
    assert read_result_folder(tmp_path).result.truth is None


def test_a_truth_with_gaps_keeps_its_gaps(tmp_path, make_run):
    run = make_run()
    run.truth[3] = np.nan
    written(tmp_path, run)
    np.testing.assert_allclose(read_result_folder(tmp_path).result.truth, run.truth, atol=1e-9)


def test_what_the_graph_adds_comes_back_too(tmp_path, make_graph_run):
    run = make_graph_run()
    written(tmp_path, run)
    back = read_result_folder(tmp_path).result
    assert back.back_end == "graph"
    np.testing.assert_allclose(back.online_poses, run.online_poses, atol=1e-9)
    np.testing.assert_allclose(back.quality, run.quality, rtol=1e-9)
    assert len(back.loops) == len(run.loops) == 5
    for found, wanted in zip(back.loops, run.loops, strict=True):
        for name in (field.name for field in dataclasses.fields(wanted)):
            value = getattr(wanted, name)
            if isinstance(value, str | int):
                assert getattr(found, name) == value
            else:
                np.testing.assert_allclose(getattr(found, name), value, rtol=1e-9, atol=1e-15, err_msg=name)
        assert found.later_stamp == wanted.later_stamp  # stamps to the bit: they are looked up by them


def with_readings(run):
    """Two readings before each scan, the second at its stamp, and one after the last."""
    stamps = np.sort(np.concatenate([run.stamps - 0.05, run.stamps, run.stamps[-1:] + 0.05]))
    poses = interpolate(run.stamps, run.odometry, stamps)
    before = np.append(np.repeat(np.arange(len(run.stamps)), 2), len(run.stamps))
    return dataclasses.replace(run, readings=OdometryReadings(stamps, poses, before))


def test_the_readings_of_the_wheels_come_back_and_give_the_same_dense_trajectories(tmp_path, make_graph_run):
    run = with_readings(make_graph_run())
    written(tmp_path, run)
    back = read_result_folder(tmp_path).result
    np.testing.assert_allclose(back.readings.stamps, run.readings.stamps, atol=1e-9)
    np.testing.assert_array_equal(back.readings.scans_before, run.readings.scans_before)
    np.testing.assert_allclose(back.online_poses, run.online_poses, atol=1e-9)
    for name, online in (("trajectory.tum", False), ("trajectory_online.tum", True)):
        stamps, poses = dense_trajectory(back, online=online)
        filed = read_trajectory(tmp_path / name)
        assert len(stamps) == 2 * len(run.stamps) + (0 if online else 1)
        np.testing.assert_allclose(stamps, filed[0], atol=1e-9)
        np.testing.assert_allclose(poses, filed[1], atol=1e-8)
    filed = read_trajectory(tmp_path / "odometry.tum")
    np.testing.assert_allclose(filed[1], run.readings.poses, atol=1e-9)


def test_a_run_without_readings_leaves_none_of_an_earlier_run(tmp_path, make_run):
    written(tmp_path, with_readings(make_run()))
    assert (tmp_path / "odometry.tum").exists()
    written(tmp_path, make_run())
    assert not (tmp_path / "odometry.tum").exists()
    assert read_result_folder(tmp_path).result.readings is None


def test_readings_that_do_not_fit_the_scans_are_said(tmp_path, make_run):
    written(tmp_path, with_readings(make_run()))
    whole = (tmp_path / "odometry.tum").read_text()
    (tmp_path / "odometry.tum").write_text("\n".join(whole.splitlines()[:-40]) + "\n")
    with pytest.raises(ResultError, match=r"odometry\.tum: holds 561 readings"):
        read_result_folder(tmp_path)
    (tmp_path / "odometry.tum").unlink()
    with pytest.raises(ResultError, match=r"odometry\.tum"):
        read_result_folder(tmp_path)


def as_it_was(folder):
    """Make the folder one of before its trajectories were dense: online poses in their own file only."""
    lines = [line.split(",") for line in (folder / "scans.csv").read_text().splitlines()]
    kept = [i for i, name in enumerate(lines[0]) if not name.startswith("online_")]
    (folder / "scans.csv").write_text("".join(",".join(line[i] for i in kept) + "\n" for line in lines))


def test_a_folder_with_its_online_poses_in_a_file_of_their_own_still_loads(tmp_path, make_graph_run):
    run = make_graph_run()
    written(tmp_path, run)
    as_it_was(tmp_path)
    back = read_result_folder(tmp_path).result
    np.testing.assert_allclose(back.online_poses, run.online_poses, atol=1e-9)
    assert back.readings is None


@pytest.mark.parametrize(
    ("damage", "place"), [(lambda lines: lines[:-3], "297 poses"), (lambda lines: [*lines, "1 2"], "line 301")]
)
def test_damage_to_a_file_of_online_poses_is_named(tmp_path, make_graph_run, damage, place):
    written(tmp_path, make_graph_run())
    as_it_was(tmp_path)
    path = tmp_path / "trajectory_online.tum"
    path.write_text("\n".join(damage(path.read_text().splitlines())) + "\n")
    with pytest.raises(ResultError, match=f"trajectory_online[.]tum: .*{place}"):
        read_result_folder(tmp_path)


def test_a_folder_from_before_there_were_loops_still_loads(tmp_path, make_run):
    written(tmp_path, make_run())
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    del metrics["back_end"]
    (tmp_path / "metrics.json").write_text(json.dumps(metrics))
    back = read_result_folder(tmp_path).result
    assert (back.back_end, back.online_poses, back.quality, back.loops) == ("ekf", None, None, ())


def test_a_run_without_loops_leaves_none_of_an_earlier_run(tmp_path, make_run, make_graph_run):
    written(tmp_path, make_graph_run())
    assert {"loops.csv", "trajectory_online.tum"} <= {path.name for path in tmp_path.iterdir()}
    written(tmp_path, make_run())
    assert not {"loops.csv", "trajectory_online.tum"} & {path.name for path in tmp_path.iterdir()}


@pytest.mark.parametrize("known", list(itertools.product([True, False], repeat=4)))
def test_every_choice_of_known_columns_comes_back(tmp_path, make_graph_run, known):
    run = with_readings(make_graph_run(scans=20))
    names = ("truth", "quality", "online_poses", "readings")
    run = dataclasses.replace(run, **{name: None for name, there in zip(names, known, strict=True) if not there})
    write_scan_table(tmp_path / "scans.csv", run)
    back, before = read_scan_table(tmp_path / "scans.csv")
    assert (*(getattr(back, name) is not None for name in names[:3]), before is not None) == known


def test_an_incomplete_run_says_so(tmp_path, make_run):
    written(tmp_path, make_run(complete=False))
    assert json.loads((tmp_path / "metrics.json").read_text())["complete"] is False
    assert read_result_folder(tmp_path).result.complete is False


@pytest.mark.parametrize("name", ["metrics.json", "map.geojson", "scans.csv", "config.yaml"])
def test_a_missing_or_damaged_file_is_named(tmp_path, make_run, name):
    written(tmp_path, make_run())
    whole = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(whole[:-9] + b"\xff{]")
    with pytest.raises(ContourslamError, match=name.replace(".", r"\.")):
        read_result_folder(tmp_path)
    (tmp_path / name).unlink()
    with pytest.raises(ContourslamError, match=name.replace(".", r"\.")):
        read_result_folder(tmp_path)


@pytest.mark.parametrize("line", ["1,2,3", "", "1," * 18 + "x"])
def test_a_damaged_line_of_the_scan_table_is_numbered(tmp_path, make_run, line):
    written(tmp_path, make_run())
    lines = (tmp_path / "scans.csv").read_text().splitlines()
    lines[4] = line
    (tmp_path / "scans.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(ResultError, match=r"scans\.csv: line 5 "):
        read_result_folder(tmp_path)


@pytest.mark.parametrize(
    ("name", "damage", "place"),
    [
        ("loops.csv", lambda lines: [*lines[:2], lines[2].replace("constellation,", "constellation,many")], "line 3"),
        ("loops.csv", lambda lines: [*lines[:2], lines[2] + ",1"], "line 3"),
        ("loops.csv", lambda lines: lines[1:], "line 1"),
        ("loops.csv", lambda lines: ["\0"], "loops"),
    ],
)
def test_damage_to_loops_is_named_by_place(tmp_path, make_graph_run, name, damage, place):
    written(tmp_path, make_graph_run())
    path = tmp_path / name
    path.write_text("\n".join(damage(path.read_text().splitlines())) + "\n")
    with pytest.raises(ResultError, match=f"{name.replace('.', '[.]')}: .*{place}"):
        read_result_folder(tmp_path)


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ResultError, match="there is no such result folder"):
        read_result_folder(tmp_path / "none")


def test_metrics_must_be_an_object(tmp_path):
    (tmp_path / "metrics.json").write_text("[1]")
    with pytest.raises(ResultError, match="JSON object"):
        read_metrics(tmp_path / "metrics.json")


def test_a_file_where_the_folder_should_be_is_said(tmp_path, make_run):
    (tmp_path / "out").write_text("in the way")
    with pytest.raises(ResultError, match="cannot be made"):
        written(tmp_path / "out", make_run())


def test_json_holds_no_number_that_json_does_not_know():
    text = to_json({"a": np.nan, "b": [np.inf, np.float32(1.5)], "c": np.arange(3), "d": {1: (True, None)}})
    assert json.loads(text) == {"a": None, "b": [None, 1.5], "c": [0, 1, 2], "d": {"1": [True, None]}}
