"""The parts of the report, in their order."""

import json
import re
from collections.abc import Sequence
from itertools import product

from contourslam.evaluation.paired_tests import FEWEST
from contourslam.report.naming import label
from contourslam.report.sweep import findings, tables
from contourslam.report.sweep.content import Chart, Charts, Code, Folded, Heading, Item, Part, Points, Words
from contourslam.report.sweep.figures import AxisName, curves, curves_drawing
from contourslam.report.sweep.findings import Comparison
from contourslam.report.sweep.measures import Measure
from contourslam.report.sweep.statistics import Tests, pairs, summary
from contourslam.report.sweep.values import Sweep, once

HOW = (
    "The unit of chance is the seed. In a room it makes one drive; its drives in other rooms have the same errors of "
    "the wheels and the same stream of noise, so they are alike and no further evidence. What was measured with one "
    "seed under several conditions and in several rooms is averaged before it is tested: it counts once. Pairs of "
    "detectors are tested by the Wilcoxon signed-rank test, exact and two-sided, over the seeds that both were run "
    "with, and the p-values of all pairs in a table are corrected by Holm's method: the chance that a table holds any "
    "false “better” is at most 5 %. Where a pair does not pass, no difference is shown, which is not to say that there "
    "is none; the interval named there is the widest of the pairs' own, and no bound on all of them at once. "
    "Intervals are BCa bootstrap intervals of the mean (5000 draws, seed 0): called 95 %, they hold the true mean at "
    "least 90 times in 100 with 20 seeds, 84 where errors are strongly skewed. The test is of ranks, the interval of "
    "the mean: a single bad drive moves the second only."
)
LOST = (
    "A failed run counts as worse than any finished one. Such a difference is infinite: the tests take it in, the "
    "intervals leave its seed out."
)
TIMES = (
    "Times per scan were taken while other runs, and maybe other programs, worked on the same machine: they are good "
    "for the order of magnitude and are not comparable. BENCHMARK.md has times of a quiet machine. NEES is that of the "
    "pose, 3 where the stated covariances are right."
)


