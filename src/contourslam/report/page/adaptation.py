"""Each detector as its source has it, against the same adapted to range noise."""

from contourslam.experiments.study import Study
from contourslam.report.figures.bars import pair_figure
from contourslam.report.figures.style import label
from contourslam.report.page.common import COORDINATES, Gallery, number, percent, position
from contourslam.report.page.markup import Cell, Row, Section, figure, paragraph, table

_KINDS = ("as its source has it", "adapted to range noise")


def section(study: Study, gallery: Gallery) -> Section | None:
    """Give the section; None where the experiment was left out."""
    part = study.adaptation
    both = [] if part is None else [name for name in part.faithful if name in part.adapted]
    if part is None or not both:
        return None
    drawn = pair_figure(
        {name: position(part.faithful[name]) for name in both},
        {name: position(part.adapted[name]) for name in both},
        names=_KINDS,
        ylabel="position RMSE (cm)",
        scale=100.0,
    )
    picture = gallery.add(
        "adaptation",
        drawn,
        alt="Bars: position error of each detector as its source has it and adapted, as in the table",
        caption="Corners only, first seed.",
    )
    rows = []
    for name in both:
        for kind, run in zip(_KINDS, (part.faithful[name], part.adapted[name]), strict=True):
            errors = [Cell(number((run["rmse"] or {}).get(key))) for key in COORDINATES]
            rows.append(Row(f"{label(name)}, {kind}", [*errors, Cell(percent(run["fnr"]))]))
    headers = ["Detector", "x (m)", "y (m)", "θ (rad)", "false negatives"]
    words = paragraph(
        "Range noise forces adaptations on some detectors, such as a least support or resampling by arc length. "
        "Here is each detector exactly as its source has it, and as it is used in the rest of this report."
    )
    numbers = table("One drive, corners only", headers, rows)
    return Section("adaptation", "Faithful and adapted detectors", words + figure(picture) + numbers)
