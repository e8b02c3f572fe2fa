"""How to get these runs and this page again."""

from contourslam.report.page.markup import Section, definitions, folded, heading, paragraph, verbatim
from contourslam.report.page.runs.values import RunsReport
from contourslam.report.provenance import software
from contourslam.settings_file import settings_text


def section(report: RunsReport) -> Section:
    """Give the section; every comparison has it."""
    commands = "\n".join(str(run.about.get("command") or f"(unknown: {run.name})") for run in report.runs)
    first = report.runs[0]
    parts = [heading("Command"), verbatim(report.command)] if report.command else []
    parts += [
        heading("The runs"),
        verbatim(commands),
        definitions({run.name: str(run.folder) for run in report.runs} | software()),
        folded(f"Every setting of {first.name}", verbatim(settings_text(first.config))),
        paragraph("metrics.json beside this page holds every number, tables/ and figures/ all that it shows.", "note"),
    ]
    return Section("reproduce", "Reproduce this", "\n".join(parts))
