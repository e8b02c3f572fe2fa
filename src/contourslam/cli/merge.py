"""``contourslam merge``: several maps to one, where they overlap."""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from contourslam.atomic import make_folder, remove
from contourslam.cli.console import Bar, complain, make_way, note, prepare_folder, print_json
from contourslam.cli.interrupt import INTERRUPTED
from contourslam.cli.locate import UNSURE
from contourslam.cli.options import Flag, Json
from contourslam.errors import ConfigError, MapError, ResultError

if TYPE_CHECKING:
    from contourslam.joining.joint import Apart, Joint
    from contourslam.joining.merging import Merged
    from contourslam.maps import SavedMap
    from contourslam.report.joints import Verdict

    Pair = tuple[int, int]

_MAP, _TRAJECTORY = "map.cmap", "trajectory.tum"  # in a result folder


@dataclass(frozen=True)
class Merge:
    """Make one map of several that overlap: of several robots, or of several days. No relative pose need be known.

    Each map is one that `contourslam run` made with the graph: its file, or the folder of the run. Each pair is held
    against each other, and joined only where corners, walls and contours leave no other way of laying one on the other;
    every verdict is told with its evidence. Then all that is joined is solved as one map, in the frame of the map with
    the most keyframes, and what overlaps becomes one. It can be gone on in, localised in and merged again.

    Where some maps stay apart, the largest group becomes the map, further groups stand beside it with -2, -3 in their
    names, maps that join no other stay as they are, and the exit code is 3. Nothing is written where none are joined.
    Each group is written as soon as it is solved, and Ctrl-C keeps it.

    Example: contourslam merge out/monday out/tuesday -o house.cmap --picture house.svg
    """

    maps: tyro.conf.Positional[tuple[Path, ...]]
    """Maps to join: map.cmap files, or folders that `contourslam run` wrote."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"], metavar="MAP")]
    """File of the new map."""
    overwrite: Flag = False
    """Replace the files that are there, and what the folder of --trajectories holds."""
    picture: Annotated[Path | None, tyro.conf.arg(metavar="FILE.svg")] = None
    """Draw the new map, with each map's way in a colour of its own; of further groups with -2, -3 in the name."""
    trajectories: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None
    """Write the trajectories of the runs into this folder, carried into the frame of the new map (TUM)."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Find the joints, solve each group, write the maps and say what was joined and why."""
        from contourslam.report.joints import Verdict

        paths = [_map_in(path) if path.is_dir() else path for path in self.maps]
        names = self._checked(paths)
        maps = [_load(path) for path in paths]
        groups: list[Merged] = []
        told: list[dict[str, Any]] = []

        def keep(group: "Merged") -> None:
            told.append(self._write(group, len(groups), names, paths, maps))
            groups.append(group)

        try:
            found = _verdicts(maps, names)
            _merge(maps, found, keep)
        except KeyboardInterrupt:
            if not told:
                raise
            complain(f"interrupted; what was solved until then is in {', '.join(one['file'] for one in told)}")
            return INTERRUPTED
        if groups:
            self._remove_more(len(groups), paths)
        alone = [name for n, name in enumerate(names) if not any(n in group.members for group in groups)]
        left_out = {left.maps: left for group in groups for left in group.left_out}
        pairs = [Verdict((names[a], names[b]), found[a, b], left_out.get((a, b))) for a, b in found]
        if self.json:
            print_json({"pairs": [pair.as_json() for pair in pairs], "merged": told, "apart": alone})
        else:
            _print(pairs, told, alone, self.output)
        return 0 if len(groups) == 1 and not alone else UNSURE

    def _checked(self, paths: Sequence[Path]) -> list[str]:
        """Refuse what cannot be meant; give the maps short names that tell them apart."""
        from contourslam.report.runs_reading import distinct_names

        if len(paths) < 2:
            raise ConfigError("a map is merged with others: name two or more")
        names = distinct_names([path.parent if path.name == _MAP else path.with_suffix("") for path in paths])
        if self.picture is not None and self.picture.suffix != ".svg":
            raise ConfigError(f"{self.picture}: the picture is a .svg file")
        for number in range(len(paths) // 2):  # as many groups as there may be
            for path in self._files(number):
                if path.resolve() in [each.resolve() for each in paths]:
                    raise ConfigError(f"{path} is one of the maps itself; choose another file with --output")
                if path.is_dir():
                    raise ResultError(f"{path} is a folder; name a file in it or beside it")
                make_way(path, overwrite=self.overwrite)
                make_folder(path.parent)
                if not os.access(path.parent, os.W_OK):
                    raise ResultError(f"{path.parent}: cannot be written; choose another folder")
        if self.trajectories is not None:
            prepare_folder(self.trajectories, overwrite=self.overwrite, option="--trajectories")
        return names

    def _files(self, number: int) -> list[Path]:
        """Files of a group."""
        return [_numbered(path, number) for path in (self.output, self.picture) if path is not None]

    def _remove_more(self, number: int, paths: list[Path]) -> None:
        """Remove the groups from this one on that an earlier merge left: they would not belong to this one."""
        from contourslam.maps import load_map

        inputs = [path.resolve() for path in paths]
        while (file := _numbered(self.output, number)).is_file() and file.resolve() not in inputs:
            try:
                if "merged" not in load_map(file).about:
                    return
            except MapError:
                return
            for path in self._files(number):
                remove(path)
            number += 1

    def _write(
        self, group: "Merged", number: int, names: list[str], paths: list[Path], maps: "list[SavedMap]"
    ) -> dict[str, Any]:
        """Write what was made of a group, and say what it is."""
        from datetime import datetime

        from contourslam import __version__
        from contourslam.atomic import write_text
        from contourslam.joining.building import keyframes_of
        from contourslam.joining.carrying import frame_among
        from contourslam.maps import save_map
        from contourslam.report.svg.merged import merged_drawing

        file, saved, members = _numbered(self.output, number), group.saved, group.members
        about = {
            "contourslam": __version__,
            "made": datetime.now().astimezone().isoformat(timespec="seconds"),
            "merged": "\n".join(str(paths[member]) for member in members),
        }
        save_map(file, replace(saved, about=saved.about | about))
        if self.picture is not None:
            drawn = merged_drawing(saved, [names[member] for member in members], group.keys)
            write_text(_numbered(self.picture, number), drawn.text)
        keyframes, parts = keyframes_of(saved), []
        for member, keys in zip(members, group.keys, strict=True):
            frame, bent = frame_among(keyframes_of(maps[member]).poses, keyframes.poses[keys])
            parts.append({"name": names[member], "file": str(paths[member]), "frame": frame, "bent": bent})
            if self.trajectories is not None:
                target = self.trajectories / f"{names[member].replace('/', '-')}.tum"
                parts[-1]["trajectory"] = _carry(paths[member], maps[member], saved, keys, target)
        return {
            "file": str(file),
            "maps": parts,
            "keyframes": len(keyframes),
            "drives": int(keyframes.drives[-1]) + 1,
            "corners": len(saved.corners.ids),
            "walls": len(saved.walls.ids),
        }


def _numbered(path: Path, number: int) -> Path:
    return path.with_name(f"{path.stem}-{number + 1}{path.suffix}") if number else path


def _map_in(folder: Path) -> Path:
    """Give the map of a run's folder."""
    if not (folder / _MAP).is_file():
        recording = (folder / "metadata.yaml").is_file()
        hint = f"is a recording; map it first: contourslam run {folder} -o FOLDER" if recording else f"holds no {_MAP}"
        raise MapError(f"{folder}: {hint}")
    return folder / _MAP


def _load(path: Path) -> "SavedMap":
    from contourslam.joining.building import keyframes_of
    from contourslam.maps import load_map

    saved = load_map(path)
    try:
        keyframes_of(saved)
    except MapError as error:
        raise MapError(f"{path}: {error}") from error
    return saved


def _verdicts(maps: "list[SavedMap]", names: list[str]) -> "dict[Pair, Joint | Apart | int]":
    """What each pair of maps has to do with each other: of a drive that is in both, the number of its keyframes."""
    from functools import partial
    from itertools import combinations

    from contourslam.joining.building import keyframes_of
    from contourslam.joining.chart import Chart
    from contourslam.joining.find import find_joint
    from contourslam.joining.shared import shared

    known = {pair: len(keys) for pair, (keys, _) in shared([keyframes_of(saved) for saved in maps]).items()}
    charts = [Chart(saved) for saved in maps]
    pairs = list(combinations(range(len(maps)), 2))
    out: dict[Pair, Joint | Apart | int] = {}
    for number, (first, second) in enumerate(pairs, 1):
        if (first, second) in known:
            out[first, second] = known[first, second]
            continue
        which = f" ({number} of {len(pairs)})" if len(pairs) > 1 else ""
        with Bar(f"{names[first]} and {names[second]}{which}") as bar:
            out[first, second] = find_joint(charts[first], charts[second], observer=partial(_draw, bar))
    return out


def _draw(bar: Bar, done: int, count: int) -> None:
    bar.to(done / count)


def _merge(maps: "list[SavedMap]", found: "dict[Pair, Joint | Apart | int]", keep: "Callable[[Merged], None]") -> None:
    """Merge; `keep` gets what was made of several maps as soon as it is."""
    from contourslam.joining.joint import Joint
    from contourslam.joining.merging import merge_maps

    joints = {pair: verdict for pair, verdict in found.items() if isinstance(verdict, Joint)}
    done = 0
    with Bar("solving") as bar:

        def made(merged: "Merged") -> None:
            nonlocal done
            done += len(merged.members)
            bar.to(done / len(maps))
            if len(merged.members) > 1:
                keep(merged)

        merge_maps(maps, joints, observer=made)


def _carry(path: Path, old: "SavedMap", new: "SavedMap", keys: Any, target: Path) -> str | None:
    """Write the trajectory of a run in the frame of the new map; its drive is the last of its map."""
    from contourslam.joining.building import keyframes_of
    from contourslam.joining.carrying import carry
    from contourslam.recordings import read_trajectory, write_trajectory

    source, before, after = path.with_name(_TRAJECTORY), keyframes_of(old), keyframes_of(new)
    if path.name != _MAP or not source.is_file():
        note(f"{path} stands in no folder of a run: there is no trajectory of it")
        return None
    stamps, poses = read_trajectory(source)
    last = before.drives == before.drives[-1]
    carried = carry(stamps, poses, before.stamps[last], before.poses[last], after.poses[keys[last]])
    write_trajectory(target, stamps, carried)
    return str(target)


def _print(pairs: "list[Verdict]", told: list[dict[str, Any]], alone: list[str], output: Path) -> None:
    for pair in pairs:
        print(pair)
    for one in told:
        names = ", ".join(part["name"] for part in one["maps"])
        print(
            f"{one['file']}: {names}; {one['drives']} drives, {one['keyframes']} keyframes, {one['corners']} corners, "
            f"{one['walls']} walls"
        )
        for part in one["maps"]:
            x, y, turn = part["frame"]
            print(
                f"  {part['name']}: x {x:.2f} m, y {y:.2f} m, {math.degrees(turn):.1f}°, bent by up to "
                f"{part['bent']:.2f} m"
            )
    for name in alone:
        print(f"{name}: stays apart, as it is")
    if not told:
        print(f"no two maps are joined; {output} is not written")
