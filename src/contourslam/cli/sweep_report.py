"""``contourslam sweep-report``: tables, figures and tests of a sweep."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from contourslam.cli.console import chosen, note, prepare_folder, print_json
from contourslam.cli.options import Json, Output, Overwrite
from contourslam.errors import ConfigError


@dataclass(frozen=True)
class SweepReport:
    """Report what a sweep found: means with intervals, and which detector is shown to be better than which.

    The folder gets index.html (opens offline), tables/ as CSV and LaTeX, figures/ as SVG, and metrics.json. Detectors
    are held against each other drive by drive, and the p-values of a table are corrected for their number; failed runs
    are counted and listed. Results can be reported while the sweep still runs.

    Example: contourslam sweep-report out/sweep -o out/sweep-report
    """

    results: tyro.conf.Positional[tuple[str, ...]]
    """Folders or URLs that `contourslam sweep -o` wrote; several are reported as one."""
    output: Output
    overwrite: Overwrite = False
    metric: tuple[str, ...] = ("position", "false_negatives")
    """What detectors are compared by in simulated rooms: position, x, y, heading, landmarks, false_negatives. The first
    is drawn."""
    markdown: Path | None = None
    """Also write the report into a Markdown file: into its places <!-- sweep:NAME --> <!-- /sweep:NAME -->, or new."""
    json: Json = False

    def execute(self, command: str) -> int:
        """Write the report and print what can be said."""
        from contourslam.report.sweep.markdown import check_place, write_markdown
        from contourslam.report.sweep.measures import COMPARABLE, MEASURES
        from contourslam.report.sweep.page import write_sweep_report
        from contourslam.report.sweep.parts import Parts
        from contourslam.report.sweep.reading import read_sweep

        choices = {name: MEASURES[name] for name in COMPARABLE}
        measures = [chosen("metric", name, choices) for name in dict.fromkeys(self.metric or COMPARABLE[:1])]
        self._keep_out_of_results()
        if self.markdown is not None:
            check_place(self.markdown)
        sweep = read_sweep(self.results)
        prepare_folder(self.output, overwrite=self.overwrite)
        parts = Parts(sweep, measures, command)
        metrics = write_sweep_report(self.output, parts)
        if self.markdown is not None:
            write_markdown(self.markdown, parts)
        if self.json:
            print_json(metrics)
        else:
            said = {measure.title: found for measure in measures if (found := metrics["in_short"][measure.name])}
            for title, found in said.items():
                print(f"by the {title}:", *found, sep="\n  ")
            if not said:
                print("no two detectors can be compared: none were run with the same seeds in a simulated room")
            print(f"\nreport: {self.output / 'index.html'}")
        if (missing := metrics["expected"] - metrics["runs"]) > 0:
            note(
                f"{missing} of {metrics['expected']} runs are missing; go on with the same "
                "`contourslam sweep` command, then report again"
            )
        return 0

    def _keep_out_of_results(self) -> None:
        """Refuse to write into a folder of results, or anywhere below."""
        for url in self.results:
            place = url.removeprefix("file://")
            if "://" not in place and self.output.resolve().is_relative_to(Path(place).resolve()):
                raise ConfigError(f"{self.output} is in the results {url}; choose another folder with --output")
