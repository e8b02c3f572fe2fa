"""Choosing the command, and what becomes of failures; only the chosen command's module is imported."""

import os
import shlex
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import Any, Protocol

from contourslam import __version__
from contourslam.cli.console import colour_wanted, complain
from contourslam.cli.interrupt import INTERRUPTED
from contourslam.errors import ConfigError, ContourslamError
from contourslam.nearest import perhaps

COMMANDS = {
    "simulate": "Simulate a robot in a furnished room and record it.",
    "info": "Say what is in a recording and what is missing to map it.",
    "detect": "Draw one scan: contours, responses, corners and walls.",
    "run": "Map a recording: trajectory, corners, walls.",
    "view": "Map a recording before your eyes, in a browser.",
    "grid": "Render the occupancy grid of a mapped recording.",
    "scene": "Make a 3-D model of a map, coloured from the camera's pictures.",
    "evaluate": "Judge one or more result folders.",
    "compare": "Compare runs, or the landmark detectors, and write the report.",
    "sweep": "Run an experiment of many runs, on every core or a cluster.",
    "sweep-report": "Report what a sweep found, with intervals and paired tests.",
    "figures": "Draw figures of runs for a paper, as SVG and PDF.",
    "merge": "Join maps that overlap into one.",
    "fleet": "Play several robots' recordings to a server that joins them.",
    "localize": "Follow a robot through a recording in a known map.",
    "locate": "Find a robot in a known map from one scan.",
    "world": "Write a simulated room as a world of Gazebo.",
    "lidar": "Look at a YDLidar X4 on a serial port.",
    "base": "Look at the base, an Arduino Mega, on a serial port.",
    "record": "Record the scans of a YDLidar X4.",
    "drive": "Drive the whole robot, map live and record.",
    "robot-in-the-loop": "Let the whole robot drive at real time against simulated devices.",
    "camera": "Look at a camera, and keep pictures of it.",
    "calibrate": "Find out how a robot is built: wheels, the camera's lens and place.",
    "warm-up": "Compile everything before the robot drives.",
    "doctor": "Say what is installed, which devices there are, and whether the mapping works.",
    "completion": "Print what makes a shell complete commands and options.",
}
"""Name of each command with a summary; :func:`command_class` finds what it does."""

_WIDTH = max(map(len, COMMANDS)) + 1
_LIST = "\n".join(f"  {name:<{_WIDTH}}{summary}" for name, summary in COMMANDS.items())
HELP = f"""usage: contourslam COMMAND ...

Map a building as corners and walls from any 2-D lidar, and compare landmark detectors.

commands:
{_LIST}

options:
  -h, --help  show this help message and exit
  --version   print the version and exit

`contourslam COMMAND --help` explains a command, with an example."""

FAILED, WRONG_USAGE = 1, 2


class Command(Protocol):
    """One command with its options."""

    def execute(self, command: str) -> int:
        """Do the work and return the exit code; `command` is the command line, for the record."""
        ...


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments without the program's name; the process's own where left out.

    Returns
    -------
    int
        0 done; 1 a known failure, said in one line on standard error; 2 wrong usage; 130 interrupted, with what
        was done until then kept. An unknown failure keeps its traceback.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    try:
        if arguments[:1] in (["-h"], ["--help"]):
            print(HELP)
            return 0
        if arguments[:1] == ["--version"]:
            print(f"contourslam {__version__}")
            return 0
        try:
            command = parse(arguments)
        except SystemExit as stop:  # from tyro, which has said why
            return stop.code if isinstance(stop.code, int) else WRONG_USAGE
        except ConfigError as error:
            complain(str(error))
            return WRONG_USAGE
        return command.execute(shlex.join(["contourslam", *arguments]))
    except ContourslamError as error:
        complain(str(error))
        return FAILED
    except KeyboardInterrupt:
        complain("interrupted")
        return INTERRUPTED
    except BrokenPipeError:  # the reader of a pipe has seen enough, as in `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED


def command_class(name: str) -> Any:
    """Import the class behind a command: `WarmUp` in the module `warm_up` behind ``warm-up``."""
    words = name.split("-")
    return getattr(import_module(f"contourslam.cli.{'_'.join(words)}"), "".join(word.capitalize() for word in words))


def parse(arguments: Sequence[str]) -> Command:
    """Turn arguments into a command.

    Raises
    ------
    ConfigError
        If there is no such command, a value is out of its range, or the file behind ``--config`` is no configuration.
    SystemExit
        After a command's help was printed, or if its options are wrong.
    """
    name = arguments[0] if arguments else ""
    if name not in COMMANDS:
        wrong = f"there is no command {name!r}{perhaps(name, COMMANDS)}; it" if name else "the command is missing; it"
        raise ConfigError(f"{wrong} must be one of {', '.join(COMMANDS)} (`contourslam --help` explains them)")
    kind = command_class(name)

    import tyro

    if not colour_wanted(sys.stdout):
        tyro._experimental_options["ansi_codes"] = False
    # Options win over the file behind --config, so that must be read before they are.
    default = kind.starting_from(arguments[1:]) if name == "run" else tyro.MISSING_NONPROP
    command: Command = tyro.cli(
        kind,
        prog=f"contourslam {name}",
        args=arguments[1:],
        default=default,
        config=(tyro.conf.OmitArgPrefixes, tyro.conf.DisallowNone),
    )
    return command
