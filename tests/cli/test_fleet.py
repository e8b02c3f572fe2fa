"""``contourslam fleet``."""

import json
from pathlib import Path

import pytest

from contourslam.cli.entry import main
from contourslam.maps import load_map
from contourslam.recordings import read_trajectory


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Recordings of two robots in one room, 40 s."""
    folder = tmp_path_factory.mktemp("fleet") / "room"
    told = ["simulate", "--room", "furnished_room", "--robots", "2", "--gliding", "--duration", "40"]
    assert main([*told, "-o", str(folder)]) == 0
    return [str(folder / "robot1"), str(folder / "robot2")]


def test_a_fleet_leaves_the_common_map_each_way_in_it_and_why_it_was_joined(
    robots: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad_air = ["--loss", "0.1", "--delay", "1", "--repeat", "0.1", "--restart-server", "20"]
    assert main(["fleet", *robots, "-o", str(tmp_path / "out"), "--json", *bad_air]) == 0
    told = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "out" / "metrics.json").read_text()) == told
    (event,) = told["joined"]
    assert event["agreeing"] > 10.0
    (common,) = told["maps"]
    assert common["members"] == ["robot1", "robot2"]
    saved = load_map(tmp_path / "out" / f"common{common['common']}.cmap")
    assert saved.keyframes is not None
    assert len(saved.keyframes) == common["keyframes"]
    for robot in told["robots"]:
        assert robot["rmse"] < 0.02 < robot["odometry_rmse"]
        stamps, _ = read_trajectory(tmp_path / "out" / f"{robot['name']}.tum")
        assert len(stamps) == robot["scans"]
    page = (tmp_path / "out" / "index.html").read_text()
    assert all(name in page for name in ("robot1", "robot2", "Joints and their evidence"))


def test_a_fleet_of_one_is_refused(robots: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fleet", robots[0], "-o", str(tmp_path)]) == 1
    assert "two recordings" in capsys.readouterr().err
