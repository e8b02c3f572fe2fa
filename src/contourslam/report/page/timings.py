"""How fast it is, and where the time goes."""

from contourslam.experiments.replays import MODES, Mode
from contourslam.experiments.study import Study
from contourslam.report.comparison_metrics import mean
from contourslam.report.figures.bars import timing_figure
from contourslam.report.figures.style import label
from contourslam.report.page.common import MODE_NAMES, Gallery, spread
from contourslam.report.page.markup import Picture, Row, Section, pair, table


def section(study: Study, gallery: Gallery) -> Section:
    """Give the section; every study has it."""
    tables = {mode: study.comparison.table(mode) for mode in MODES}
    rows = [
        Row(label(name), [spread(tables[mode].get(name, {}).get("scans_per_second"), 0) for mode in MODES])
        for name in study.comparison.detectors
    ]
    headers = ["Detector", *(MODE_NAMES[mode] for mode in MODES)]
    numbers = table("Scans per second on one core, from deskew to map, after warm-up", headers, rows)
    pictures = [picture for mode in MODES if (picture := _picture(study, gallery, mode))]
    return Section("timings", "Timings", numbers + pair(pictures))


def _picture(study: Study, gallery: Gallery, mode: Mode) -> Picture | None:
    stages = {}
    for name, found in study.comparison.table(mode).items():
        scans = mean(found["scans"]) or 1.0
        stages[name] = {stage: (mean(time) or 0.0) / scans for stage, time in (found.get("seconds") or {}).items()}
    if not any(stages.values()):
        return None
    first = next((run for name in stages if (run := study.comparison.first(name, mode)) is not None), None)
    order = () if first is None else tuple(first.seconds)  # in the order in which a scan passes through them
    return gallery.add(
        f"timings_{mode}",
        timing_figure(stages, order),
        alt=f"Stacked bars: milliseconds per scan and stage, {MODE_NAMES[mode]}, one bar a detector",
        caption=f"Time per scan, {MODE_NAMES[mode]}, stage by stage.",
    )
