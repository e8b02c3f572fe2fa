"""The report of a comparison: one folder with a page that opens offline, its figures, and every number as JSON."""

from pathlib import Path

from contourslam import __version__
from contourslam.atomic import make_folder, write_text
from contourslam.experiments.study import Study
from contourslam.report.comparison_metrics import comparison_metrics, mean, shared
from contourslam.report.figures.style import label
from contourslam.report.page import (
    adaptation,
    consistency,
    detectors,
    noise,
    refinement,
    reproduce,
    room,
    table_one,
    timings,
)
from contourslam.report.page.common import Gallery
from contourslam.report.page.markup import page
from contourslam.report.paper import TABLE_I
from contourslam.report.result_folder import to_json
from contourslam.settings_file import write_settings

_INCOMPLETE = "INCOMPLETE: the work was stopped early; this page shows what was done by then."


def write_report(folder: Path, study: Study, *, command: str = "") -> Path:
    """Write ``index.html``, ``figures/``, ``metrics.json`` and ``config.yaml``.

    The numbers are written before anything is drawn, so that a failure to draw loses none.

    Parameters
    ----------
    folder : Path
        Made where needed; files of the same names are replaced.
    study : Study
        The experiments; those left out have no section.
    command : str
        The command line, shown as it stands.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    make_folder(folder / "figures")
    write_text(folder / "metrics.json", to_json(comparison_metrics(study, command=command)))
    write_settings(
        folder / "config.yaml", study.comparison.config, header=f"contourslam {__version__}\n{command}".strip()
    )
    gallery = Gallery(folder)
    parts = [
        table_one.section(study, gallery),
        room.section(study, gallery),
        *detectors.sections(study, gallery),
        noise.section(study, gallery),
        refinement.section(study, gallery),
        adaptation.section(study, gallery),
        consistency.section(study, gallery),
        timings.section(study, gallery),
        reproduce.section(study, command),
    ]
    text = page(
        "Landmark detectors compared inside EKF-SLAM",
        lead=headline(study),
        sections=[part for part in parts if part is not None],
        footer=f"Written by contourslam {__version__}.",
        banner="" if study.complete else _INCOMPLETE,
    )
    write_text(folder / "index.html", text)
    return folder / "index.html"


def headline(study: Study) -> str:
    """Say in two sentences what came out."""
    comparison = study.comparison
    table = comparison.table("corners")
    if not table:
        return "No replay was finished."
    first = "matched_filter" if "matched_filter" in table else next(iter(table))
    rmse = table[first].get("rmse") or {}
    x, y = mean(rmse.get("x")), mean(rmse.get("y"))
    if x is None or y is None:
        return "The true poses of these runs are not known."
    runs = int(table[first]["scans"]["n"])
    drives = f"{runs} simulated drive{'s' * (runs != 1)} through the {comparison.room.name.replace('_', ' ')}"
    said = f"Over {drives}, the {label(first)} locates the robot to {100 * x:.1f} cm in x and {100 * y:.1f} cm in y"
    if first in TABLE_I:
        said += f" (the paper: {100 * TABLE_I[first]['x']:.1f} and {100 * TABLE_I[first]['y']:.1f} cm)"
    odometry = shared(comparison, "odometry_rmse") or {}
    wheels_x, wheels_y = mean(odometry.get("x")), mean(odometry.get("y"))
    if wheels_x is not None and wheels_y is not None:
        said += f"; its wheels alone would have been off by {100 * wheels_x:.0f} and {100 * wheels_y:.0f} cm"
    return f"{said}. Each drive was recorded once and replayed through every detector below."
