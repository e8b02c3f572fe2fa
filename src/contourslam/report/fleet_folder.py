"""The folder of a fleet that was played: trajectories, common maps, metrics and a page about all of it."""

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from contourslam import __version__
from contourslam.atomic import make_folder, remove, write_text
from contourslam.display import metres
from contourslam.fleet.play import Fleet
from contourslam.fleet.play_apart import KeptApart
from contourslam.fleet.shared import Shared
from contourslam.fleet.wire import NAME
from contourslam.maps import save_map
from contourslam.recordings import write_trajectory
from contourslam.report.fleet_metrics import fleet_metrics, home
from contourslam.report.joints import apart_in_words
from contourslam.report.page import album
from contourslam.report.page.markup import Cell, Row, Section, page, paragraph, table, tiles, verbatim
from contourslam.report.result_folder import to_json
from contourslam.report.svg.drawing import Drawing
from contourslam.report.svg.merged import merged_drawing

_ERRORS = "rmse", "online_rmse", "odometry_rmse"


def map_file(shared: Shared) -> str:
    """Name of a common map's file."""
    return f"common{shared.number}.cmap"


def write_fleet_folder(
    folder: Path, fleet: Fleet, apart: Sequence[KeptApart] = (), *, command: str = ""
) -> dict[str, Any]:
    """Write what came of a fleet, and give its metrics.

    The folder gets index.html, metrics.json, a map (commonN.cmap) and a picture (commonN.svg) of each common map, and
    of each robot NAME.tum, its poses at the end in the common map that it ended in, and NAME_online.tum, as it knew
    them at the time. What an earlier fleet left there under such names is removed.

    Parameters
    ----------
    folder : Path
        Made where needed.
    fleet : Fleet
    apart : sequence of KeptApart
        Why common maps are two.
    command : str
        The command line, shown as it stands.

    Returns
    -------
    dict
        See :func:`contourslam.report.fleet_metrics.fleet_metrics`.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    make_folder(folder)
    _clear(folder)
    metrics = fleet_metrics(fleet, apart)
    numbers = {robot.name: number for number, robot in enumerate(fleet.robots)}
    about = {"contourslam": __version__, "command": command}
    drawings = []
    for shared in fleet.maps:
        save_map(folder / map_file(shared), replace(shared.saved, about=shared.saved.about | about))
        drawings.append(_drawing(shared, numbers))
        write_text(folder / map_file(shared).replace(".cmap", ".svg"), drawings[-1].text)
    for robot in fleet.robots:
        shared_map = home(robot, fleet) if robot.told else None
        if shared_map is not None:
            for name, (times, poses) in (
                (f"{robot.name}.tum", robot.final(shared_map)),
                (f"{robot.name}_online.tum", robot.online(shared_map.number)),
            ):
                write_trajectory(folder / name, times + robot.shift, poses)
    write_text(folder / "metrics.json", to_json(metrics))
    write_text(folder / "index.html", _page(fleet, metrics, drawings, command))
    return metrics


def _clear(folder: Path) -> None:
    """Remove the maps and trajectories of an earlier fleet: they would not belong to this one."""
    for path in folder.glob("common*"):
        if re.fullmatch(r"common\d+\.(cmap|svg)", path.name):
            remove(path)
    try:
        names = [robot["name"] for robot in json.loads((folder / "metrics.json").read_text("utf-8"))["robots"]]
    except (OSError, ValueError, TypeError, LookupError):  # of no fleet
        return
    for name in names:
        if isinstance(name, str) and NAME.fullmatch(name):
            remove(folder / f"{name}.tum")
            remove(folder / f"{name}_online.tum")


def _drawing(shared: Shared, numbers: dict[str, int]) -> Drawing:
    """Draw a common map with the ways of its robots, each in the colour of its number, whatever map it is in."""
    ends = np.cumsum([0, *shared.counts])
    names = sorted({name for name, _ in shared.members})
    own = {name: [np.empty(0, np.int64)] for name in names}
    for (name, _), begin, end in zip(shared.members, ends, ends[1:], strict=False):
        own[name].append(np.arange(begin, end))
    keys = [np.concatenate(own[name]) for name in names]
    return merged_drawing(shared.saved, names, keys, [numbers[name] for name in names])


def _page(fleet: Fleet, metrics: dict[str, Any], drawings: list[Drawing], command: str) -> str:
    robots, maps = metrics["robots"], metrics["maps"]
    sections = [
        *(_map(shared, one, drawing) for shared, one, drawing in zip(fleet.maps, maps, drawings, strict=True)),
        _robots(robots),
        _joined(metrics),
        _apart(metrics),
        _faults(metrics["faults"]),
        Section("command", "Made by", verbatim(command)) if command else None,
    ]
    together = max((len(one["members"]) for one in maps), default=0)
    return page(
        "Fleet",
        lead=f"{len(robots)} robots mapped side by side and told one server what they learned; {len(maps)} common "
        f"{'map' if len(maps) == 1 else 'maps'} came of it.",
        summary=_headline(robots, together),
        sections=[section for section in sections if section is not None],
        banner=_incomplete(metrics),
        footer=f"Written by contourslam {__version__}.",
        scripts=album.SCRIPTS,
    )


def _incomplete(metrics: dict[str, Any]) -> str:
    """Say what was not played to its end; nothing where all was."""
    if metrics["complete"]:
        return ""
    cut = [f"{r['name']} stopped after {r['scans']} scans ({r['damage']})" for r in metrics["robots"] if r["damage"]]
    return f"Incomplete: {'; '.join(cut) or 'interrupted before the recordings had ended'}."


def _headline(robots: list[dict[str, Any]], together: int) -> str:
    shown = [(f"{together} of {len(robots)}", "robots in the largest common map", "")]
    errors = [(robot["rmse"], robot["odometry_rmse"]) for robot in robots if robot["rmse"] is not None]
    if errors:
        raw = max(odometry for _, odometry in errors)
        worst = metres(max(error for error, _ in errors))
        shown.append((worst, "worst robot's error", f"raw odometry {metres(raw)}"))
    most = max((robot["bytes_per_second"] for robot in robots), default=0.0)
    shown.append((f"{most:.0f} B/s", "most that a robot sent", "without the transport's own"))
    return tiles(shown)


def _map(shared: Shared, one: dict[str, Any], drawing: Drawing) -> Section:
    name = f"common{shared.number}"
    members = ", ".join(one["members"])
    figure = album.drawn(
        drawing,
        kind="map",
        name=name,
        alt=f"Common map {shared.number} with the way of each robot in a colour of its own: {members}",
        caption=f"{members}: {one['corners']} corners, {one['walls']} walls, {one['keyframes']} keyframes. "
        f"{map_file(shared)} beside this page is the map; a dot is where a drive begins.",
    )
    return Section(name, f"Common map {shared.number}", figure)


def _robots(robots: list[dict[str, Any]]) -> Section:
    headers = [
        "robot", "common map", "error", "as known at the time", "raw odometry", "told from", "messages", "bytes/s",
    ]  # fmt: skip
    errors = [_lengths([robot[error] for robot in robots]) for error in _ERRORS]
    rows = [
        Row(
            robot["name"],
            [
                Cell(str(robot["common"])),
                *(Cell(column[number]) for column in errors),
                Cell("-" if robot["told_from"] is None else f"{robot['told_from']:.0f} s"),
                Cell(str(robot["messages"])),
                Cell(f"{robot['bytes_per_second']:.0f}"),
            ],
        )
        for number, robot in enumerate(robots)
    ]
    words = paragraph(
        "Told from: when, since the begin, the robot first knew its place in the common map that it ended in. Messages "
        "and bytes are those that it sent."
    )
    if any(robot["rmse"] is not None for robot in robots):
        words += paragraph(
            "Errors are root mean squares of the distance from the true positions, after one rigid motion that lays "
            "all robots of a common map on the world together. What was known at the time counts from when the robot "
            "was told. Raw odometry begins at each robot's own true pose."
        )
    else:
        del headers[2:5]
        rows = [Row(row.name, [row.cells[0], *row.cells[4:]]) for row in rows]
        words += paragraph("The recordings hold no true poses: there are no errors to tell.")
    return Section("robots", "Robots", words + table("The robots", headers, rows))


def _lengths(values: list[float | None]) -> list[str]:
    """Give the lengths of a column in one unit."""
    small = all(value is None or value < 0.1 for value in values)
    return ["-" if v is None else f"{1e3 * v:.1f} mm" if small else f"{v:.3f} m" for v in values]


def _joined(metrics: dict[str, Any]) -> Section:
    if not metrics["joined"]:
        return Section("joined", "Who was joined", paragraph("No two robots were joined: each has a map of its own."))
    headers = [
        "at", "who", "by", "corners", "walls", "surfaces agree", "contradicted", "way", "best rival", "ties",
    ]  # fmt: skip
    rows = [
        Row(
            f"{event['time']:.1f} s",
            [
                Cell(f"{', '.join(event['members'])} with {', '.join(event['joining'])}"),
                Cell(event["method"]),
                Cell(str(event["corners"])),
                Cell(str(event["walls"])),
                Cell(f"{event['agreeing']:.1f} m"),
                Cell(f"{event['contradicted']:.1%}"),
                Cell(f"{event['way']:.1f} m"),
                Cell(f"{event['rival']:.0%}"),
                Cell(str(event["ties"])),
            ],
        )
        for event in metrics["joined"]
    ]
    body = table("Joints and their evidence", headers, rows, words=["who", "by"])
    pairs = [pair for pair in metrics["met"] if pair["met"] is not None]
    if pairs:
        met = [
            Row(
                " and ".join(pair["robots"]),
                [Cell(f"{pair['met']:.1f} s"), Cell("-" if pair["joined"] is None else f"{pair['joined']:.1f} s")],
            )
            for pair in pairs
        ]
        body += table("When pairs had seen the same room, and were joined", ["pair", "seen", "joined"], met)
    return Section("joined", "Who was joined", body)


def _apart(metrics: dict[str, Any]) -> Section | None:
    if not metrics["apart"]:
        return None
    members = {one["common"]: ", ".join(one["members"]) for one in metrics["maps"]}
    rows = [
        Row(" and ".join(f"{number} ({members[number]})" for number in each["maps"]), [Cell(apart_in_words(each))])
        for each in metrics["apart"]
    ]
    words = paragraph(
        "The common maps at the end, held against each other as contourslam merge does. Too little: what is alike "
        "would fit many buildings. Ambiguous: another way of laying them fits about as well. Contradicted: one map saw "
        "through the other's walls. Enough to merge: contourslam merge joins them, a server asks for more."
    )
    return Section(
        "apart",
        "Who stays apart, and why",
        words + table("Common maps that stay apart", ["common maps", "why"], rows, stacked=True, words=["why"]),
    )


def _faults(faults: list[dict[str, Any]]) -> Section | None:
    if not faults:
        return None
    rows = [Row(fault["robot"] or "server", [Cell(f"{fault['run']:x}"), Cell(fault["text"])]) for fault in faults]
    words = paragraph("What robots told and could not be used, or was wrong with what the server had kept.")
    return Section(
        "faults",
        "Faults",
        words + table("Faults, the newest last", ["who", "run", "what"], rows, stacked=True, words=["run", "what"]),
    )
