"""The tables of the report, row by row."""

import math
from collections.abc import Iterable, Sequence

from contourslam.evaluation.paired_tests import FEWEST
from contourslam.report.naming import label
from contourslam.report.page.markup import Cell, Row
from contourslam.report.paper import TABLE_I as PAPER
from contourslam.report.sweep.content import Table
from contourslam.report.sweep.findings import Comparison
from contourslam.report.sweep.measures import MEASURES, TABLE_I, Measure
from contourslam.report.sweep.statistics import Pair, Tests, summary, wheels
from contourslam.report.sweep.values import Condition, Summary, Sweep

_NO_INTERVAL = ("nees", "time")
_BY_POSES, _BY_RELATIONS = ("position", "heading"), ("relations", "turns")
_PAPER = (("x", 100.0, 1), ("y", 100.0, 1), ("theta", 1e3, 0))


def table_one(sweep: Sweep, measures: Sequence[Measure], setting: str, condition: Condition, tested: Tests) -> Table:
    """Detectors by rooms under one condition; `tested` are the pairs in each of the rooms."""
    columns = [MEASURES[name] for name in TABLE_I]
    cells = {
        (room, name): [summary(sweep, column, room, condition, name) for column in columns]
        for room in sweep.rooms
        for name in sweep.detectors
        if sweep.cell(room, condition, name)
    }
    kept = [i for i in range(len(columns)) if any(found[i].known for found in cells.values())]
    rows = []
    for room in sweep.rooms:
        for name in sweep.detectors:
            if (found := cells.get((room, name))) is not None:
                shown = [shown_mean(columns[i], found[i]) for i in kept]
                runs = Cell(str(found[0].runs), f"{found[0].failed} failed" if found[0].failed else "")
                better = [Cell(_beaten(tested[one.name, setting], room, name)) for one in measures]
                rows.append(Row(f"{label(room)}, {label(name)}", [*shown, runs, *better]))
        odometry = [shown_mean(columns[i], wheels(sweep, columns[i], room, condition)) for i in kept]
        if any(cell.text != "–" for cell in odometry):
            rows.append(
                Row(f"{label(room)}, raw odometry", [*odometry, *[Cell("–")] * (1 + len(measures))], aside=True)
            )
    headers = ["room, detector", *(columns[i].column for i in kept), "drives"]
    headers += [f"by {one.short} better than" for one in measures]
    what = "RMSE of position, x, y and heading, and what else was measured"
    means = _mean_over_drives(one for found in cells.values() for one in found)
    caption = f"{label(setting)}, {condition.name}. {what}: {means}"
    return Table(f"table_one_{setting}", caption, headers, rows)


def findings_table(found: Sequence[Comparison], measure: Measure) -> Table:
    """What each comparison shows, in words."""
    rows = [Row(one.name, [Cell(str(one.seeds)), Cell(one.said(measure))]) for one in found]
    caption = f"By the {measure.title}: what the tests show, each line corrected for all pairs of its table"
    return Table(f"findings_{measure.name}", caption, ["setting, drives", "seeds", "shown"], rows)


def paper_table() -> Table:
    """The paper's own."""
    rows = [
        Row(label(name), [Cell(f"{scale * row[key]:.{digits}f}") for key, scale, digits in _PAPER])
        for name, row in PAPER.items()
    ]
    caption = "The paper's Table I: RMSE of one drive through one room, replayed once per detector"
    return Table("paper", caption, ["detector", "x (cm)", "y (cm)", "heading (mrad)"], rows)


def cells_table(sweep: Sweep, measure: Measure, setting: str) -> Table:
    """Every cell of a setting by one measure."""
    cells = {
        (room, condition): [
            *(summary(sweep, measure, room, condition, name) for name in sweep.detectors),
            wheels(sweep, measure, room, condition),
        ]
        for room in sweep.rooms
        for condition in sweep.conditions(setting)
    }
    rows = [
        Row(f"{label(room)}, {condition.name}", [shown_mean(measure, one) for one in found])
        for (room, condition), found in cells.items()
    ]
    means = _mean_over_drives(one for found in cells.values() for one in found)
    caption = f"{label(setting)}: {measure.heading}, {means}"
    return Table(f"cells_{setting}", caption, ["cell", *map(label, sweep.detectors), "raw odometry"], rows)


def pairs_table(found: Sequence[Pair], measure: Measure, name: str, caption: str) -> Table:
    """Every pair with its test."""
    effect = "first minus second" + ("" if measure.ratio else f" ({measure.step})")
    unit = " %" if measure.ratio else ""
    lost = any(pair.lost for pair in found)
    headers = [
        "pair",
        f"{effect}, median",
        "mean, 95 % interval",
        "first smaller in",
        "seeds",
        "p",
        "p after Holm",
        "shown",
    ]
    rows = []
    for pair in found:
        test, bounds = pair.test, (pair.interval.low, pair.interval.high)
        known = math.isfinite(pair.interval.low)
        place = f"{label(pair.place)}: " if pair.place else ""
        cells = [
            Cell(effect_text(pair, measure)),
            Cell(" to ".join(_signed(pair, measure, end) for end in bounds) + unit if known else "–"),
            Cell("–" if math.isnan(test.share) else f"{100 * test.share:.0f} %"),
            Cell(str(test.seeds)),
            Cell(p_text(test.p)),
            Cell(p_text(test.corrected)),
            Cell(f"{label(pair.better)} is better" if pair.better else test.verdict, better=bool(pair.better)),
        ]
        if lost:
            cells.append(Cell(str(pair.lost)))
        rows.append(Row(f"{place}{label(pair.first)} and {label(pair.second)}", cells))
    return Table(name, caption, [*headers, "failed runs"] if lost else headers, rows)


