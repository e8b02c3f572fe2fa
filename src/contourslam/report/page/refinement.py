"""Raw contour vertices against refined corners."""

from contourslam.experiments.refinement import Refinement
from contourslam.experiments.study import Study
from contourslam.report.figures.bars import pair_figure
from contourslam.report.figures.style import label
from contourslam.report.page.common import Gallery, number, position
from contourslam.report.page.markup import Cell, Picture, Row, Section, pair, paragraph, table

_NAMES = ("raw vertex", "refined")


def section(study: Study, gallery: Gallery) -> Section | None:
    """Give the section; None where the experiment was left out."""
    part = study.refinement
    if part is None or not part.scores:
        return None
    headers = ["Detector", "raw vertex (cm)", "refined (cm)", "gain", "precision", "recall", "repeatability"]
    rows = []
    for name, score in part.scores.items():
        shares = [Cell(number(value, 3)) for value in (score.precision, score.recall, score.repeatability)]
        errors = [Cell(number(100 * value, 2)) for value in (score.raw_rms_error, score.rms_error)]
        gain = Cell(f"{number(score.raw_rms_error / score.rms_error, 1)}×")
        rows.append(Row(label(name), [*errors, gain, *shares]))
    words = (
        "A line is fitted to each side of a corner and the two are intersected. All detectors share this refinement."
    )
    if _agree(part):
        words += " With raw vertices they differ; after the refinement they nearly agree."
    numbers = table("RMS error of detected corners against those of the true room", headers, rows)
    return Section(
        "refinement", "Raw against refined corners", paragraph(words) + pair(_pictures(part, gallery)) + numbers
    )


def _agree(part: Refinement) -> bool:
    raw, refined = ([position(run) for run in runs.values()] for runs in (part.raw, part.refined))
    return len(refined) > 1 and max(refined) < 1.3 * min(refined) and max(raw) > 1.3 * min(raw)


def _pictures(part: Refinement, gallery: Gallery) -> list[Picture]:
    corners = pair_figure(
        {name: score.raw_rms_error for name, score in part.scores.items()},
        {name: score.rms_error for name, score in part.scores.items()},
        names=_NAMES,
        ylabel="RMS error of a corner (cm)",
        scale=100.0,
    )
    poses = pair_figure(
        {name: position(part.raw[name]) for name in part.scores},
        {name: position(part.refined[name]) for name in part.scores},
        names=_NAMES,
        ylabel="position RMSE of the robot (cm)",
        scale=100.0,
    )
    return [
        gallery.add(
            "refinement_corners",
            corners,
            alt="Bars: error of raw and of refined corners per detector, as in the table",
            caption="Distance between a detected corner and the true one.",
        ),
        gallery.add(
            "refinement_poses",
            poses,
            alt="Bars: position error of the robot with raw and with refined corners per detector",
            caption="What the filter makes of them, corners only, first seed.",
        ),
    ]
