"""What the sections are made from, and where their tables and figures go."""

import dataclasses
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from contourslam.atomic import write_text
from contourslam.config import Config
from contourslam.report.page.common import Gallery
from contourslam.report.page.markup import Row, table
from contourslam.report.page.tables import to_csv, to_latex
from contourslam.report.runs_groups import Group
from contourslam.report.runs_reading import JudgedRun

PX = 160.0
"""A figure of one column is shown so many px an inch large: its 8 pt are then as large as the page's words."""
_NAMES = {
    "figures": ("trajectories", "differences", "maps", "relation_errors", "relation_turns", "position_errors"),
    "tables": (
        "settings",
        "measures",
        "spread",
        "difference_of_relation_error",
        "difference_of_relation_error_rotation",
        "difference_of_position_error",
    ),
}
"""What may stand in each folder, beside what is no report's."""


@dataclass(frozen=True, slots=True)
class RunsReport:
    """Runs brought together by their recordings, and the folder of the report about them.

    Attributes
    ----------
    folder : Path
    groups : tuple of Group
        One or more.
    command : str
        The command line.
    """

    folder: Path
    groups: tuple[Group, ...]
    command: str

    @property
    def runs(self) -> list[JudgedRun]:
        """All of them, recording by recording."""
        return [run for group in self.groups for run in group.runs]

    @property
    def gallery(self) -> Gallery:
        """Where the figures go."""
        return Gallery(self.folder)

    def own_files(self, part: str) -> list[Path]:
        """Files in ``figures`` or ``tables`` that go by the names of a report: this one's, or an earlier one's."""
        own = re.compile(rf"({'|'.join(_NAMES[part])})(_\d+)?\.({'svg|pdf' if part == 'figures' else 'csv|tex'})")
        return [path for path in (self.folder / part).iterdir() if own.fullmatch(path.name)]

    def name(self, what: str, group: Group | None = None) -> str:
        """Name of a file, with the number of the recording where there are several."""
        return what if group is None or len(self.groups) == 1 else f"{what}_{self.groups.index(group) + 1}"

    def table(self, name: str, caption: str, headers: Sequence[str], rows: Sequence[Row]) -> str:
        """Write a table as ``tables/NAME.csv`` and ``.tex``, and give it for the page."""
        write_text(self.folder / "tables" / f"{name}.csv", to_csv(headers, rows))
        write_text(self.folder / "tables" / f"{name}.tex", to_latex(caption, headers, rows))
        return table(caption, headers, rows)


def flat(config: Config) -> dict[str, str]:
    """Give every setting as text, under the name that it has in config.yaml, such as ``slam.walls``."""

    def entries(values: dict[str, Any], prefix: str) -> dict[str, str]:
        found: dict[str, str] = {}
        for name, value in values.items():
            if isinstance(value, dict):
                found |= entries(value, f"{prefix}{name}.")
            else:
                found[prefix + name] = f"{value:g}" if isinstance(value, float) else str(value)
        return found

    return entries(dataclasses.asdict(config), "")


def differing(runs: Sequence[JudgedRun]) -> dict[str, list[str]]:
    """Settings in which the runs differ, with the value of each run."""
    settings = [flat(run.config) for run in runs]
    return {name: values for name in settings[0] if len(set(values := [one[name] for one in settings])) > 1}
