"""In what the runs differ before any of them is judged."""

import shlex
from collections.abc import Sequence

from contourslam.report.page.markup import Cell, Row, Section, paragraph
from contourslam.report.page.runs.values import RunsReport, differing, flat
from contourslam.report.runs_reading import JudgedRun

_OF_NO_EFFECT = (
    *("--output", "--overwrite", "--json", "--relations", "--truth", "--config", "--grid", "--rerun"),
    *("--view", "--view-host", "--view-port"),
)
_FLAGS = ("--ignore-odometry", "--keys")
"""Options that take no value, of those that are told."""
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
    if any(options := other_options(runs)):
        rows.append(Row("further options", [Cell(", ".join(one) or "none") for one in options]))
    words = "All other settings are the same in all runs." if settings else "All settings are the same in all runs."
    notes = [paragraph(note, "note") for run in runs for note in run.notes]
    shown = report.table("settings", "What differs between the runs", ["setting", *(run.name for run in runs)], rows)
    return Section("settings", "What differs", shown + paragraph(words, "note") + "".join(notes))


def other_options(runs: Sequence[JudgedRun]) -> list[list[str]]:
    """Options of each run's command that are no settings, such as ``--every 2``, without those that all runs have."""
    found = []
    for run in runs:
        settings = {name.rpartition(".")[2] for name in flat(run.config)}
        options: list[list[str]] = []
        for word in _words(str(run.about.get("command", ""))):
            if word.startswith("-"):
                options.append(word.split("=", 1))
            elif options and options[-1][0] not in _FLAGS:  # else it is the recording
                options[-1].append(word)
        found.append(
            [
                " ".join(words[:2])
                for words in options
                if words[0].startswith("--") and words[0] not in _OF_NO_EFFECT and _setting(words[0]) not in settings
            ]
        )
    shared = set(found[0]).intersection(*found)
    return [[option for option in options if option not in shared] for options in found]


def _setting(option: str) -> str:
    return option.removeprefix("--").removeprefix("no-").replace("-", "_")


def _words(command: str) -> list[str]:
    try:
        return shlex.split(command)
    except ValueError:  # not written by us
        return []
