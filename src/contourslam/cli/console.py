"""What the commands say: results on standard output, everything about the work itself on standard error."""

import os
import shlex
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self, TextIO, TypeVar

from contourslam.errors import ConfigError, ResultError
from contourslam.nearest import no_such

T = TypeVar("T")


def colour_wanted(stream: TextIO) -> bool:
    """Whether colour may be written: on a terminal, and not where NO_COLOR is set (no-color.org)."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def note(text: str) -> None:
    """Say something about the work."""
    print(f"contourslam: {text}", file=sys.stderr, flush=True)


def complain(text: str) -> None:
    """Say that the work failed; red on a terminal."""
    word = "\x1b[31merror:\x1b[0m" if colour_wanted(sys.stderr) else "error:"
    print(f"contourslam: {word} {text}", file=sys.stderr, flush=True)


def print_json(values: dict[str, Any]) -> None:
    """Print a result for a script."""
    from contourslam.report.result_folder import to_json

    print(to_json(values), end="")


def progress(items: Iterable[T], what: str, total: int | None = None) -> Iterator[T]:
    """Pass the items on and draw a bar on a terminal, once the work has taken a second.

    Parameters
    ----------
    items : iterable
        What is worked through.
    what : str
        Name of one item, such as ``"scan"``.
    total : int, optional
        How many there are, where known.
    """
    from tqdm import tqdm

    yield from tqdm(items, total=total, unit=f" {what}", delay=1.0, disable=None, leave=False, ascii=_ascii())


def _ascii() -> bool | None:
    return None if "utf" in (sys.stderr.encoding or "").lower() else True


class Bar:
    """A bar for work that tells its own fraction, drawn on a terminal once the work has taken a second."""

    def __init__(self, what: str) -> None:
        from tqdm import tqdm

        form = "{desc}: {percentage:3.0f}% |{bar}| {elapsed}"
        self._bar = tqdm(desc=what, total=1.0, bar_format=form, delay=1.0, disable=None, leave=False, ascii=_ascii())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()

    def to(self, fraction: float) -> None:
        """Draw the bar up to a fraction between 0 and 1."""
        self._bar.update(fraction - self._bar.n)


def chosen(kind: str, name: str, choices: Mapping[str, T]) -> T:
    """Look a name up; where it is unknown, say which there are.

    Raises
    ------
    ConfigError
        If the name is unknown.
    """
    if name not in choices:
        raise ConfigError(no_such(kind, name, choices))
    return choices[name]


def prepare_folder(folder: Path, *, overwrite: bool, option: str = "--output") -> None:
    """Make the output folder; one that holds something is refused, so that no result is lost by a repeated command.

    Raises
    ------
    ResultError
        If the folder holds files and `overwrite` is off, or it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        used = any(folder.iterdir())
    except OSError as error:
        raise ResultError(f"{folder}: cannot be used as output folder ({error.strerror or error})") from error
    if used and not overwrite:
        raise ResultError(f"{folder} is not empty; choose another folder with {option}, or replace with --overwrite")


def unused_folder(path: Path, what: str) -> str:
    """Name an output folder that does not exist yet, for what is made of a recording, as a shell has it."""
    name, number = f"{path.resolve().name.partition('.')[0]}-{what}", 1
    folder = Path("out") / name
    while folder.exists():
        number += 1
        folder = folder.with_name(f"{name}-{number}")
    return shlex.quote(str(folder))


def keep_apart(output: Path, folders: Iterable[Path]) -> None:
    """Refuse to write into a folder that is read.

    Raises
    ------
    ConfigError
        If the output folder is one of the others.
    """
    if output.resolve() in [folder.resolve() for folder in folders]:
        raise ConfigError(f"{output} is one of the runs itself; choose another folder with --output")


def make_way(path: Path, *, overwrite: bool) -> None:
    """Remove a file or a rosbag2 folder that is to be written anew.

    Raises
    ------
    ResultError
        If it is there and `overwrite` is off, or it is a folder of something else.
    """
    if not path.exists():
        return
    if not overwrite:
        raise ResultError(f"{path} is there already; choose another name, or replace it with --overwrite")
    if not path.is_dir():
        return  # replaced as a whole once the new one is written
    if not (path / "metadata.yaml").is_file():
        raise ResultError(f"{path} is a folder, and no recording; choose another name")
    shutil.rmtree(path)