def matrix_table(sweep: Sweep, found: Sequence[Pair], name: str, caption: str) -> Table:
    """Share of the seeds with which the detector of a row is better than that of a column."""
    shares = {}
    for pair in found:
        shares[pair.first, pair.second] = pair.test.share, pair.better == pair.first
        shares[pair.second, pair.first] = 1.0 - pair.test.share, pair.better == pair.second
    rows = []
    for one in sweep.detectors:
        cells = []
        for other in sweep.detectors:
            share, better = shares.get((one, other), (math.nan, False))
            cells.append(Cell("–" if math.isnan(share) else f"{100 * share:.0f} %", "better" if better else "", better))
        rows.append(Row(label(one), cells))
    return Table(name, caption, ["better than", *map(label, sweep.detectors)], rows)


def logs_table(sweep: Sweep) -> Table:
    """Recordings: one drive each, raw odometry beside, by what is known of any of them."""
    known = {
        name
        for name in (*_BY_POSES, *_BY_RELATIONS)
        if any(math.isfinite(MEASURES[name].of(run.row)) for run in sweep.recorded)
    }
    by_poses = [name for name in _BY_POSES if name in known]
    by_relations = [name for name in _BY_RELATIONS if name in known or not by_poses]
    measures = [MEASURES[name] for name in (*by_poses, *by_relations)]
    headers = ["recording, setting, detector", *(measure.column for measure in measures), MEASURES["time"].column]
    rows = []
    for place in dict.fromkeys(run.drive.place for run in sweep.recorded):
        runs = [run for run in sweep.recorded if run.drive.place == place]
        for run in runs:
            name = f"{place}, {label(run.condition.setting)}, {label(run.detector)}"
            if run.error:
                rows.append(Row(name, [Cell("failed"), *[Cell("–")] * len(measures)]))
            else:
                shown = [*measures, MEASURES["time"]]
                rows.append(Row(name, [Cell(measure.text(measure.of(run.row))) for measure in shown]))
        if whole := [run for run in runs if not run.error]:
            odometry = [Cell(measure.text(measure.of_odometry(whole[0].row))) for measure in measures]
            rows.append(Row(f"{place}, raw odometry", [*odometry, Cell("–")], aside=True))
    against = ["RMSE against the true poses that a recording holds"] * bool(by_poses)
    against += ["mean error over known relative poses"] * bool(by_relations)
    return Table("logs", f"Recordings: {', and '.join(against)}; one drive each", headers, rows)


def failures_table(sweep: Sweep) -> Table:
    """Every failed run, those of one cause together."""
    causes: dict[tuple[str, str, str, str], int] = {}
    for run in sweep.failed:
        setting = run.condition.setting
        where = f"{setting}, {run.condition.name}" if run.simulated else setting
        key = run.drive.place, run.detector, where, run.error
        causes[key] = causes.get(key, 0) + 1
    rows = [
        Row(f"{label(place)}, {label(name)}", [Cell(where), Cell(str(count)), Cell(error)])
        for (place, name, where, error), count in causes.items()
    ]
    return Table("failures", "Failed runs by their cause", ["place, detector", "condition", "runs", "cause"], rows)


def _mean_over_drives(found: Iterable[Summary]) -> str:
    """What the numbers of a table are: with an interval only where the drives are enough for one."""
    if any(math.isfinite(one.interval.low) for one in found):
        return "mean over the drives and its 95 % interval"
    return f"mean over the drives; under {FEWEST} drives it gets no interval"


def shown_mean(measure: Measure, found: Summary) -> Cell:
    """A mean with its interval in small print."""
    interval = found.interval
    if not found.known:
        return Cell("–")
    if math.isnan(interval.low) or measure.name in _NO_INTERVAL:
        return Cell(measure.text(interval.mean))
    return Cell(measure.text(interval.mean), f"{measure.text(interval.low)} to {measure.text(interval.high)}")


def _beaten(found: Sequence[Pair], place: str, name: str) -> str:
    """Detectors that one is shown to be better than at a place."""
    won = [pair for pair in found if pair.place == place and pair.better == name]
    return ", ".join(label(pair.second if pair.first == name else pair.first) for pair in won) or "–"


def effect_text(pair: Pair, measure: Measure) -> str:
    """Median difference with its sign."""
    if not math.isfinite(pair.effect):
        return "–" if math.isnan(pair.effect) else f"{label(pair.first if pair.effect > 0 else pair.second)} failed"
    return _signed(pair, measure, pair.test.median) + (" %" if pair.ratio else "")


def _signed(pair: Pair, measure: Measure, difference: float) -> str:
    digits = 1 if pair.ratio else measure.digits + 1
    value = round((100.0 if pair.ratio else measure.scale) * pair.plain(difference), digits)
    return f"{value:+.{digits}f}".replace("-", "−") if value else f"{0:.{digits}f}"


def p_text(p: float) -> str:
    """A p-value as journals have it."""
    return "–" if math.isnan(p) else f"{p:.3f}" if p >= 0.001 else "< 0.001" if p >= 1e-4 else f"{p:.0e}"
