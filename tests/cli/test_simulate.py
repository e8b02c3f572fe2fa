import json
import shlex
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

from contourslam.cli import main
from contourslam.cli.console import Bar
from contourslam.cli.interrupt import INTERRUPTED
from contourslam.cli.locate import UNSURE
from contourslam.recordings import open_recording
from contourslam.scan import LaserScan, TruePose

Failure = Callable[..., str]


def test_a_simulated_recording_can_be_mapped_and_judged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = tmp_path / "room"
    assert main(["simulate", "-o", str(recording), "--duration", "4", "--seed", "3", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["recording"] == str(recording)
    kinds = [type(message) for message in open_recording(recording).messages()]
    assert kinds.count(LaserScan) == said["scans"] >= 38
    assert TruePose in kinds
    assert main(["run", str(recording), "-o", str(tmp_path / "out"), "--json"]) == 0
    metrics = json.loads(capsys.readouterr().out)
    assert metrics["rmse"]["x"] < 0.02
    assert metrics["odometry_rmse"] is not None


def test_the_same_seed_gives_the_same_scans_and_another_seed_others(tmp_path: Path) -> None:
    runs = {}
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert main(["simulate", "-o", str(tmp_path / name), "--duration", "2", "--seed", str(seed)]) == 0
        messages = open_recording(tmp_path / name).messages()
        runs[name] = [message.ranges.tobytes() for message in messages if isinstance(message, LaserScan)]
    assert runs["a"] == runs["b"]
    assert runs["a"] != runs["c"]


def test_the_x4_preset_gives_a_varying_number_of_beams(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "-o", str(tmp_path / "x4"), "--duration", "4", "--lidar", "ydlidar_x4"]
    assert main(arguments) == 0
    capsys.readouterr()
    assert main(["info", str(tmp_path / "x4"), "--json"]) == 0
    fewest, most = json.loads(capsys.readouterr().out)["scans"]["beams"]
    assert fewest < most


def test_an_unknown_room_lists_those_there_are(failure: Failure, tmp_path: Path) -> None:
    said = failure("simulate", "-o", tmp_path / "x", "--room", "kitchen")
    assert "furnished_room, office_corridor, large_hall" in said


def test_an_unknown_lidar_lists_those_there_are(failure: Failure, tmp_path: Path) -> None:
    assert "paper, ydlidar_x4" in failure("simulate", "-o", tmp_path / "x", "--lidar", "sick")


def test_a_recording_that_is_there_is_replaced_only_if_asked(failure: Failure, tmp_path: Path) -> None:
    arguments = ["simulate", "-o", str(tmp_path / "room"), "--duration", "1"]
    assert main(arguments) == 0
    assert "--overwrite" in failure(*arguments)
    assert main([*arguments, "--overwrite"]) == 0


def test_a_folder_that_is_no_recording_is_never_replaced(failure: Failure, tmp_path: Path) -> None:
    (tmp_path / "precious.txt").write_text("mine")
    assert "no recording" in failure("simulate", "-o", tmp_path, "--duration", "1", "--overwrite")
    assert (tmp_path / "precious.txt").read_text() == "mine"


def test_with_a_camera_the_drive_is_the_same_and_pictures_are_in_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("PIL", reason="needs the extra 'camera'")
    arguments = ["simulate", "--duration", "1", "--seed", "2"]
    assert main([*arguments, "-o", str(tmp_path / "plain")]) == 0
    filmed = [*arguments, "-o", str(tmp_path / "filmed"), "--camera", "--camera-rate", "2", "--json"]
    capsys.readouterr()
    if main(filmed) != 0:
        said = capsys.readouterr().err
        assert "MUJOCO_GL" in said
        pytest.skip("no graphics on this machine")
    assert json.loads(capsys.readouterr().out)["pictures"] == 3
    plain, recording = open_recording(tmp_path / "plain"), open_recording(tmp_path / "filmed")
    for one, two in zip(plain.messages(), recording.messages(), strict=True):
        assert one.stamp == two.stamp and type(one) is type(two)
        if isinstance(one, LaserScan):
            assert one.ranges.tobytes() == two.ranges.tobytes()
    assert [picture.stamp for picture in recording.pictures()] == [0.0, 0.5, 1.0]
    seen = recording.camera()
    assert seen is not None and seen[0].field_of_view_deg == 220.0
    assert plain.camera() is None


def test_several_robots_are_recorded_each_by_itself(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["simulate", "-o", str(tmp_path / "fleet"), "--robots", "3", "--duration", "2", "--json"]
    arguments += ["--room", "office_corridor"]
    assert main(arguments) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["recordings"] == [str(tmp_path / "fleet" / f"robot{k}") for k in (1, 2, 3)]
    assert said["complete"] is True and said["seconds"] == 2.0
    for path, scans in zip(said["recordings"], said["scans"], strict=True):
        messages = list(open_recording(Path(path)).messages())
        assert sum(isinstance(m, LaserScan) for m in messages) == scans == 20
    assert main(arguments) == 1
    assert "--overwrite" in capsys.readouterr().err
    assert main([*arguments[:4], "2", *arguments[5:], "--gliding", "--overwrite"]) == 0
    assert sorted(path.name for path in (tmp_path / "fleet").iterdir()) == ["robot1", "robot2"]


@pytest.mark.parametrize(("robots", "command"), [("1", "run"), ("2", "fleet")])
def test_the_command_that_a_simulation_ends_with_works_as_it_stands(
    robots: str, command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    told = ["simulate", "-o", "out/my rooms", "--duration", "2", "--gliding", "--robots", robots]
    for _ in range(2):  # what the first time wrote is no hindrance to the second
        assert main([*told, "--overwrite"]) == 0
        hint = shlex.split(capsys.readouterr().err.splitlines()[-1].rpartition(": ")[2])
        assert hint[:2] == ["contourslam", command]
        assert main(hint[1:]) in (0, UNSURE)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--robots", "0"], "at least one robot, got 0"),
        (["--robots", "-2"], "at least one robot, got -2"),
        (["--robots", "99"], "furnished_room: 99 robots do not fit; "),
        (["--robots", "99"], "a larger building: --room office_building with more --corridors"),
        (["--robots", "2", "--camera"], "--camera takes its pictures with one robot only"),
        (["--corridors", "3"], "--corridors says how large office_building is"),
        (["--corridors", "1", "--room", "office_building"], "corridors must be 2 to 40"),
    ],
)
def test_what_several_robots_cannot_do_is_said_plainly(
    arguments: list[str], said: str, failure: Failure, tmp_path: Path
) -> None:
    assert said in failure("simulate", "-o", tmp_path / "x", *arguments)
    assert not (tmp_path / "x").exists()


def test_ctrl_c_keeps_what_several_robots_have_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def pressed(bar: Bar, fraction: float) -> None:
        if fraction > 0.01:
            signal.raise_signal(signal.SIGINT)
            monkeypatch.undo()

    monkeypatch.setattr(Bar, "to", pressed)
    arguments = ["simulate", "-o", str(tmp_path / "x"), "--robots", "2", "--duration", "60", "--json"]
    assert main(arguments) == INTERRUPTED
    out, err = capsys.readouterr()
    said = json.loads(out)
    assert said["complete"] is False and 0.5 < said["seconds"] < 2.0
    assert "interrupted" in err
    for path, scans in zip(said["recordings"], said["scans"], strict=True):
        assert sum(isinstance(m, LaserScan) for m in open_recording(Path(path)).messages()) == scans > 3
