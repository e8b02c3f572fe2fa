"""The report about several runs: a page, its tables as CSV and LaTeX, its figures as SVG and PDF, all numbers as JSON.

``metrics.json`` has ``runs.NAME`` with what each run is and all of :mod:`contourslam.evaluation.metrics`, and
``recordings.NAME`` with the runs of a recording, the motion that took each into the first one's world, how far their
poses lie apart, and the differences of their errors.
"""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from contourslam import __version__
from contourslam.atomic import make_folder, remove, write_text
from contourslam.report.page.markup import page
from contourslam.report.page.runs import differs, measures, recording, reproduce
from contourslam.report.page.runs.values import RunsReport, differing
from contourslam.report.result_folder import to_json
from contourslam.report.runs_groups import Group, grouped
from contourslam.report.runs_reading import JudgedRun
from contourslam.report.runs_rows import MEASURES

_LEADING = {("ate", "rmse"): "position error", ("relations", "translation", "mean"): "relation error"}
"""What the opening words quote, each with what its pairs are called."""


def write_runs_report(folder: Path, runs: Sequence[JudgedRun], *, command: str = "") -> dict[str, Any]:
    """Write ``index.html``, ``tables/``, ``figures/`` and ``metrics.json``.

    The numbers are written before anything is drawn, so that a failure to draw loses none.

    Parameters
    ----------
    folder : Path
        Made where needed. Files of the same names are replaced, and figures and tables that an earlier comparison left
        here are removed; all others stay.
    runs : sequence of JudgedRun
        One or more.
    command : str
        The command line, shown as it stands.

    Returns
    -------
    dict
        What ``metrics.json`` holds.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    report = RunsReport(folder, tuple(grouped(runs)), command)
    metrics = runs_metrics(report)
    for part in ("figures", "tables"):
        make_folder(folder / part)
        for path in report.own_files(part):  # an earlier comparison's would not belong to this one
            remove(path)
    write_text(folder / "metrics.json", to_json(metrics))
    parts = [
        differs.section(report),
        measures.section(report),
        *(recording.section(report, group) for group in report.groups),
        reproduce.section(report),
    ]
    incomplete = [run.name for run in runs if not run.result.complete]
    text = page(
        " and ".join(run.name for run in runs) if len(runs) < 3 else f"{len(runs)} runs compared",
        lead=_lead(report),
        sections=[part for part in parts if part is not None],
        footer=f"Written by contourslam {__version__}.",
        banner=f"INCOMPLETE: {', '.join(incomplete)} stopped early." if incomplete else "",
    )
    write_text(folder / "index.html", text)
    return metrics


def runs_metrics(report: RunsReport) -> dict[str, Any]:
    """Collect everything, by the schema of this module."""
    return {
        "contourslam": __version__,
        "command": report.command,
        "runs": {
            run.name: {
                "folder": str(run.folder),
                "recording": group.recording,
                "contourslam": run.about.get("contourslam"),
                "command": run.about.get("command"),
                "complete": run.result.complete,
                "notes": run.notes,
                "metrics": run.metrics,
            }
            for group in report.groups
            for run in group.runs
        },
        "settings": {
            name: dict(zip([run.name for run in report.runs], values, strict=True))
            for name, values in differing(report.runs).items()
        },
        "recordings": {group.recording: _group_metrics(group) for group in report.groups},
    }


def _group_metrics(group: Group) -> dict[str, Any]:
    names = [run.name for run in group.runs]
    return {
        "runs": names,
        "competing": [name for name in names if name in group.competing],
        "motions": dict(zip(names, group.motions, strict=True)),
        "apart": {
            name: {
                "scans": len(one.times),
                "position": {"mean": one.position.mean(), "max": one.position.max()},
                "heading": {"mean": one.heading.mean(), "max": one.heading.max()},
            }
            for name, one in group.differences().items()
        },
        "pairs": [asdict(pair) for pair in group.pairs()],
    }


def _lead(report: RunsReport) -> str:
    """Say what is compared, and, of one recording, which run has the smallest errors."""
    runs, groups = report.runs, report.groups
    if len(groups) > 1:
        names = ", ".join(f"{len(group.runs)} of {group.recording}" for group in groups)
        return f"{len(runs)} runs of {len(groups)} recordings: {names}. Errors are compared within a recording only."
    drive = f"{groups[0].recording}, {max(run.distance for run in runs):,.0f} m"
    said = f"{len(runs)} run{'s' * (len(runs) > 1)} of one recording ({drive})."
    for measure in (measure for measure in MEASURES if measure.keys in _LEADING):
        known = [
            (value, run.name)
            for run, value in zip(runs, measure.values(run.metrics for run in runs), strict=True)
            if run.name in groups[0].competing and value is not None
        ]
        if len({measure.text(value) for value, _ in known}) > 1:
            (least, best), (most, worst) = min(known), max(known)
            said += f" {measure.title[0].upper()}{measure.title[1:]}: from {measure.text(least)} m ({best}) "
            said += f"to {measure.text(most)} m ({worst})"
            pairs = [{one.first, one.second} for one in groups[0].pairs() if one.measure == _LEADING[measure.keys]]
            return said + ("; how sure that is, stands below." if {best, worst} in pairs else ".")
    return said
