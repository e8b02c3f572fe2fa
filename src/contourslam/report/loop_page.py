"""The report of a robot in the loop: a folder with its run, pictures of its camera, and a page about all of it."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from contourslam import __version__
from contourslam.atomic import make_folder, write_bytes, write_text
from contourslam.evaluation.metrics import run_metrics
from contourslam.experiments.loop_values import FAULTS, LoopResult
from contourslam.report.page import album
from contourslam.report.page.markup import Cell, Picture, Row, Section, page, pair, paragraph, table, tiles
from contourslam.report.page.run import reproduce, truth
from contourslam.report.page.run.facts import map_facts
from contourslam.report.page.run.values import RunValues, clock, count
from contourslam.report.result_folder import write_result_folder
from contourslam.report.svg.loop import known_then, loop_drawing
from contourslam.simulation.config import YDLIDAR_X4
from contourslam.simulation.rooms import ROOMS

TARGET = {"x": 0.03, "y": 0.03, "theta": 0.01}
"""RMSE that the robot in the loop has to keep, m, m, rad."""


def loop_metrics(result: LoopResult) -> dict[str, Any]:
    """Everything measured about a robot in the loop, ready for metrics.json.

    ``loop`` holds what is not of the mapping: configuration, the poses known at the time, punctuality, bytes, counters.
    """
    record, latencies = result.record, result.latencies
    return run_metrics(result.run) | {
        "loop": {
            "seed": result.config.seed,
            "room": result.config.room,
            "seconds": result.config.seconds,
            "fault": result.config.fault,
            "online_rmse": result.online,
            "kept": kept(result),
            "late_steps": result.late,
            "latest_step": record.latest,
            "world_busy": record.busy,
            "robot_busy": result.busy,
            "latency_median": float(np.median(latencies)) if latencies.size else None,
            "latency_p99": float(np.quantile(latencies, 0.99)) if latencies.size else None,
            "bytes_sent": record.bytes_sent,
            "bytes_damaged": record.bytes_hit,
            "travelled": result.travelled,
            "pictures": result.picture_count,
            "counters": asdict(result.counters),
            "troubles": [asdict(trouble) for trouble in result.troubles],
        }
    }


def kept(result: LoopResult) -> bool:
    """Whether the poses known at the time keep what is asked for."""
    return all(result.online[name] <= TARGET[name] for name in TARGET)


def write_loop_report(folder: Path, result: LoopResult, *, command: str = "") -> Path:
    """Write the result folder, the pictures and ``index.html``; give the page's path.

    Parameters
    ----------
    folder : Path
        Made where needed.
    result : LoopResult
    command : str
        The command line, shown as it stands.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    metrics = loop_metrics(result)
    make_folder(folder)
    write_result_folder(folder, result.run, result.settings, metrics, command=command)
    values = RunValues(result.run, result.settings, metrics, None, command)
    parts = [
        _way(result, values), truth.section(values), _punctuality(result), _line(result), _pictures(folder, result),
        reproduce.section(values),
    ]  # fmt: skip
    text = page(
        "Robot in the loop",
        lead=_lead(result),
        summary=_headline(result),
        sections=[part for part in parts if part is not None],
        footer=f"Written by contourslam {__version__}.",
        scripts=album.SCRIPTS,
        banner="" if kept(result) else "The errors are larger than they may be; see how punctual the world was.",
    )
    write_text(folder / "index.html", text)
    return folder / "index.html"


def _lead(result: LoopResult) -> str:
    config = result.config
    return (
        f"A robot drove {result.travelled:.1f} m through the {config.room.replace('_', ' ')} in "
        f"{clock(config.seconds)} min, at real time. Its drivers, its firmware and its mapping are the real ones; the "
        "room, the lidar, the wheels, the IMU and the wires are simulated down to their bytes. What goes wrong: "
        f"{FAULTS[config.fault]}."
    )


def _headline(result: LoopResult) -> str:
    shown = [
        (
            f"{100.0 * result.online[name]:.1f} cm",
            f"error in {name}",
            f"RMS as known at the time; at most {100.0 * TARGET[name]:g} cm allowed",
        )
        for name in ("x", "y")
    ]
    shown += [
        (f"{result.online['theta']:.4f} rad", "error of the heading", f"at most {TARGET['theta']} rad allowed"),
        (
            f"{100.0 * result.late:.1f} %",
            "of the world's steps late",
            f"by more than 20 ms; the most {1e3 * result.record.latest:.0f} ms",
        ),
        (
            f"{100.0 * result.busy:.0f} %",
            "of a core for the robot's computer",
            f"the world takes {100.0 * result.record.busy:.0f} % of another",
        ),
    ]
    return tiles(shown)


