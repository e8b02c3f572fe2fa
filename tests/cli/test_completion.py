import subprocess
import sys
from pathlib import Path
from shutil import which

import pytest

from contourslam.cli import main
from contourslam.cli.entry import COMMANDS

# What a shell does at Tab, without a terminal: the words of the line in, the offers out.
_TAB = """
source "$1"; shift
function=$(complete -p contourslam | sed 's/.*-F \\([^ ]*\\).*/\\1/')
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); $function
printf '%s\\n' "${COMPREPLY[@]}"
complete -p contourslam >&2
"""


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    done = subprocess.run(
        [sys.executable, "-m", "contourslam", "completion", "bash"], capture_output=True, text=True, check=True
    )
    path = tmp_path_factory.mktemp("completion") / "contourslam"
    path.write_text(done.stdout)
    return path


@pytest.fixture
def tab(script: Path):
    def press(*words: str) -> list[str]:
        command = ["bash", "--norc", "-c", _TAB, "bash", str(script), "contourslam", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        assert "-o default" in done.stderr  # where nothing is offered, the shell completes files
        return done.stdout.split()

    return press


def test_bash_completes_commands_options_and_choices(tab) -> None:
    assert set(tab("")) >= COMMANDS.keys()
    assert tab("ru") == ["run"]
    assert tab("run", "--sigma") == ["--sigma-range"]
    assert set(tab("run", "--back-end", "")) == {"ekf", "graph"}
    assert set(tab("calibrate", "")) >= {"base", "camera", "extrinsics"}
    assert tab("run", "drive.b") == []


@pytest.mark.parametrize("shell", ["bash", "zsh"])
def test_the_script_of_each_shell_is_sound(shell: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", shell]) == 0
    said = capsys.readouterr()
    assert "contourslam" in said.out and said.err == ""
    if which(shell) is not None:
        path = tmp_path / "script"
        path.write_text(said.out)
        assert subprocess.run([shell, "-n", str(path)], check=False).returncode == 0


def test_another_shell_is_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "fish"]) == 2
    assert "bash" in capsys.readouterr().err
