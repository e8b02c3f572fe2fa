"""The systemd unit says what the documents promise; systemd itself reads it where it is installed."""

import configparser
import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from contourslam.cli.entry import parse
from contourslam.cli.warm_up import WarmUp

ROOT = Path(__file__).parents[2]
UNIT = ROOT / "deploy" / "contourslam.service"
NAME = "contourslam"


@pytest.fixture(scope="module")
def lines() -> dict[str, list[str]]:
    """Values by key, of which some are there more than once; continued lines are one."""
    found: dict[str, list[str]] = {}
    for line in UNIT.read_text().replace("\\\n", " ").splitlines():
        if line and line[0] not in "#[":
            key, value = line.split("=", 1)
            found.setdefault(key, []).append(value)
    return found


def script(lines: dict[str, list[str]], key: str) -> str:
    program, option, text = shlex.split(lines[key][0])
    assert (program, option) == ("/bin/bash", "-c")
    return text


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze, of systemd")
def test_systemd_takes_the_unit_without_a_word() -> None:
    done = subprocess.run(["systemd-analyze", "verify", str(UNIT)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


def test_the_unit_has_its_three_sections() -> None:
    parser = configparser.RawConfigParser(strict=False)
    parser.read(UNIT)
    assert parser.sections() == ["Unit", "Service", "Install"]


def test_the_service_is_warm_before_it_starts_and_starts_again_when_it_ends(lines: dict[str, list[str]]) -> None:
    words = shlex.split(script(lines, "ExecStartPre"))
    assert words[:2] == ["exec", f"/opt/{NAME}/venv/bin/contourslam"]
    assert isinstance(parse(words[2:]), WarmUp)
    assert lines["Restart"] == ["always"]
    assert lines["KillSignal"] == ["SIGINT"]  # on which a node saves its map


def test_what_is_compiled_and_kept_can_be_written_and_nothing_else(lines: dict[str, list[str]]) -> None:
    environment = dict(word.split("=", 1) for line in lines["Environment"] for word in line.split())
    places = {"CacheDirectory": "/var/cache", "StateDirectory": "/var/lib", "LogsDirectory": "/var/log"}
    writable = [f"{place}/{lines[key][0]}" for key, place in places.items()]
    assert [environment[name] for name in ("NUMBA_CACHE_DIR", "HOME", "ROS_LOG_DIR")] == writable
    assert lines["ProtectSystem"] == ["strict"]
    assert "ReadWritePaths" not in lines
    assert lines["User"] == [NAME]
    # Compiled kernels are written into memory, then run.
    assert "MemoryDenyWriteExecute" not in lines


def test_the_start_script_gives_ros_its_launch_file_and_contourslam_to_its_python(
    lines: dict[str, list[str]], tmp_path: Path
) -> None:
    site = tmp_path / "opt" / NAME / "venv" / "lib" / "python3.12" / "site-packages"
    site.mkdir(parents=True)
    for setup in ("ros/jazzy", f"{NAME}/install"):
        folder = tmp_path / "opt" / setup
        folder.mkdir(parents=True)
        (folder / "setup.bash").write_text(f"SEEN=$SEEN:{setup}\nexport SEEN\n")
    ros2 = tmp_path / "bin" / "ros2"
    ros2.parent.mkdir()
    ros2.write_text('#!/bin/bash\necho "$SEEN|$PYTHONPATH|$*"\n')
    ros2.chmod(0o755)
    text = script(lines, "ExecStart").replace("/opt/", f"{tmp_path}/opt/")
    # systemd fills in ${NAME} inside a word and leaves $NAME to the shell.
    assert not re.search(r"\$\{", text)
    environment = {
        "PATH": f"{ros2.parent}:{os.environ['PATH']}",
        "ROS_DISTRO": "jazzy",
        "PYTHONPATH": "/ros",
        "CONTOURSLAM_LAUNCH": "mapping.launch.py map_file:=/var/lib/contourslam/house.map",
    }
    done = subprocess.run(["bash", "-c", text], capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.strip().split("|") == [
        f":ros/jazzy:{NAME}/install",
        f"{site}:/ros",
        "launch contourslam_ros mapping.launch.py map_file:=/var/lib/contourslam/house.map",
    ]
