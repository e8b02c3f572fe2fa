"""Whether the filter knows how wrong it is, and how often landmarks are missed."""

from contourslam.experiments.replays import MODES, Mode
from contourslam.experiments.study import Study
from contourslam.report.comparison_metrics import mean
from contourslam.report.figures.errors import nees_figure
from contourslam.report.figures.style import label
from contourslam.report.page.common import COORDINATES, MODE_NAMES, Gallery, percent, spread
from contourslam.report.page.markup import Cell, Picture, Row, Section, pair, table

_HEADERS = ("Detector", "NEES (ideal 3)", "NIS (ideal 1)", "x in 2σ", "y in 2σ", "θ in 2σ", "false negatives")


def section(study: Study, gallery: Gallery) -> Section:
    """Give the section; every study has it."""
    parts = []
    for mode in MODES:
        rows = []
        for name, values in study.comparison.table(mode).items():
            inside = values.get("inside_two_sigma") or {}
            shares = [Cell(percent(mean(inside.get(key)))) for key in COORDINATES]
            rates = [spread(values.get("nees"), 2), spread(values.get("nis"), 2)]
            rows.append(Row(label(name), [*rates, *shares, Cell(percent(mean(values.get("fnr"))))]))
        if rows:
            caption = f"Consistency, {MODE_NAMES[mode]}; a consistent filter has 95 % inside 2σ"
            parts.append(table(caption, _HEADERS, rows))
    pictures = [picture for mode in MODES if (picture := _picture(study, gallery, mode))]
    return Section("consistency", "Consistency and false negatives", "\n".join(parts) + pair(pictures))


def _picture(study: Study, gallery: Gallery, mode: Mode) -> Picture | None:
    comparison = study.comparison
    curves = {name: comparison.nees(name, mode) for name in comparison.detectors}
    known = {name: curve for name, curve in curves.items() if curve is not None and len(curve.average)}
    first = next((run for name in known if (run := comparison.first(name, mode)) is not None), None)
    if first is None:
        return None
    length = min([len(first.stamps), *(len(curve.average) for curve in known.values())])
    one = next(iter(known.values()))
    drawn = nees_figure(
        first.stamps[:length] - first.stamps[0],
        {name: curve.average[:length] for name, curve in known.items()},
        bounds=(one.lower, one.upper),
        runs=one.runs,
    )
    return gallery.add(
        f"nees_{mode}",
        drawn,
        alt=f"NEES of the pose over time, {MODE_NAMES[mode]}, one line a detector, beside its 95 % bounds",
        caption=f"NEES of the pose, {MODE_NAMES[mode]}, mean over the seeds; the band holds 95 % of a consistent "
        "filter's values. Below it the filter is too cautious, above it too sure.",
    )
