"""Everything measured, a row per measure and a column per run."""

from collections.abc import Sequence
from typing import Any

from contourslam.evaluation.metrics import aggregate
from contourslam.report.page.common import spread
from contourslam.report.page.markup import Cell, Row, Section, paragraph
from contourslam.report.page.runs.values import RunsReport, differing, flat
from contourslam.report.runs_groups import Group
from contourslam.report.runs_reading import JudgedRun
from contourslam.report.runs_rows import MEASURES, Measure


def section(report: RunsReport) -> Section:
    """Give the section; every comparison has it."""
    parts = [_of_group(report, group) for group in report.groups] if _any_competing(report) else [_of_all(report)]
    parts += _over_recordings(report)
    return Section("measures", "Measures", "\n".join(parts))


def _any_competing(report: RunsReport) -> bool:
    return any(group.competing for group in report.groups)


def _of_all(report: RunsReport) -> str:
    words = "" if len(report.groups) == 1 else paragraph("The recordings differ, so that no run is marked as the best.")
    rows = _rows(report.runs, frozenset())
    return words + report.table("measures", "All runs", ["measure", *map(_title, report.runs)], rows)


def _of_group(report: RunsReport, group: Group) -> str:
    many = len(report.groups) > 1
    words = ""
    if left := [run.name for run in group.runs if run.name not in group.competing]:
        words = f"{', '.join(left)}: not all of the recording was mapped, so that the errors are of another drive. "
    if group.competing:
        words += f"Green: the best of the {len(group.competing)} runs that mapped the whole recording."
    caption = f"Runs of {group.recording}" if many else "All runs"
    headers = ["measure", *map(_title, group.runs)]
    shown = report.table(report.name("measures", group), caption, headers, _rows(group.runs, group.competing))
    return shown + (paragraph(words, "note") if words else "")


def _title(run: JudgedRun) -> str:
    return run.name + ("" if run.result.complete else " (INCOMPLETE)")


def _rows(runs: Sequence[JudgedRun], competing: frozenset[str]) -> list[Row]:
    rows = []
    for measure in MEASURES:
        values = measure.values(run.metrics for run in runs)
        if any(value is not None for value in values):
            texts = [measure.text(value) for value in values]
            best = _best(measure, runs, values, competing)
            rows.append(Row(measure.name, [Cell(text or "–", better=text in best) for text in texts]))
    return rows


def _best(measure: Measure, runs: Sequence[JudgedRun], values: list[object], competing: frozenset[str]) -> set[str]:
    """Texts of the best values: those that cannot be told apart are equally good; where all are, none is."""
    known = {
        measure.text(value): value
        for run, value in zip(runs, values, strict=True)
        if run.name in competing and isinstance(value, int | float)
    }
    if not measure.smaller_wins or len(known) < 2:
        return set()
    return {min(known, key=lambda text: float(known[text]))}


def _over_recordings(report: RunsReport) -> list[str]:
    """Mean and spread, over the recordings, of each setting that was run on two of them or more."""
    settings: dict[tuple[str, str], list[tuple[str, JudgedRun]]] = {}
    for group in report.groups:
        for run in group.runs:
            if run.name in group.whole:
                key = str(flat(run.config)), str(run.about.get("contourslam"))
                settings.setdefault(key, []).append((group.recording, run))
    repeated = [found for found in settings.values() if len({recording for recording, _ in found}) > 1]
    if not repeated:
        return []
    names = differing([found[0][1] for found in repeated])
    headers, columns = ["measure"], []
    for at, found in enumerate(repeated):
        told = [
            values[at] if name in ("detector", "back_end") else f"{name} {values[at]}" for name, values in names.items()
        ]
        headers.append(", ".join(told) or "all")
        columns.append(aggregate([_average(found, recording) for recording in dict(found)]))
    rows = [
        Row("recordings", [Cell(str(len(dict(found)))) for found in repeated]),
        Row("runs", [Cell(str(len(found))) for found in repeated]),
    ]
    for measure in MEASURES:
        values = measure.values(columns)
        if any(isinstance(value, dict) for value in values):
            rows.append(Row(measure.name, [_spread(measure, value) for value in values]))
    caption = "Each setting over its recordings: mean and standard deviation"
    return [report.table("spread", caption, headers, rows)]


def _average(found: Sequence[tuple[str, JudgedRun]], recording: str) -> dict[str, Any]:
    """Mean of a setting's runs of a recording: repeated, they are still one drive."""

    def mean(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        return value["mean"] if set(value) == {"mean", "sd", "n"} else {key: mean(one) for key, one in value.items()}

    averaged: dict[str, Any] = mean(aggregate([run.metrics for of, run in found if of == recording]))
    return averaged


def _spread(measure: Measure, value: object) -> Cell:
    if not isinstance(value, dict):
        return Cell("–")
    scale = {part: measure.in_unit(value[part]) for part in ("mean", "sd") if value.get(part) is not None}
    return spread(scale, max(measure.digits, 1))
