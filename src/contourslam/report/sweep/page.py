"""The report of a sweep: a page that opens offline, its tables as CSV and LaTeX, its figures as SVG, numbers as JSON.

``metrics.json`` has ``in_short`` and ``findings`` as sentences by metric; ``cells`` with each setting, room, noise,
beams and detector: runs, failed runs, and of each measure mean, low, high and count; ``pairs`` with every test, those
of a table under its name; and ``recordings`` with the figures of the real ones.
"""

import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

from contourslam import __version__
from contourslam.atomic import make_folder, remove, write_text
from contourslam.report.page import album, markup
from contourslam.report.page.tables import to_csv, to_latex
from contourslam.report.result_folder import to_json
from contourslam.report.sweep.content import Chart, Charts, Code, Folded, Heading, Item, Points, Table, Words
from contourslam.report.sweep.findings import counted
from contourslam.report.sweep.measures import MEASURES
from contourslam.report.sweep.parts import Parts
from contourslam.report.sweep.statistics import Pair, summary
from contourslam.report.sweep.values import Sweep

_OWN = re.compile(r"(findings|table_one|paper|cells|matrix|pairs|logs|failures|noise|beams)(_.*)?\.(csv|tex|svg)")
"""What an earlier report may have left in ``tables/`` and ``figures/``."""

_WORDS = ("shown", "condition", "cause")  # columns without numbers
_SHOWN = re.compile(r"<(?:th|td|li|p|span|h3|summary)\b[^>]*>[^<]+")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:cm|mrad|ms|s|m|beams)\b|%)")


def write_sweep_report(folder: Path, parts: Parts) -> dict[str, Any]:
    """Write ``index.html``, ``tables/``, ``figures/`` and ``metrics.json``.

    Parameters
    ----------
    folder : Path
        Made where needed. Tables and figures that an earlier report left here are removed; other files stay.
    parts : Parts
        What it says.

    Returns
    -------
    dict
        What ``metrics.json`` holds.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    sweep, metrics = parts.sweep, sweep_metrics(parts)
    for name in ("tables", "figures"):
        make_folder(folder / name)
        for path in (folder / name).iterdir():
            if _OWN.fullmatch(path.name):
                remove(path)
    write_text(folder / "metrics.json", to_json(metrics))
    found = [part for part in parts.all() if part.items]
    sections = [
        markup.Section(part.anchor, part.title, _unbroken("\n".join(_html(item, folder) for item in part.items)))
        for part in found
    ]
    missing = 0 if sweep.expected is None else sweep.expected - len(sweep.runs)
    text = markup.page(
        "Sweep of landmark detectors",
        lead=_lead(sweep),
        sections=sections,
        footer=f"Written by contourslam {__version__}.",
        banner=f"INCOMPLETE: {missing:,} runs are not done yet." if missing > 0 else "",
    )
    write_text(folder / "index.html", text)
    return metrics


def sweep_metrics(parts: Parts) -> dict[str, Any]:
    """Collect everything, by the schema of this module."""
    sweep = parts.sweep
    return {
        "contourslam": __version__,
        "command": parts.command,
        "metrics": [measure.name for measure in parts.measures],
        "runs": len(sweep.runs),
        "failed": len(sweep.failed),
        "expected": sweep.expected,
        "in_short": {measure.name: parts.in_short(measure) for measure in parts.measures},
        "findings": {measure.name: parts.sentences(measure) for measure in parts.measures},
        "cells": [
            {
                "setting": setting,
                "room": room,
                "noise": condition.noise,
                "beams": condition.beams,
                "detector": name,
                "runs": len(runs),
                "failed": sum(bool(run.error) for run in runs),
                **{
                    key: asdict(found.interval)
                    for key, one in MEASURES.items()
                    if (found := summary(sweep, one, room, condition, name)).known
                },
            }
            for setting in sweep.settings
            for room in sweep.rooms
            for condition in sweep.conditions(setting)
            for name in sweep.detectors
            if (runs := sweep.cell(room, condition, name))
        ],
        "pairs": {
            f"{name}_{metric}_{setting}": list(map(_pair, found))
            for name, tests in (
                ("pairs", parts.together),
                ("pairs_by_room", parts.by_room),
                ("pairs_over_axes", parts.over_axes),
            )
            for (metric, setting), found in tests.items()
        },
        "recordings": [
            {
                "recording": run.drive.place,
                "setting": run.condition.setting,
                "detector": run.detector,
                "error": run.error or None,
                **{name: measure.of(run.row) for name, measure in MEASURES.items()},
            }
            for run in sweep.recorded
        ],
    }


def _pair(pair: Pair) -> dict[str, Any]:
    return asdict(pair) | {"effect": pair.effect, "better": pair.better}


def _lead(sweep: Sweep) -> str:
    drives = len({run.drive for run in sweep.simulated})
    rooms = ", ".join(room.replace("_", " ") for room in sweep.rooms)
    said = f"{counted(len(sweep.runs), 'run')} of {counted(len(sweep.detectors), 'detector')}"
    if drives:
        said += f" over {counted(drives, 'simulated drive')} ({rooms})"
    if sweep.recorded:
        said += f"{' and' if drives else ' over'} {counted(len({run.drive for run in sweep.recorded}), 'recording')}"
    return f"{said}. “Better” stands here only where a test that is corrected for the number of comparisons says so."


def _unbroken(html: str) -> str:
    """Keep numbers and their units on one line, in what is shown; what is copied stays as it is."""
    return _SHOWN.sub(lambda text: _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", text[0]), html)


def _html(item: Item, folder: Path) -> str:
    match item:
        case Words(text, note):
            return markup.paragraph(text, "note" if note else "")
        case Points(texts):
            return markup.bullets(texts)
        case Heading(text):
            return markup.heading(text)
        case Code(text):
            return markup.verbatim(text)
        case Table(name, caption, headers, rows):
            write_text(folder / "tables" / f"{name}.csv", to_csv(headers, rows))
            write_text(folder / "tables" / f"{name}.tex", to_latex(caption, headers, rows))
            words = [header for header in headers if header in _WORDS or header.endswith("better than")]
            return markup.table(caption, headers, rows, stacked=True, words=words)
        case Charts(charts):
            return f'<div class="pair">{"".join(_chart(chart, folder) for chart in charts)}</div>'
        case Folded(summary, items):
            return markup.folded(summary, "\n".join(_html(inner, folder) for inner in items))


def _chart(chart: Chart, folder: Path) -> str:
    write_text(folder / "figures" / f"{chart.name}.svg", chart.drawing.text)
    return album.drawn(chart.drawing, kind="chart", name=chart.name, alt=chart.alt, caption=chart.caption)
