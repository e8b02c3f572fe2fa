import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray

pytest.importorskip("gtsam", reason="needs the extra 'graph'")
pytest.importorskip("shapely", reason="needs the extra 'simulation'")

from contourslam.cli import main
from contourslam.cli.interrupt import INTERRUPTED
from contourslam.cli.locate import UNSURE
from contourslam.config import Config
from contourslam.geometry.poses import between, interpolate
from contourslam.graph import GraphSlam, kept
from contourslam.joining import find, merging
from contourslam.joining.groups import LeftOut
from contourslam.joining.joint import Apart, Evidence, Joint
from contourslam.maps import SavedMap, load_map, save_map
from contourslam.recordings import read_trajectory, write_trajectory
from contourslam.report.joints import Verdict
from contourslam.scan import LaserScan, Odometry, TruePose
from contourslam.simulation.long_drive import building_drive

Failure = Callable[..., str]
Floats = NDArray[np.float64]
CONFIG = Config(back_end="graph")
LENGTH = 70.0


def write_part(folder: Path, building: int, first: float, until: float, length: float = LENGTH) -> Path:
    """Map a part of a drive, and leave what a run leaves of it: the map, and a trajectory."""
    drive = building_drive(length, building)
    messages = [m for m in drive.messages() if isinstance(m, LaserScan | Odometry)]
    slam, stamps = GraphSlam(CONFIG, lidar_mount=drive.lidar_mount), []
    for message in messages[int(first * len(messages)) : int(until * len(messages))]:
        if isinstance(message, Odometry):
            slam.push_odometry(message)
        else:
            slam.push_scan(message)
            stamps.append(message.stamp)
    poses = slam.finish().poses
    folder.mkdir(parents=True)
    save_map(folder / "map.cmap", kept(slam, {"recordings": folder.name, "detector": CONFIG.detector}))
    write_trajectory(folder / "trajectory.tum", stamps, poses)
    return folder


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, Path]:
    """Two robots in one building, and one in another."""
    root = tmp_path_factory.mktemp("runs")
    return (
        write_part(root / "monday", 0, 0.0, 0.52),
        write_part(root / "tuesday", 0, 0.52, 1.0),
        write_part(root / "elsewhere", 3, 0.0, 1.0, 20.0),
    )


@pytest.fixture
def nothing_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """No search: whatever does not hold the same drive is apart."""
    monkeypatch.setattr(find, "find_joint", lambda first, second, observer=None: Apart("nothing alike"))


def words(*arguments: object) -> list[str]:
    return ["merge", *map(str, arguments)]


def true_at(stamps: Floats) -> Floats:
    rows = np.array([(m.stamp, *m.pose) for m in building_drive(LENGTH, 0).messages() if isinstance(m, TruePose)])
    return interpolate(rows[:, 0], rows[:, 1:], stamps)


def test_maps_that_overlap_become_one_and_one_from_elsewhere_stays_apart(
    runs: tuple[Path, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str], failure: Failure
) -> None:
    house, picture, ways = tmp_path / "house.cmap", tmp_path / "house.svg", tmp_path / "ways"
    capsys.readouterr()
    options = ("-o", house, "--picture", picture, "--trajectories", ways, "--json")
    assert main(words(*runs, *options)) == UNSURE
    told = json.loads(capsys.readouterr().out)
    assert [(pair["maps"], pair["joined"]) for pair in told["pairs"]] == [
        (["monday", "tuesday"], True), (["monday", "elsewhere"], False), (["tuesday", "elsewhere"], False)
    ]  # fmt: skip
    assert told["pairs"][0]["agreeing"] > 50.0
    assert told["pairs"][0]["contradicted"] < 0.02
    assert "reason" in told["pairs"][1]
    assert told["apart"] == ["elsewhere"]
    (one,) = told["merged"]
    merged = load_map(house)
    assert merged.keyframes is not None
    assert (one["file"], one["drives"], one["keyframes"]) == (str(house), 2, len(merged.keyframes))
    assert [part["name"] for part in one["maps"]] == ["monday", "tuesday"]
    assert merged.about["recordings"] == "monday\ntuesday"
    assert merged.about["merged"] == f"{runs[0] / 'map.cmap'}\n{runs[1] / 'map.cmap'}"
    assert merged.about["detector"] == CONFIG.detector

    drawn = picture.read_text()
    ElementTree.fromstring(drawn)
    assert "monday</text>" in drawn
    assert "tuesday</text>" in drawn

    rows = [read_trajectory(ways / f"{name}.tum") for name in ("monday", "tuesday")]
    stamps, poses = (np.concatenate(columns) for columns in zip(*rows, strict=True))
    true = true_at(stamps)
    off = between(between(true[0], true), between(poses[0], poses))
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.1  # in one frame

    assert "house.cmap is there already" in failure(*words(*runs, "-o", house))
    assert main(words(*runs[:2], "-o", house, "--overwrite")) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("monday and tuesday: joined by ")
    assert " m of surfaces agree" in said[0]
    assert said[1].startswith(f"{house}: monday, tuesday; 2 drives, ")


