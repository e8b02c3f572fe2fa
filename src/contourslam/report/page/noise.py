"""Error against the lidar's noise."""

import numpy as np

from contourslam.experiments.study import Study
from contourslam.report.figures.bars import noise_figure
from contourslam.report.figures.style import label
from contourslam.report.page.common import Gallery, number, position
from contourslam.report.page.markup import Cell, Row, Section, figure, paragraph, table


def section(study: Study, gallery: Gallery) -> Section | None:
    """Give the section; None where the sweep was left out."""
    sweep = study.noise
    if sweep is None or not len(sweep.levels):
        return None
    curves = {name: sweep.rmse(name) for name in study.comparison.detectors}
    odometry = next(
        (position({"rmse": run["odometry_rmse"]}) for found in sweep.metrics for run in found.values()), None
    )
    picture = gallery.add(
        "noise",
        noise_figure(sweep.levels, curves, odometry=odometry),
        alt="Position and heading error of each detector against the range noise; the table gives the numbers",
        caption="The same drive measured again at each noise level, corners only; logarithmic.",
    )
    rows = [
        Row(f"{100 * level:g} cm", [Cell(number(100 * float(np.hypot(*curve[i, :2])), 2)) for curve in curves.values()])
        for i, level in enumerate(sweep.levels)
    ]
    words = paragraph("The drive of the first seed, with the lidar's noise scaled up; the pipeline is told each level.")
    numbers = table("Position RMSE (cm), corners only", ["Range noise", *map(label, curves)], rows)
    return Section("noise", "Noise", words + figure(picture) + numbers)
