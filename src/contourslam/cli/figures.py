"""``contourslam figures``: figures of runs as a paper takes them."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from contourslam.cli.console import keep_apart, note, prepare_folder, print_json
from contourslam.cli.options import Json, Output, Overwrite
from contourslam.errors import ConfigError


@dataclass(frozen=True)
class Figures:
    """Draw figures of runs for a paper: as SVG and PDF, as wide as a column, 8 pt, without titles.

    Each run gives its map; where they are known, its errors over time and the consistency of its innovations. Runs of
    the same recording also give their trajectories over one another, how far their poses lie apart, and the
    distribution of their errors. Lines differ in dashes as in colour, fonts are embedded, and the same runs give the
    same bytes again. tables/ and a page with all numbers: `contourslam compare`.

    Example: contourslam figures out/ekf out/graph -o out/figures --width single
    """

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """Folders that `contourslam run` wrote."""
    output: Output
    overwrite: Overwrite = False
    width: str = "single"
    """Width: single (3.5 inches) or double (7.16 inches) for the columns of a journal, or a number of inches."""
    truth: Path | None = None
    """True trajectory to judge the runs by: rows t x y z qx qy qz qw (TUM) or t x y theta."""
    relations: Path | None = None
    """Known relative poses to judge the runs by: rows t1 t2 dx dy dz roll pitch yaw."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Draw the figures and say which there are."""
        width = self._inches()
        from contourslam.report.figures.of_runs import figures_of
        from contourslam.report.figures.save import save_figure
        from contourslam.report.runs_groups import grouped
        from contourslam.report.runs_reading import read_runs

        keep_apart(self.output, self.folders)
        runs = read_runs(self.folders, truth=self.truth, relations=self.relations)
        prepare_folder(self.output, overwrite=self.overwrite)
        for text in [text for run in runs for text in run.notes]:
            note(text)
        files = []
        for name, figure in figures_of(grouped(runs), width):
            written = [self.output / f"{name}.{form}" for form in ("svg", "pdf")]
            save_figure(figure, *written)
            files += written
        if self.json:
            print_json({"width": width, "files": list(map(str, files))})
        else:
            print("\n".join(map(str, files)))
        return 0

    def _inches(self) -> float:
        from contourslam.report.figures.style import DOUBLE, SINGLE

        try:
            width = {"single": SINGLE, "double": DOUBLE}.get(self.width) or float(self.width)
        except ValueError:
            width = 0.0
        if not 1.5 <= width <= 20.0:
            raise ConfigError(f"--width must be single, double or a number of inches from 1.5 to 20, got {self.width}")
        return width
