"""``contourslam scene``: what it needs is said, and what it writes is whole."""

import json
from importlib import import_module

import numpy as np
import pytest

from contourslam.atomic import write_text
from contourslam.cli import main
from contourslam.geometry.fisheye import FisheyeModel
from contourslam.maps import SavedMap, save_map
from contourslam.recordings import write_recording
from contourslam.recordings.picture import Picture
from contourslam.recordings.png import encode_png
from contourslam.recordings.trajectories import write_trajectory
from contourslam.report.map_files import write_geojson
from contourslam.report.page.markup import Section, page
from contourslam.robot.config import CameraPart, RobotConfig, save_robot
from contourslam.scan import LaserScan, Odometry
from contourslam.slam.landmark_map import CornerMap, WallMap

MODEL = FisheyeModel(64, 64, 1.2, 32.0, 32.0, 0.0, 31.5, 31.5)
PLACE = CameraPart(MODEL, z=0.4).T_base_camera
STAMPS = np.arange(0.0, 6.0, 0.1)
POSES = np.column_stack([1.0 + 0.3 * STAMPS, np.full(60, 1.5), 0.2 * STAMPS])


def square_map():
    corners = np.array([[0, 0], [4, 0], [4, 3], [0, 3.0]])
    ends = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)  # from the right to the left as seen from inside
    ones, zero, none = np.ones(4, np.int64), np.zeros((4, 2, 2)), np.zeros(0)
    normals = np.array([-np.pi / 2, 0.0, np.pi / 2, np.pi])
    walls = WallMap(np.arange(4), ends, np.zeros((4, 2, 2, 2)), normals, zero, ones, ones)
    ints = np.zeros(0, np.int64)
    return SavedMap(
        CornerMap(ints, np.zeros((0, 2)), np.zeros((0, 2, 2)), none, none, np.zeros(0, bool), ints, ints), walls,
        about={"recordings": "drive"},
    )  # fmt: skip


def pictures():
    rng = np.random.default_rng(1)
    return [Picture(float(t), encode_png(rng.integers(0, 255, (64, 64, 3), np.uint8)), "png") for t in STAMPS[5::10]]


def recording_of(path, messages, camera=None):
    odometry = [Odometry(float(t), pose) for t, pose in zip(STAMPS, POSES, strict=True)]
    scan = LaserScan(0.05, np.array([0.0, 1.0]), np.array([2.0, 2.0]), np.zeros(2), 0.1, 10.0)
    write_recording(path, sorted([*odometry, scan, *messages], key=lambda m: m.stamp), camera=camera)
    return path


@pytest.fixture
def result(tmp_path):
    """A result folder and, beside it, the recording with pictures that it was made from."""
    recording = recording_of(tmp_path / "drive", pictures(), (MODEL, PLACE))
    folder = tmp_path / "result"
    saved = square_map()
    save_map(folder / "map.cmap", saved)
    write_trajectory(folder / "trajectory.tum", STAMPS, POSES)
    write_geojson(folder / "map.geojson", saved.corners, saved.walls)
    write_text(folder / "metrics.json", json.dumps({"command": f"contourslam run {recording} -o result"}))
    parts = [Section("map", "Map", "<p>m</p>"), Section("reproduce", "Reproduce", "<p>r</p>")]
    write_text(folder / "index.html", page("a run", lead="", sections=parts, footer=""))
    return folder


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch):
    preview = import_module("contourslam.scene.preview")
    monkeypatch.setattr(preview, "_WIDTH", 200)
    monkeypatch.setattr(preview, "_HEIGHT", 130)


OPTIONS = ("--texel", "0.1", "--given-heights", "--height", "2")


def test_the_scene_of_a_run_is_in_its_folder_and_on_its_page(result, capsys):
    assert main(["scene", str(result), *OPTIONS, "--json"]) == 0
    about = json.loads(capsys.readouterr().out)
    assert about["walls"] == 4 and about["pictures"]["used"] == 6
    assert (result / "scene" / "scene.glb").read_bytes()[:4] == b"glTF"
    text = (result / "index.html").read_text()
    assert text.count('id="scene"') == text.count('href="#scene"') == 1
    assert "scene/preview.png" in text and text.index('id="map"') < text.index('id="scene"') < text.index('id="repro')
    assert main(["scene", str(result), *OPTIONS]) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert main(["scene", str(result), *OPTIONS, "--overwrite"]) == 0
    said = capsys.readouterr().out
    assert "4 walls" in said and "6 of 6 used" in said
    assert (result / "index.html").read_text().count('id="scene"') == 1


def test_the_recording_of_a_drive_is_found_in_its_own_folder(result):
    (result.parent / "drive").rename(result / "recording")
    write_text(result / "metrics.json", json.dumps({"command": f"contourslam drive -o {result} --keys"}))
    assert main(["scene", str(result), *OPTIONS]) == 0


def test_a_folder_without_a_kept_map_gives_its_walls(result):
    (result / "map.cmap").unlink()
    assert main(["scene", str(result), *OPTIONS]) == 0


@pytest.mark.parametrize(
    ("camera", "with_pictures", "said"),
    [(None, True, "--robot"), ((MODEL, PLACE), False, "holds no pictures"), (None, False, "holds no pictures")],
    ids=["no lens", "no pictures", "neither"],
)
def test_what_a_recording_lacks_is_said_with_the_topics_that_it_has(
    result, tmp_path, capsys, camera, with_pictures, said
):
    recording = recording_of(tmp_path / "other", pictures() if with_pictures else [], camera)
    assert main(["scene", str(result), "--recording", str(recording), *OPTIONS]) == 1
    error = capsys.readouterr().err
    assert said in error and "/odom (nav_msgs/msg/Odometry)" in error
    assert not (result / "scene").exists()


def test_the_camera_may_come_from_the_robot_s_file(result, tmp_path):
    recording = recording_of(tmp_path / "other", pictures())
    save_robot(tmp_path / "robot.yaml", RobotConfig(camera=CameraPart(MODEL, z=0.4)))
    options = ["--recording", str(recording), "--robot", str(tmp_path / "robot.yaml"), *OPTIONS]
    assert main(["scene", str(result), *options]) == 0


def test_what_is_missing_or_wrong_is_one_line(result, tmp_path, capsys):
    save_robot(tmp_path / "blind.yaml", RobotConfig())
    wrong = {
        (str(tmp_path / "nowhere"),): "there is no such result folder",
        (str(result), "--height", "0"): "--height must lie between",
        (str(result), "--texel", "9"): "--texel must lie between",
        (str(result), "--max-pictures", "1"): "--max-pictures must be 2 or more",
        (str(result), "--robot", str(tmp_path / "blind.yaml")): "names no camera",
    }
    for arguments, said in wrong.items():
        assert main(["scene", *arguments]) == 1
        assert said in capsys.readouterr().err
    (tmp_path / "drive").rename(tmp_path / "moved")
    assert main(["scene", str(result)]) == 1
    assert "made from (drive) is not found; name it with --recording" in capsys.readouterr().err


def test_pictures_of_another_drive_are_an_error(result, tmp_path, capsys):
    write_trajectory(result / "trajectory.tum", STAMPS + 1000.0, POSES)
    assert main(["scene", str(result), *OPTIONS]) == 1
    assert "is it another recording's?" in capsys.readouterr().err


def test_ctrl_c_leaves_nothing_half_written(result, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(import_module("contourslam.scene.preview"), "_panels", interrupted)
    assert main(["scene", str(result), *OPTIONS]) == 130
    assert not list((result / "scene").iterdir())
    assert 'id="scene"' not in (result / "index.html").read_text()
