"""The file that says what is swept: read, checked, and told precisely where it is wrong."""

import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from contourslam.config import Config
from contourslam.detectors import DETECTORS
from contourslam.errors import ConfigError
from contourslam.nearest import no_such, perhaps, unreadable
from contourslam.settings_file import build
from contourslam.simulation.config import LIDARS
from contourslam.simulation.rooms import ROOMS

_FILE = ("name", "detectors", "own_detectors", "simulation", "recordings", "settings", "sweep")
_EMPTY = "is empty; leave it out, or name something"
_SIMULATION = ("rooms", "noise", "beams", "seeds", "lidar", "duration", "speed")
_RECORDINGS = ("paths", "relations")
MOST_RUNS = 1_000_000
"""More are a slip of the pen."""
_PLAIN = {"default": {}}  # type: dict[str, dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Grid:
    """Every combination of these.

    Attributes
    ----------
    detectors, settings : tuple of str
    recordings : tuple of str
        Paths, URLs and patterns.
    rooms : tuple of str
    noise : tuple of float or None
        m; None for the lidar's own.
    beams : tuple of int or None
    seeds : tuple of int
    lidar : tuple of str
    duration : tuple of float or None
        s; None for two laps, at least 180 s.
    speed : tuple of float
        m/s.
    """

    detectors: tuple[str, ...] = tuple(DETECTORS)
    settings: tuple[str, ...] = ("default",)
    recordings: tuple[str, ...] = ()
    rooms: tuple[str, ...] = ()
    noise: tuple[float | None, ...] = (None,)
    beams: tuple[int | None, ...] = (None,)
    seeds: tuple[int, ...] = (0,)
    lidar: tuple[str, ...] = ("paper",)
    duration: tuple[float | None, ...] = (None,)
    speed: tuple[float, ...] = (0.4,)


@dataclass(frozen=True, slots=True)
class Experiment:
    """What an experiment file says.

    Attributes
    ----------
    name : str
    text : str
        The file.
    folder : Path
        Where it lies; its relative paths start there.
    grids : tuple of Grid
        One per ``[[sweep]]``; without any, the whole file is one.
    settings : dict
        Name to what differs from the defaults, as ``contourslam.config.Config`` has it.
    own_detectors : dict of str to str
        Name to ``FILE.py:FACTORY`` or ``MODULE:FACTORY``.
    relations : dict of str to str
        Recording's pattern to the file of its known relative poses.
    """

    name: str
    text: str
    folder: Path
    grids: tuple[Grid, ...]
    settings: Mapping[str, dict[str, Any]] = field(default_factory=lambda: dict(_PLAIN))
    own_detectors: Mapping[str, str] = field(default_factory=dict)
    relations: Mapping[str, str] = field(default_factory=dict)


