import os
import shlex
import subprocess
import sys

import pytest

from contourslam import __version__
from contourslam.cli import main
from contourslam.cli.entry import COMMANDS, command_class, parse

HEAVY = ("numpy", "numba", "scipy", "matplotlib", "mujoco", "rosbags", "ruamel.yaml", "evo", "shapely")


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from contourslam.cli import main\n"
        f"for words in {[['--help'], *([name, '--help'] for name in COMMANDS)]}:\n"
        "    main(words)\n"
        f"    print('loaded', words[0], *({{*{HEAVY}}} & {{*sys.modules}}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = [line.split() for line in done.stdout.splitlines() if line.startswith("loaded ")]
    assert loaded == [["loaded", name] for name in ("--help", *COMMANDS)]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself_with_an_example_that_parses(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([name, "--help"]) == 0
    text = capsys.readouterr().out
    assert "(default:" in text or "usage: contourslam calibrate [-h] {" in text  # a group's commands have their own
    example = next(line for line in text.splitlines() if line.startswith("Example: "))
    words = shlex.split(example.removeprefix("Example: "))
    assert words[:2] == ["contourslam", name]
    assert type(parse(words[1:])) is command_class(name)


def test_the_list_of_commands_has_all_of_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    listed = [line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    for name, summary in COMMANDS.items():
        assert [name, summary] in listed
        assert command_class(name)


def test_version_is_the_packages(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"contourslam {__version__}\n"


def test_the_module_is_the_command_line_too() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "contourslam", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"contourslam {__version__}\n"


def test_no_colour_is_written_to_a_pipe() -> None:
    environment = os.environ | {"TERM": "xterm-256color"}
    done = subprocess.run(
        [sys.executable, "-m", "contourslam", "run", "--help"], capture_output=True, check=True, env=environment
    )
    assert b"\x1b" not in done.stdout