@pytest.mark.usefixtures("nothing_alike")
def test_nothing_is_written_where_no_maps_are_joined(
    runs: tuple[Path, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words(runs[0], runs[2], "-o", tmp_path / "house.cmap")) == UNSURE
    said = capsys.readouterr().out
    assert "monday and elsewhere: apart, nothing alike" in said
    assert "elsewhere: stays apart, as it is" in said
    assert "no two maps are joined" in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("nothing_alike")
def test_further_groups_stand_beside_the_largest(
    runs: tuple[Path, ...],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    failure: Failure,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    copies = []
    for n, path in enumerate((runs[2], runs[2], runs[0])):
        copies.append(tmp_path / f"copy{n}.cmap")
        shutil.copy(path / "map.cmap", copies[-1])
    house = tmp_path / "house.cmap"
    assert main(words(runs[0], runs[2], *copies, "-o", house, "--json")) == UNSURE
    told = json.loads(capsys.readouterr().out)
    assert [[part["name"] for part in one["maps"]] for one in told["merged"]] == [
        ["elsewhere", "copy0", "copy1"], ["monday", "copy2"]
    ]  # fmt: skip
    assert [pair["joined"] for pair in told["pairs"]] == [
        set(pair["maps"]) <= {"monday", "copy2"} or not set(pair["maps"]) & {"monday", "copy2"}
        for pair in told["pairs"]
    ]
    assert told["apart"] == []
    for file, path in ((house, runs[2]), (tmp_path / "house-2.cmap", runs[0])):
        one, other = load_map(file).keyframes, load_map(path / "map.cmap").keyframes
        assert one is not None
        assert other is not None
        np.testing.assert_array_equal(one.poses, other.poses)  # a map merged with itself is that map
    house.unlink()
    with monkeypatch.context() as patch:  # before anything is compared
        patch.setattr(find, "find_joint", None)
        assert "house-2.cmap is there already" in failure(*words(runs[0], runs[2], *copies, "-o", house))

    own = tmp_path / "house-4.cmap"  # somebody's own map stays, whatever its name
    for path, map_file in ((tmp_path / "house-3.cmap", tmp_path / "house-2.cmap"), (own, copies[0])):
        shutil.copy(map_file, path)
    assert main(words(runs[2], copies[0], "-o", house, "--overwrite")) == 0
    assert sorted(path.name for path in tmp_path.glob("house*")) == ["house-4.cmap", "house.cmap"]


@pytest.mark.usefixtures("nothing_alike")
def test_ctrl_c_keeps_the_groups_that_are_solved_and_says_which(
    runs: tuple[Path, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    copies, solve, solved = [], merging.merge_group, []
    for n, path in enumerate((runs[0], runs[2])):
        copies.append(tmp_path / f"copy{n}.cmap")
        shutil.copy(path / "map.cmap", copies[-1])

    def stopped(*arguments: Any) -> merging.Merged:
        if solved:
            raise KeyboardInterrupt
        solved.append(arguments)
        return solve(*arguments)

    monkeypatch.setattr(merging, "merge_group", stopped)
    house = tmp_path / "house.cmap"
    assert main(words(runs[0], runs[2], *copies, "-o", house)) == INTERRUPTED
    assert f"interrupted; what was solved until then is in {house}" in capsys.readouterr().err
    assert load_map(house).keyframes is not None
    assert not (tmp_path / "house-2.cmap").exists()


def test_a_folder_that_cannot_be_written_is_told_of_before_anything_is_compared(
    runs: tuple[Path, ...], tmp_path: Path, failure: Failure, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(find, "find_joint", None)
    (tmp_path / "file").touch()
    assert "cannot be made" in failure(*words(*runs, "-o", tmp_path / "file" / "house.cmap"))
    monkeypatch.setattr("os.access", lambda path, mode: False)
    assert "cannot be written" in failure(*words(*runs, "-o", tmp_path / "house.cmap"))


@pytest.mark.usefixtures("nothing_alike")
def test_a_map_that_stands_in_no_folder_of_a_run_has_no_trajectory(
    runs: tuple[Path, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = tmp_path / "copy.cmap"
    shutil.copy(runs[2] / "map.cmap", copy)
    ways = tmp_path / "ways"
    assert main(words(runs[2], copy, "-o", tmp_path / "house.cmap", "--trajectories", ways)) == 0
    assert f"{copy} stands in no folder of a run" in capsys.readouterr().err
    assert [path.name for path in ways.iterdir()] == ["elsewhere.tum"]


def test_what_cannot_be_meant_is_refused_in_one_line(runs: tuple[Path, ...], tmp_path: Path, failure: Failure) -> None:
    house = ("-o", tmp_path / "house.cmap")
    assert "name two or more" in failure(*words(runs[0], *house))
    assert "is given twice" in failure(*words(runs[0], runs[0] / "map.cmap", *house))
    assert "is one of the maps itself" in failure(*words(*runs, "-o", runs[0] / "map.cmap", "--overwrite"))
    assert "the picture is a .svg file" in failure(*words(*runs, *house, "--picture", "house.bmp"))
    (tmp_path / "recording").mkdir()
    assert "recording: holds no map.cmap" in failure(*words(runs[0], tmp_path / "recording", *house))
    (tmp_path / "recording" / "metadata.yaml").touch()
    assert "is a recording; map it first" in failure(*words(runs[0], tmp_path / "recording", *house))
    assert "is a folder; name a file" in failure(*words(*runs, "-o", tmp_path / "recording", "--overwrite"))
    again = failure(*words(*runs, *house, "--trajectories", tmp_path / "recording"))
    assert "choose another folder with --trajectories" in again


def test_a_map_that_cannot_be_joined_is_named(runs: tuple[Path, ...], tmp_path: Path, failure: Failure) -> None:
    house, poor = ("-o", tmp_path / "house.cmap"), tmp_path / "poor.cmap"
    whole = load_map(runs[0] / "map.cmap")
    save_map(poor, SavedMap(whole.corners, whole.walls))
    assert failure(*words(runs[1], poor, *house)).endswith(
        f"{poor}: the map cannot be joined to others: it holds no keyframes, or not what binds them; "
        "map anew with --back-end graph"
    )
    save_map(poor, replace(whole, relations=None))
    assert "it holds no keyframes, or not what binds them" in failure(*words(runs[1], poor, *house))
    poor.write_bytes((runs[0] / "map.cmap").read_bytes()[:-100])
    assert f"{poor}: damaged in its section" in failure(*words(runs[1], poor, *house))
    assert not (tmp_path / "house.cmap").exists()


def test_a_joint_that_contradicts_surer_ones_is_told() -> None:
    evidence = Evidence(2, 3, 31.25, 0.015, 8.0, 0.4)
    found = Joint(np.zeros(3), (), evidence, "search")
    left = LeftOut((0, 1), np.array([3.0, -4.0, 0.1]), np.array([0.3, 0.4, 0.01]))
    said = str(Verdict(("a", "b"), found, left))
    assert said == (
        "a and b: left out, 5.00 m off what surer joints say (σ 0.50 m): 2 corners, 3 walls, 31.2 m of surfaces agree, "
        "1.5% contradicted, 8.0 m of way, best rival 40%"
    )
    told = Verdict(("a", "b"), found, left).as_json()
    assert (told["joined"], told["reason"]) == (False, "contradicts others")
    best = str(Verdict(("a", "b"), Apart("ambiguous", found), None))
    assert best.startswith("a and b: apart, ambiguous: at best 2 corners")