def _way(result: LoopResult, values: RunValues) -> Section:
    room = ROOMS[result.config.room]
    size = result.run
    figure = album.drawn(
        loop_drawing(size, room.segments(YDLIDAR_X4.mount_height), result.record.poses),
        kind="map",
        name="way",
        alt="Map made by the robot over the true room, with the way it drove and the way it took itself to drive",
        caption="The room at the lidar's height, what was mapped of it, the true way, and the poses by which the robot "
        f"steered: {count(len(size.corner_map.ids), 'corner')}, {count(len(size.wall_map.ids), 'wall')}.",
        facts=map_facts(values, known_then(size)),
    )
    words = paragraph(
        "Good: the mapped walls lie on the room's, and the robot's own way inside the true one. Where the two ways "
        "part, all that is mapped from there on lies as far off."
    )
    return Section("way", "Map and way", words + figure)


def _punctuality(result: LoopResult) -> Section:
    record, latencies = result.record, 1e3 * result.latencies
    low, high = (np.quantile(latencies, share) if latencies.size else np.nan for share in (0.5, 0.99))
    rows = [
        Row("steps of the physics, 2 ms each", [Cell(f"{record.steps:,}")]),
        Row("done more than 20 ms after their time", [Cell(f"{record.late:,}", f"{100.0 * result.late:.2f} %")]),
        Row("the latest", [Cell(f"{1e3 * record.latest:.0f} ms")]),
        Row("from a turn's coming to its pose", [Cell(f"{low:.0f} ms", f"99 %: {high:.0f} ms")]),
        Row("the world's process", [Cell(f"{100.0 * record.busy:.0f} % of a core")]),
        Row("the robot's process", [Cell(f"{100.0 * result.busy:.0f} % of a core")]),
    ]
    note = paragraph(
        "A world that is late holds every sensor up; the errors above are then the machine's, not the robot's."
    )
    return Section("time", "Real time", table("How punctual everything was", ["what", "how much"], rows) + note)


def _line(result: LoopResult) -> Section:
    record, counters = result.record, result.counters
    share = record.bytes_hit / max(record.bytes_sent, 1)
    failed = counters.packets_failed / max(counters.packets + counters.packets_failed, 1)
    rows = [
        Row("bytes on both lines", [Cell(f"{record.bytes_sent:,}")]),
        Row("damaged on the way", [Cell(f"{record.bytes_hit:,}", f"{100.0 * share:.1f} %")]),
        Row(
            "the lidar's packets",
            [Cell(f"{counters.packets + counters.packets_failed:,}", f"{100.0 * failed:.1f} % fail")],
        ),
        Row("the lidar's port opened anew", [Cell(str(counters.reconnections))]),
        Row("the base's states", [Cell(f"{counters.states:,}", f"{counters.frames_refused:,} frames refused")]),
        Row("the base stopped by its watchdog", [Cell(str(counters.watchdog_stops))]),
        Row("the base began anew", [Cell(str(counters.resets))]),
    ]
    begin = float(result.run.stamps.min()) if result.run.stamps.size else 0.0
    told = "".join(
        paragraph(f"{trouble.stamp - begin:.1f} s: {trouble.message or f'the {trouble.part} is there again'}")
        for trouble in result.troubles
    )
    return Section("line", "What went wrong", table("The serial lines", ["what", "how much"], rows) + told)


def _pictures(folder: Path, result: LoopResult) -> Section | None:
    if not result.pictures:
        return None
    make_folder(folder / "pictures")
    begin = float(result.run.stamps.min())
    shown = []
    for number, picture in enumerate(result.pictures):
        name = f"pictures/{number:02d}.{'jpg' if picture.encoding == 'jpeg' else 'png'}"
        write_bytes(folder / name, picture.data)
        after = picture.stamp - begin
        shown.append(
            Picture(name, 320, 320, f"Fisheye picture after {after:.0f} s", f"After {after:.0f} s.", chart=False)
        )
    words = paragraph(f"{count(result.picture_count, 'picture')} came from the camera; these are some of them.")
    pairs = "".join(pair(shown[at : at + 2]) for at in range(0, len(shown), 2))
    return Section("camera", "What the camera saw", words + pairs)
