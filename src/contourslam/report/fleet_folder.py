"""The folder of a fleet that was played: trajectories, common maps, metrics and a page about all of it."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from contourslam import __version__
from contourslam.atomic import make_folder, remove, write_text
from contourslam.display import metres
from contourslam.fleet.play import Fleet
from contourslam.fleet.shared import Shared
from contourslam.fleet.wire import NAME
from contourslam.maps import save_map
from contourslam.recordings import write_trajectory
from contourslam.report.fleet_metrics import fleet_metrics, home
from contourslam.report.page import album
from contourslam.report.page.markup import Cell, Row, Section, page, paragraph, table, tiles, verbatim
from contourslam.report.result_folder import to_json
from contourslam.report.svg.drawing import Drawing
from contourslam.report.svg.merged import merged_drawing

_ERRORS = "rmse", "online_rmse", "odometry_rmse"


def map_file(shared: Shared) -> str:
    """Name of a common map's file."""
    return f"common{shared.number}.cmap"


def write_fleet_folder(folder: Path, fleet: Fleet, *, command: str = "") -> dict[str, Any]:
    """Write what came of a fleet, and give its metrics.

    The folder gets index.html, metrics.json, a map (commonN.cmap) and a picture (commonN.svg) of each common map, and
    of each robot NAME.tum, its poses at the end in the common map that it ended in, and NAME_online.tum, as it knew
    them at the time. What an earlier fleet left there under such names is removed.

    Parameters
    ----------
    folder : Path
        Made where needed.
    fleet : Fleet
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
    metrics = fleet_metrics(fleet)
    about = {"contourslam": __version__, "command": command}
    drawings = []
    for shared in fleet.maps:
        save_map(folder / map_file(shared), replace(shared.saved, about=shared.saved.about | about))
        drawings.append(_drawing(shared))
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


def _drawing(shared: Shared) -> Drawing:
    """Draw a common map with the ways of its robots; the runs of one that began anew have one colour."""
    ends = np.cumsum([0, *shared.counts])
    names = sorted({name for name, _ in shared.members})
    own = {name: [np.empty(0, np.int64)] for name in names}
    for (name, _), begin, end in zip(shared.members, ends, ends[1:], strict=False):
        own[name].append(np.arange(begin, end))
    return merged_drawing(shared.saved, names, [np.concatenate(own[name]) for name in names])


def _page(fleet: Fleet, metrics: dict[str, Any], drawings: list[Drawing], command: str) -> str:
    robots, maps = metrics["robots"], metrics["maps"]
    sections = [
        *(_map(shared, one, drawing) for shared, one, drawing in zip(fleet.maps, maps, drawings, strict=True)),
        _robots(robots),
        _joined(metrics),
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
        footer=f"Written by contourslam {__version__}.",
        scripts=album.SCRIPTS,
    )


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
    rows = [
        Row(
            robot["name"],
            [
                Cell(str(robot["common"])),
                *(Cell("-" if robot[error] is None else metres(robot[error])) for error in _ERRORS),
                Cell("-" if robot["told_from"] is None else f"{robot['told_from']:.0f} s"),
                Cell(str(robot["messages"])),
                Cell(f"{robot['bytes_per_second']:.0f}"),
            ],
        )
        for robot in robots
    ]
    words = paragraph(
        "Errors are root mean squares of the distance from the true positions, after one rigid motion that lays all "
        "robots of a common map on the world together. What was known at the time counts from when the robot was first "
        "told of the common map that it ended in. Raw odometry begins at each robot's own true pose."
    )
    return Section("robots", "Robots", words + table("The robots", headers, rows))


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
    body = table("Joints and their evidence", headers, rows)
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


def _faults(faults: list[dict[str, Any]]) -> Section | None:
    if not faults:
        return None
    rows = [Row(fault["robot"] or "server", [Cell(f"{fault['run']:x}"), Cell(fault["text"])]) for fault in faults]
    words = paragraph("What robots told and could not be used, or was wrong with what the server had kept.")
    return Section("faults", "Faults", words + table("Faults, the newest last", ["who", "run", "what"], rows))