class Parts:
    """All parts of the report about one sweep.

    Parameters
    ----------
    sweep : Sweep
    measures : sequence of Measure
        What detectors are compared by in simulated rooms; the first one is drawn.
    command : str
        The command line of the report, shown as it stands.

    Raises
    ------
    MissingExtraError
        If SciPy is not installed.
    """

    def __init__(self, sweep: Sweep, measures: Sequence[Measure], command: str = "") -> None:
        self.sweep, self.measures, self.command = sweep, measures, command
        rooms = [(room, [room]) for room in sweep.rooms]
        self.by_room: Tests = {}
        self.over_axes: Tests = {}
        self.together: Tests = {}
        for measure, setting in product(measures, sweep.settings):
            centre = sweep.centre(setting)
            self.by_room[measure.name, setting] = [] if centre is None else pairs(sweep, measure, rooms, [centre])
            every, common = sweep.conditions(setting), sweep.common(setting)
            several = [(room, places) for room, places in rooms if len(sweep.conditions(setting, room)) > 1]
            self.over_axes[measure.name, setting] = pairs(sweep, measure, several, every)
            self.together[measure.name, setting] = pairs(sweep, measure, [("", sweep.rooms)], common)

    def all(self) -> list[Part]:
        """Give all of them; one of which nothing was run has no items."""
        return [
            self._answer(),
            self._findings(),
            self._design(),
            self._table_one(),
            self._along("noise", "Noise"),
            self._along("beams", "Beams"),
            self._pairs(),
            self._logs(),
            self._failures(),
            self._reproduce(),
        ]

    def tested(self, measure: Measure) -> list[Comparison]:
        """All comparisons by a measure: each setting in each room and over its conditions, and in all rooms."""
        sweep, found = self.sweep, []
        for setting in sweep.settings:
            key = measure.name, setting
            if centre := sweep.centre(setting):
                found += [
                    Comparison(setting, f"{label(room)}, {centre.name}", mine)
                    for room in sweep.rooms
                    if (mine := [pair for pair in self.by_room[key] if pair.place == room])
                ]
            found += [
                Comparison(
                    setting, f"{label(room)} over all its {len(sweep.conditions(setting, room))} conditions", mine
                )
                for room in sweep.rooms
                if (mine := [pair for pair in self.over_axes[key] if pair.place == room])
            ]
            common = findings.counted(len(sweep.common(setting)), "condition")
            if sweep.common(setting) and len(sweep.rooms) > 1 and self.together[key]:
                where = f"{findings.counted(len(sweep.rooms), 'room')} and {common} together"
                found.append(Comparison(setting, where, self.together[key]))
        return found

    def sentences(self, measure: Measure) -> list[str]:
        """What can be said of the simulated drives by a measure."""
        return [findings.sentence(one, measure) for one in self.tested(measure)]

    def in_short(self, measure: Measure) -> list[str]:
        """The same in a few sentences, beside what the paper found."""
        found = self.tested(measure)
        return (findings.in_short(found, measure) if found else []) + self._beside_the_paper(measure)

    def _beside_the_paper(self, measure: Measure) -> list[str]:
        if measure.name != "position":
            return []
        sweep, means = self.sweep, {}
        for setting in sweep.settings:
            if centre := sweep.centre(setting):
                cells = {name: summary(sweep, measure, sweep.rooms[0], centre, name) for name in sweep.detectors}
                means[setting] = {name: found.interval.mean for name, found in cells.items()}
        said = findings.beside_the_paper(means, sweep.rooms[0]) if means else None
        return [] if said is None else [said]

    def _answer(self) -> Part:
        items: list[Item] = []
        for measure in self.measures:
            if said := self.in_short(measure):
                items += [Heading(f"By the {measure.title}"), Points(said)]
        return Part("answer", "In short", items)

    def _findings(self) -> Part:
        items: list[Item] = []
        if self.sweep.simulated:
            items += [tables.findings_table(found, one) for one in self.measures if (found := self.tested(one))]
            items.append(Words(HOW, note=True))
        if any(run.simulated for run in self.sweep.failed):
            items.append(Words(LOST, note=True))
        return Part("findings", "What can be said", items)

    def _design(self) -> Part:
        sweep, runs = self.sweep, self.sweep.runs
        done = len(runs) - len(sweep.failed)
        of = "" if sweep.expected in (None, len(runs)) else f" of {sweep.expected:,} that the experiment has"
        said = [f"{len(runs):,} runs{of}: {done:,} finished, {len(sweep.failed):,} failed."]
        said.append(f"Detectors: {', '.join(map(label, sweep.detectors))}.")
        said += [self._varied(setting) for setting in sweep.settings]
        if sweep.recorded:
            names = once(run.drive.place for run in sweep.recorded)
            settings = once(label(run.condition.setting) for run in sweep.recorded)
            said.append(f"Recordings: {', '.join(names)}; {', '.join(settings)}.")
        return Part("design", "What was run", [Points(said)])

    def _varied(self, setting: str) -> str:
        """What a setting was run on."""
        sweep = self.sweep
        mine = [run for run in sweep.simulated if run.condition.setting == setting]
        rooms = once(run.drive.place for run in mine)
        seeds = {len({run.drive.seed for run in mine if run.drive.place == room}) for room in rooms}
        counts = {room: len(sweep.conditions(setting, room)) for room in rooms}
        noise = sorted({100.0 * run.condition.noise for run in mine if run.condition.noise is not None})
        lengths = sorted({run.row.get("duration") or 0.0 for run in mine})
        parts = (
            ", ".join(map(label, rooms)),
            " or ".join(map(str, sorted(seeds))) + (" seed" if seeds == {1} else " seeds") + " a room",
            "drives of " + ", ".join(f"{each:g} s" if each else "two laps, 180 s at least" for each in lengths),
            "noise " + (", ".join(f"{value:g}" for value in noise) + " cm" if noise else "the lidar's own"),
            ", ".join(map(str, sorted({run.condition.beams for run in mine if run.condition.beams is not None})))
            + " beams",
            ", ".join(f"{findings.counted(n, 'condition')} in the {label(room)}" for room, n in counts.items())
            if len(set(counts.values())) > 1
            else findings.counted(len(sweep.conditions(setting)), "condition"),
        )
        return f"{label(setting)}: {'; '.join(parts)}."

    def _table_one(self) -> Part:
        items: list[Item] = [
            tables.table_one(self.sweep, self.measures, setting, centre, self.by_room)
            for setting in self.sweep.settings
            if (centre := self.sweep.centre(setting)) is not None
        ]
        if items:
            items += [tables.paper_table(), Words(TIMES, note=True)]
        return Part("table-one", "Table I", items)

    def _along(self, axis: AxisName, title: str) -> Part:
        first, *others = self.measures
        items = self._drawn(first, axis)
        if items:
            items.append(Words(self._legend(axis), note=True))
        for measure in others:
            if more := self._drawn(measure, axis):
                items.append(Folded(f"By the {measure.title}", more))
        if items and axis == "noise":
            cells = [tables.cells_table(self.sweep, first, setting) for setting in self.sweep.settings]
            items.append(Folded("Every cell as a table", cells))
        return Part(axis, title, items)

    def _legend(self, axis: AxisName) -> str:
        """Say what the drawings of the first measure hold: intervals only where there are drives enough for one."""
        drawn = (
            curves(self.sweep, self.measures[0], room, setting, axis)
            for setting in self.sweep.settings
            for room in self.sweep.rooms
        )
        if any(found is not None and found.intervals for found in drawn):
            return "Points: means over the drives; strokes: their 95 % intervals."
        return f"Points: means over the drives. Under {FEWEST} drives a mean gets no interval, so none is drawn."

    def _drawn(self, measure: Measure, axis: AxisName) -> list[Item]:
        items: list[Item] = []
        for setting in self.sweep.settings:
            drawn = [self._chart(measure, room, setting, axis) for room in self.sweep.rooms]
            charts = [chart for chart in drawn if chart is not None]
            if charts:
                centre = self.sweep.centre(setting)
                fixed = "" if centre is None else f"{centre.beams} beams" if axis == "noise" else centre.noise_name
                items += [Heading(f"{label(setting)}, {fixed}"), Charts(charts)]
        return items

    def _chart(self, measure: Measure, room: str, setting: str, axis: AxisName) -> Chart | None:
        found = curves(self.sweep, measure, room, setting, axis)
        if found is None:
            return None
        first, last = found.conditions[0].name, found.conditions[-1].name
        values = ", ".join(
            f"{label(name)} {measure.text(cells[0].interval.mean)} to {measure.text(cells[-1].interval.mean)}"
            for name, cells in found.detectors.items()
        )
        name = f"{axis}_{setting}_{room}" if measure is self.measures[0] else f"{axis}_{measure.name}_{setting}_{room}"
        return Chart(
            re.sub(r"[^\w.-]+", "_", name),
            curves_drawing(found, measure, label(room)),
            alt=f"{measure.heading} in the {label(room)}, {label(setting)}, from {first} to {last}: {values}",
            caption=f"{label(room)}, {label(setting)}",
        )

    def _pairs(self) -> Part:
        items: list[Item] = []
        if len(self.sweep.detectors) > 1:
            for measure, setting in product(self.measures, self.sweep.settings):
                items += self._pairs_by(measure, setting)
        return Part("pairs", "Detectors in pairs", items)

    def _pairs_by(self, measure: Measure, setting: str) -> list[Item]:
        sweep, of = self.sweep, f"{label(setting)}, by {measure.title}"
        together, apart = self.together[measure.name, setting], self.by_room[measure.name, setting]
        end, common = f"{measure.name}_{setting}", findings.counted(len(sweep.common(setting)), "condition")
        every = f"{of}, {'all rooms' if len(sweep.rooms) > 1 else label(sweep.rooms[0])} and {common}"
        share = f"{every}: share of the seeds with which the row's detector is better"
        table = tables.pairs_table(together, measure, f"pairs_{end}", every)
        items: list[Item] = [tables.matrix_table(sweep, together, f"matrix_{end}", share)]
        items.append(table if measure is self.measures[0] else Folded(f"{of}: the tests", [table]))
        if (centre := sweep.centre(setting)) is not None and apart:
            each = f"{of}, {centre.name}: corrected for all {len(apart)} pairs"
            rooms = tables.pairs_table(apart, measure, f"pairs_by_room_{end}", each)
            items.append(Folded(f"{of}: room by room", [rooms]))
        if over := self.over_axes[measure.name, setting]:
            each = f"{of}, each room over all its conditions: corrected for all {len(over)} pairs"
            axes = tables.pairs_table(over, measure, f"pairs_over_axes_{end}", each)
            items.append(Folded(f"{of}: room by room, over noise and beams", [axes]))
        return items

    def _logs(self) -> Part:
        if not self.sweep.recorded:
            return Part("logs", "Recordings", [])
        table = tables.logs_table(self.sweep)
        words = Words(
            "A recording is one drive and the replay of it has no chance in it: one number each, no interval, no test. "
            "A difference between two detectors here can be luck.",
            note=True,
        )
        return Part("logs", "Recordings", [table, words])

    def _failures(self) -> Part:
        if not self.sweep.failed:
            return Part("failures", "Failures", [Words("No run failed.")])
        return Part("failures", "Failures", [tables.failures_table(self.sweep)])

    def _reproduce(self) -> Part:
        items: list[Item] = [Code(self.command)] if self.command else []
        items.append(Points([f"{name}: {value}" for name, value in _versions(self.sweep).items()]))
        for text in self.sweep.experiments:
            items += [Heading("The experiment"), Code(text.strip(), "toml")]
        return Part("reproduce", "Reproduce this", items)


def _versions(sweep: Sweep) -> dict[str, str]:
    """What the runs were done by; several values where runs differ."""
    found = {
        name: _several(_texts(sweep, column)) for name, column in (("contourslam", "version"), ("python", "python"))
    }
    libraries: dict[str, list[str]] = {}
    for text in _texts(sweep, "libraries"):
        for name, value in json.loads(text).items():
            libraries.setdefault(name, []).append(value)
    return found | {name: _several(values) for name, values in libraries.items()}


def _texts(sweep: Sweep, column: str) -> list[str]:
    return once(str(run.row[column]) for run in sweep.runs if run.row.get(column))


def _several(values: Sequence[str]) -> str:
    return ", ".join(once(values)) or "unknown"