def read_experiment(path: Path) -> Experiment:
    """Read an experiment file (TOML).

    Parameters
    ----------
    path : Path

    Raises
    ------
    ConfigError
        If it is missing or not TOML, or a name or value in it is wrong; the message names file, line and key.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(unreadable(path, error)) from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{path}: is not UTF-8 ({error.reason} at byte {error.start})") from error
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path}: is not TOML ({error})") from error
    try:
        return _experiment(content, text, path.resolve().parent)
    except _WrongError as error:
        line = _line(text, error.table, error.key)
        raise ConfigError(f"{path}{line}: {error.place}{error}") from error


class _WrongError(Exception):
    """Something in the file is wrong; `table` and `key` say where."""

    def __init__(self, table: str, key: str, message: str) -> None:
        super().__init__(message)
        self.table, self.key = table, key

    @property
    def place(self) -> str:
        name = ".".join(part for part in (self.table, self.key) if part)
        return f"{name}: " if name else ""


def _experiment(content: dict[str, Any], text: str, folder: Path) -> Experiment:
    _known(content, _FILE, "")
    if "name" not in content:
        raise _WrongError("", "name", 'is missing; give the experiment one, such as name = "small"')
    name = content["name"]
    if not isinstance(name, str) or not re.fullmatch(r"[\w.-]+", name):
        raise _WrongError("", "name", f"must be a name of letters, digits, - and _, got {name!r}")
    own = _table(content, "own_detectors")
    for label, place in own.items():
        if not isinstance(place, str):
            raise _WrongError("own_detectors", label, f"must be FILE.py:FACTORY or MODULE:FACTORY, got {place!r}")
    settings = {label: _setting(label, given) for label, given in _table(content, "settings").items()} or dict(_PLAIN)
    simulation, recordings = _table(content, "simulation"), _table(content, "recordings")
    _known(simulation, _SIMULATION, "simulation")
    _known(recordings, _RECORDINGS, "recordings")
    relations = recordings.get("relations", {})
    if not isinstance(relations, dict) or not all(isinstance(value, str) for value in relations.values()):
        raise _WrongError("recordings", "relations", "must name the file of relations for each recording")
    read = _Reader(tuple(settings), (*DETECTORS, *own))
    base = Grid(settings=tuple(settings), rooms=tuple(ROOMS) if "simulation" in content else ())
    base = read.grid(base, simulation, "simulation")
    if "detectors" in content:
        base = read.grid(base, {"detectors": content["detectors"]}, "")
    if "paths" in recordings:
        base = replace(base, recordings=read.texts("recordings", "paths", recordings["paths"]))
    for pattern in relations:
        if pattern not in base.recordings:
            raise _WrongError(
                "recordings.relations", pattern, f"is not among the paths{perhaps(pattern, base.recordings)}"
            )
    blocks = content.get("sweep", [{}])
    if not isinstance(blocks, list) or not all(isinstance(block, dict) for block in blocks):
        raise _WrongError("", "sweep", "must be written as [[sweep]], as often as there are grids")
    grids = tuple(read.grid(base, block, "sweep") for block in blocks)
    if not any(grid.rooms or grid.recordings for grid in grids):
        raise _WrongError("", "", "there is nothing to run on: add [simulation] with rooms, or [recordings] with paths")
    if (count := sum(map(_count, grids))) > MOST_RUNS:
        raise _WrongError(
            "", "", f"makes {count} runs, more than {MOST_RUNS}; take some of the axes apart with [[sweep]]"
        )
    return Experiment(name, text, folder, grids, settings, own, relations)


def _count(grid: Grid) -> int:
    """How many runs a grid makes, each pattern of recordings taken for one."""
    axes = (grid.rooms, grid.noise, grid.beams, grid.seeds, grid.lidar, grid.duration, grid.speed)
    return (math.prod(map(len, axes)) + len(grid.recordings)) * len(grid.detectors) * len(grid.settings)


def _known(table: Mapping[str, Any], names: tuple[str, ...], place: str) -> None:
    for key in table:
        if key not in names:
            raise _WrongError(place, key, f"is unknown{perhaps(key, names) or '; known here: ' + ', '.join(names)}")


def _table(content: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = content.get(name, {})
    if not isinstance(found, dict):
        raise _WrongError("", name, f"must be a table, [{name}], got {found!r}")
    return found


def _setting(name: str, given: Any) -> dict[str, Any]:
    """Check overrides against the classes of the configuration."""
    place = f"settings.{name}"
    if not isinstance(given, dict):
        raise _WrongError("settings", name, f"must be a table, [{place}], got {given!r}")
    if "detector" in given:
        raise _WrongError(place, "detector", "detectors have a list of their own: detectors = [...]")
    try:
        build(Config, given)
    except ConfigError as error:
        key = re.sub(r"^unknown setting ", "", str(error)).partition(" ")[0].rstrip(";")
        raise _InSettingError(place, key, str(error)) from error
    return given


class _InSettingError(_WrongError):
    @property
    def place(self) -> str:
        return f"{self.table}: "


class _Reader:
    """Turns what stands in the file into the axes of a grid."""

    def __init__(self, settings: tuple[str, ...], detectors: tuple[str, ...]) -> None:
        number = "a number"
        self._axes: dict[str, Callable[[str, str, Any], tuple[Any, ...]]] = {
            "detectors": self._names("detector", detectors),
            "settings": self._names("setting", settings),
            "recordings": self.texts,
            "rooms": self._names("room", tuple(ROOMS)),
            "lidar": self._names("lidar", tuple(LIDARS)),
            "noise": _numbers(f"{number} of metres from 0 on", lambda value: value >= 0),
            "duration": _numbers(f"{number} of seconds from 0.1 on", lambda value: value >= 0.1),
            "speed": _numbers("a speed above 0 and up to 1.5 m/s", lambda value: 0 < value <= 1.5),
            "beams": _numbers("a whole number of at least 10", lambda value: value >= 10, whole=True),
            "seeds": _seeds,
        }

    def grid(self, base: Grid, table: Mapping[str, Any], place: str) -> Grid:
        """Give a grid as `base` but for what a table says."""
        _known(table, tuple(self._axes) if place == "sweep" else (*_SIMULATION, "detectors"), place)
        return replace(base, **{key: self._axes[key](place, key, value) for key, value in table.items()})

    @staticmethod
    def texts(place: str, key: str, value: Any) -> tuple[str, ...]:
        """One text or several."""
        values = _listed(place, key, value)
        if wrong := [each for each in values if not isinstance(each, str)]:
            raise _WrongError(place, key, f"must hold texts, got {wrong[0]!r}")
        return tuple(values)

    def _names(self, kind: str, choices: tuple[str, ...]) -> Callable[[str, str, Any], tuple[str, ...]]:
        def read(place: str, key: str, value: Any) -> tuple[str, ...]:
            names = self.texts(place, key, value)
            for name in names:
                if name not in choices:
                    raise _WrongError(place, key, no_such(kind, name, choices))
            return names

        return read


def _numbers(
    wanted: str, fits: Callable[[Any], bool], *, whole: bool = False
) -> Callable[[str, str, Any], tuple[Any, ...]]:
    def read(place: str, key: str, value: Any) -> tuple[Any, ...]:
        values = _listed(place, key, value)
        for each in values:
            if type(each) not in ((int,) if whole else (int, float)) or not math.isfinite(each) or not fits(each):
                raise _WrongError(place, key, f"must be {wanted}, or a list of such, got {each!r}")
        return tuple(values) if whole else tuple(map(float, values))

    return read


def _seeds(place: str, key: str, value: Any) -> tuple[int, ...]:
    """So many seeds from 0 on, or a list of them."""
    if type(value) is int and value > MOST_RUNS:
        raise _WrongError(place, key, f"are more than {MOST_RUNS} runs, got {value}")
    seeds = list(range(value)) if type(value) is int and value > 0 else value
    if seeds == []:
        raise _WrongError(place, key, _EMPTY)
    if not isinstance(seeds, list) or not all(type(seed) is int and seed >= 0 for seed in seeds):
        raise _WrongError(
            place, key, f"must be how many (seeds 0, 1, 2, ...) or a list of whole numbers, got {value!r}"
        )
    return tuple(dict.fromkeys(seeds))


def _listed(place: str, key: str, value: Any) -> list[Any]:
    values = value if isinstance(value, list) else [value]
    if not values and key not in ("rooms", "recordings", "paths"):
        raise _WrongError(place, key, _EMPTY)
    return list(dict.fromkeys(values)) if all(isinstance(each, str | int | float) for each in values) else values


def _line(text: str, table: str, key: str) -> str:
    """Find the line of a key, as ``", line 7"``; nothing where it cannot be told."""
    current, last = "", key.rpartition(".")[2]
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*\[\[?\s*([^\]]+?)\s*\]", line):
            current = header.group(1).replace('"', "")
            if current in (f"{table}.{key}", key) and not (table and current == key):
                return f", line {number}"
        elif (current == table or current.startswith(f"{table}.")) and re.match(
            rf'\s*(?:[\w"\'.-]+\.)?["\']?{re.escape(last)}["\']?\s*[=.]', line
        ):
            return f", line {number}"
    return ""
