"""In what the runs differ before any of them is judged."""

from contourslam.report.page.markup import Cell, Row, Section, paragraph
from contourslam.report.page.runs.values import RunsReport, differing

_PLAIN = {"True": "yes", "False": "no", "None": "none"}


def section(report: RunsReport) -> Section:
    """Give the section; every comparison has it."""
    runs, rows = report.runs, []
    recordings = [group.recording for group in report.groups for _ in group.runs]
    versions = [str(run.about.get("contourslam", "unknown")) for run in runs]
    scans = [f"{len(run.result.stamps):,}" for run in runs]
    for name, values in (("recording", recordings), ("version", versions), ("scans", scans)):
        if len(set(values)) > 1 or name == "recording":
            rows.append(Row(name, [Cell(value) for value in values]))
    settings = differing(runs)
    rows += [Row(name, [Cell(_PLAIN.get(value, value)) for value in values]) for name, values in settings.items()]
    words = "All other settings are the same in all runs." if settings else "All settings are the same in all runs."
    notes = [paragraph(note, "note") for run in runs for note in run.notes]
    shown = report.table("settings", "What differs between the runs", ["", *(run.name for run in runs)], rows)
    return Section("settings", "What differs", shown + paragraph(words, "note") + "".join(notes))
