"""``contourslam evaluate``: a result folder judged, again or by something new."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from contourslam.cli.console import note, print_json
from contourslam.cli.options import Json


@dataclass(frozen=True)
class Evaluate:
    """Judge a result folder by true poses or by known relative poses; two folders or more stand side by side.

    Where the run has been refined at its end, the figures of the poses as known at the time stand beside it (online).
    Truth that the recording held, and relations that the run was judged by, are used by themselves. metrics.json is
    left as it is; --json prints the new figures. `contourslam compare DIR DIR` makes a page with figures of it.

    Example: contourslam evaluate out/intel --relations intel.relations.xz
    """

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """Folders that `contourslam run` wrote."""
    truth: Path | None = None
    """True trajectory: rows t x y z qx qy qz qw (TUM) or t x y theta; moved so that the first poses agree."""
    relations: Path | None = None
    """Known relative poses: rows t1 t2 dx dy dz roll pitch yaw."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Print the figures of each folder."""
        from contourslam.report.runs_reading import read_runs

        runs = read_runs(self.folders, truth=self.truth, relations=self.relations)
        for text in [text for run in runs for text in run.notes]:
            note(text)
        metrics = {str(run.folder): run.metrics for run in runs}
        if self.json:
            print_json(metrics)
        else:
            print_table(metrics)
        return 0


def print_table(metrics: dict[str, dict[str, Any]]) -> None:
    """Print a row per figure that some run has, a column per run."""
    from contourslam.report.runs_rows import MEASURES

    width = max(12, *(len(name) for name in metrics))
    print(" " * 48 + "".join(f"{name:>{width + 2}}" for name in metrics))
    for measure in MEASURES:
        cells = [measure.text(value) for value in measure.values(metrics.values())]
        if any(cells):
            print(f"{measure.name:<48}" + "".join(f"{cell or '-':>{width + 2}}" for cell in cells))
