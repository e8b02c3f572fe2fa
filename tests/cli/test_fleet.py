"""``contourslam fleet``."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from contourslam.cli.entry import main
from contourslam.cli.locate import UNSURE
from contourslam.maps import load_map
from contourslam.recordings import read_trajectory, write_recording
from contourslam.report import fleet_folder
from contourslam.report.svg.colours import BLUE
from contourslam.scan import evenly_spaced


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Recordings of two robots in one room, 40 s."""
    folder = tmp_path_factory.mktemp("fleet") / "room"
    told = ["simulate", "--room", "furnished_room", "--robots", "2", "--gliding", "--duration", "40"]
    assert main([*told, "-o", str(folder)]) == 0
    return [str(folder / "robot1"), str(folder / "robot2")]


def leave_another_fleet(folder: Path) -> set[str]:
    """What stands in a folder: some of it of a fleet that was written there before."""
    folder.mkdir()
    (folder / "metrics.json").write_text(json.dumps({"robots": [{"name": "robot9"}, {"name": "../robot8"}]}))
    (folder.parent / "robot8.tum").touch()
    names = {"common9.cmap", "common9.svg", "common_room.svg", "robot9.tum", "robot9_online.tum", "mine.tum"}
    for name in names:
        (folder / name).touch()
    return names


def test_a_fleet_leaves_the_common_map_each_way_in_it_and_why_it_was_joined(
    robots: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = leave_another_fleet(tmp_path / "out")
    bad_air = ["--loss", "0.1", "--delay", "1", "--repeat", "0.1", "--restart-server", "20", "--restart-robot", "500"]
    assert main(["fleet", *robots, "-o", str(tmp_path / "out"), "--overwrite", "--json", *bad_air]) == 0
    said = capsys.readouterr()
    assert "--restart-robot 500: the first robot's recording had ended by then" in said.err
    told = json.loads(said.out)
    assert (told["server_restarts"], told["robots"][0]["restarts"]) == (1, 0)
    assert before & {path.name for path in (tmp_path / "out").iterdir()} == {"common_room.svg", "mine.tum"}
    assert (tmp_path / "robot8.tum").exists()
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


def test_what_cannot_be_meant_is_refused_before_anything_is_played(
    robots: list[str], tmp_path: Path, failure: Callable[..., str]
) -> None:
    assert "two recordings" in failure("fleet", robots[0], "-o", str(tmp_path))
    for option in ("--restart-robot", "--restart-server"):
        for after in ("0", "-3", "nan", "inf"):
            said = failure("fleet", *robots, "-o", str(tmp_path / "out"), option, after)
            assert f"{option} {after}: a program begins anew" in said
    assert "choose another folder" in failure("fleet", *robots, "-o", robots[1], "--overwrite")
    assert not (tmp_path / "out").exists()


def halved(recording: str, to: Path, part: float = 0.5) -> str:
    """A recording of which the end is missing."""
    shutil.copytree(recording, to)
    (file,) = to.glob("*.mcap")
    content = file.read_bytes()
    file.write_bytes(content[: int(part * len(content))])
    return str(to)


def test_a_robot_whose_recording_is_damaged_stops_there_and_the_others_go_on(
    robots: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = halved(robots[1], tmp_path / "cut")
    assert main(["fleet", robots[0], cut, "-o", str(tmp_path / "out"), "--json"]) == 1
    said = capsys.readouterr()
    told = json.loads(said.out)
    whole, half = told["robots"]
    assert (whole["scans"], whole["damage"]) == (400, "")
    assert 0 < half["scans"] < 400
    assert not told["complete"]
    page = (tmp_path / "out" / "index.html").read_text()
    for text in (said.err, page):
        assert "cut.mcap" in text or "robot2.mcap" in text
    assert f"Incomplete: cut stopped after {half['scans']} scans" in page
    assert f"the {half['scans']} scans before it are in" in said.err


def test_a_recording_of_which_nothing_can_be_read_is_refused_before_anything_is_written(
    robots: list[str], tmp_path: Path, failure: Callable[..., str]
) -> None:
    nothing = halved(robots[1], tmp_path / "cut", 0.001)
    assert "cut" in failure("fleet", robots[0], nothing, "-o", tmp_path / "out")
    assert "is given twice" in failure("fleet", robots[0], robots[0], "-o", tmp_path / "out")
    folder = Path(robots[0]).parent
    said = failure("fleet", folder, "-o", tmp_path / "out")
    assert f"a folder of 2; name them: contourslam fleet {' '.join(robots)} -o {tmp_path / 'out'}" in said
    assert not (tmp_path / "out").exists()


def test_why_common_maps_stay_apart_and_what_the_recordings_lack_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, far in (("one", 2.0), ("two", 4.0)):
        beams = np.linspace(far, far + 1.0, 90)
        scans = [
            evenly_spaced(0.1 * k, beams, angle_min=-1.5, angle_increment=1 / 30, range_min=0.1, range_max=10.0)
            for k in range(3)
        ]
        write_recording(tmp_path / name, scans)
    asked = ["fleet", str(tmp_path / "one"), str(tmp_path / "two"), "-o", str(tmp_path / "out")]
    assert main(asked) == UNSURE
    said = capsys.readouterr()
    assert "common1 (one) and common2 (two) stay apart, nothing alike" in said.out
    assert all(f"{name}: " in said.err for name in ("one", "two"))
    assert said.err.count("the scans alone must do") == 2
    (apart,) = json.loads((tmp_path / "out" / "metrics.json").read_text())["apart"]
    assert apart == {"maps": [1, 2], "reason": "nothing alike", "best": None}
    page = (tmp_path / "out" / "index.html").read_text()
    assert all(word in page for word in ("Who stays apart, and why", "nothing alike", "hold no true poses"))
    assert "root mean squares" not in page
    drawn = [(tmp_path / "out" / f"common{number}.svg").read_text() for number in (1, 2)]
    assert BLUE in drawn[0] and BLUE not in drawn[1]  # a colour is one robot's on the whole page


def test_a_page_shows_the_faults_that_there_were_and_no_word_where_there_were_none() -> None:
    fault = {"robot": "robot1", "run": 255, "text": "keyframe 7 comes after <keyframe> 5"}
    section = fleet_folder._faults([fault])
    assert section is not None
    assert all(word in str(section) for word in ("robot1", "ff", "comes after &lt;keyframe&gt; 5"))
    assert fleet_folder._faults([]) is None
