"""How to get this run again."""

from contourslam.report.page.markup import Section, definitions, folded, heading, paragraph, verbatim
from contourslam.report.page.run.values import RunValues
from contourslam.report.provenance import machine, software
from contourslam.settings_file import settings_text


def section(values: RunValues) -> Section:
    """Give the section; every run has it."""
    skipped = {f"skipped: {reason}": f"{number:,}" for reason, number in values.result.skipped.items()}
    parts = [heading("Command"), verbatim(values.command)] if values.command else []
    parts += [
        heading("Run, versions and machine"),
        definitions({"detector": values.result.detector, **skipped, **software(), **machine()}),
        folded("Every setting that was used", verbatim(settings_text(values.config))),
        paragraph("metrics.json beside this page holds every number, scans.csv each scan's pose.", "note"),
    ]
    return Section("reproduce", "Reproduce this", "\n".join(parts))
