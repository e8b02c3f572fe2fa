"""The parts of the report, in their order."""

import json
from collections.abc import Sequence

from contourslam.report.naming import label
from contourslam.report.sweep import findings, tables
from contourslam.report.sweep.content import Chart, Charts, Code, Folded, Heading, Item, Part, Points, Table, Words
from contourslam.report.sweep.figures import AxisName, curves, curves_drawing
from contourslam.report.sweep.measures import MEASURES, Measure
from contourslam.report.sweep.statistics import Pair, pairs, summary
from contourslam.report.sweep.values import Sweep, once

HOW = (
    "The unit of chance is the drive, a room and a seed: what was measured on one drive under several conditions is "
    "averaged before it is tested, so that it counts once. Pairs of detectors are tested by the Wilcoxon signed-rank "
    "test, exact and two-sided, over the drives that both were run on, and the p-values of all pairs in a table are "
    "corrected by Holm's method: the chance that a table holds any false “better” is at most 5 %. Where a pair does "
    "not pass, no difference is shown, which is not to say that there is none. A failed run counts as worse than any "
    "finished one. Intervals are BCa bootstrap intervals of the mean (5000 draws, seed 0): called 95 %, they hold the "
    "true mean some 92 times in 100 with 20 drives, and less often where errors are skewed."
)
TIMES = (
    "Times per scan were taken while other runs, and maybe other programs, worked on the same machine: they are good "
    "for the order of magnitude and are not comparable. BENCHMARK.md has times of a quiet machine."
)


class Parts:
    """All parts of the report about one sweep by one measure.

    Parameters
    ----------
    sweep : Sweep
    measure : Measure
        What simulated drives are compared by.
    command : str
        The command line of the report.
    """

    def __init__(self, sweep: Sweep, measure: Measure, command: str = "") -> None:
        self.sweep, self.measure, self.command = sweep, measure, command
        rooms = [(room, [room]) for room in sweep.rooms]
        self.by_room: dict[str, list[Pair]] = {}
        self.together: dict[str, list[Pair]] = {}
        for setting in sweep.settings:
            centre = sweep.centre(setting)
            self.by_room[setting] = [] if centre is None else pairs(sweep, measure, rooms, [centre])
            self.together[setting] = pairs(sweep, measure, [("", sweep.rooms)], sweep.conditions(setting))

    def all(self) -> list[Part]:
        """Give those that there is something to say in."""
        found = [
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
        return [part for part in found if part.items]

    def sentences(self) -> list[str]:
        """What can be said of the simulated drives."""
        sweep, said = self.sweep, []
        for setting in sweep.settings:
            if centre := sweep.centre(setting):
                said.append(findings.of_rooms(centre, self.by_room[setting], sweep.rooms, self.measure))
            conditions = len(sweep.conditions(setting))
            if conditions > 1 or len(sweep.rooms) > 1:
                found = self.together[setting]
                said.append(findings.of_all(setting, found, conditions, len(sweep.rooms), self.measure))
        if (beside := self._beside_the_paper()) is not None:
            said.append(beside)
        return said

    def _beside_the_paper(self) -> str | None:
        sweep = self.sweep
        centre = sweep.centre(sweep.settings[0]) if sweep.settings else None
        if centre is None or self.measure.name != "position":
            return None
        room = sweep.rooms[0]
        means = {name: summary(sweep.cell(room, centre, name), self.measure).interval.mean for name in sweep.detectors}
        return findings.beside_the_paper(means, room)

    def _findings(self) -> Part:
        items: list[Item] = []
        if self.sweep.simulated:
            items = [Words(f"By the {self.measure.title}:"), Points(self.sentences()), Words(HOW, note=True)]
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
            said.append(f"Real recordings: {', '.join(names)}; {', '.join(settings)}.")
        return Part("design", "What was run", [Points(said)])

    def _varied(self, setting: str) -> str:
        """What a setting was run on."""
        sweep = self.sweep
        mine = [run for run in sweep.simulated if run.condition.setting == setting]
        rooms = once(run.drive.place for run in mine)
        seeds = {len({run.drive.seed for run in mine if run.drive.place == room}) for room in rooms}
        noise = sorted({100.0 * run.condition.noise for run in mine if run.condition.noise is not None})
        lengths = sorted({run.row.get("duration") or 0.0 for run in mine})
        parts = (
            ", ".join(map(label, rooms)),
            " or ".join(map(str, sorted(seeds))) + " seeds a room",
            "drives of " + ", ".join(f"{each:g} s" if each else "two laps, 180 s at least" for each in lengths),
            "noise " + (", ".join(f"{value:g}" for value in noise) + " cm" if noise else "the lidar's own"),
            ", ".join(map(str, sorted({run.condition.beams for run in mine if run.condition.beams is not None})))
            + " beams",
            findings.counted(len(sweep.conditions(setting)), "condition"),
        )
        return f"{label(setting)}: {'; '.join(parts)}."

    def _table_one(self) -> Part:
        items: list[Item] = [
            tables.table_one(self.sweep, self.measure, setting, centre, self.by_room[setting])
            for setting in self.sweep.settings
            if (centre := self.sweep.centre(setting)) is not None
        ]
        if items:
            items += [tables.paper_table(), Words(TIMES, note=True)]
        return Part("table-one", "Table I", items)

    def _along(self, axis: AxisName, title: str) -> Part:
        items: list[Item] = []
        for setting in self.sweep.settings:
            charts = [chart for room in self.sweep.rooms if (chart := self._chart(room, setting, axis)) is not None]
            if charts:
                centre = self.sweep.centre(setting)
                fixed = "" if centre is None else f"{centre.beams} beams" if axis == "noise" else _noise(centre.noise)
                items += [Heading(f"{label(setting)}, {fixed}"), Charts(charts)]
        if items:
            items.append(Words("Points: means over the drives; strokes: their 95 % intervals; logarithmic.", note=True))
            if axis == "noise":
                folded = [tables.cells_table(self.sweep, self.measure, setting) for setting in self.sweep.settings]
                items.append(Folded("Every cell as a table", folded))
        return Part(axis, title, items)

    def _chart(self, room: str, setting: str, axis: AxisName) -> Chart | None:
        found = curves(self.sweep, self.measure, room, setting, axis)
        if found is None:
            return None
        first, last = found.conditions[0].name, found.conditions[-1].name
        values = ", ".join(
            f"{label(name)} {self.measure.text(cells[0].interval.mean)} to {self.measure.text(cells[-1].interval.mean)}"
            for name, cells in found.detectors.items()
        )
        what = f"{self.measure.heading} in the {label(room)}, {label(setting)}"
        return Chart(
            f"{axis}_{setting}_{room}".replace(", ", "_").replace(" ", "_").replace("/", "_"),
            curves_drawing(found, self.measure, label(room)),
            alt=f"{what}, from {first} to {last}: {values}",
            caption=f"{label(room)}, {label(setting)}",
        )

    def _pairs(self) -> Part:
        sweep, items = self.sweep, list[Item]()
        if len(sweep.detectors) < 2:
            return Part("pairs", "Detectors in pairs", items)
        for setting in sweep.settings:
            together, apart = self.together[setting], self.by_room[setting]
            count = len(sweep.conditions(setting))
            caption = f"{label(setting)}: share of the drives in which the row's detector has the smaller error"
            over = f"{label(setting)}, all rooms and {findings.counted(count, 'condition')}, by {self.measure.title}"
            items += [
                tables.matrix_table(sweep, together, f"matrix_{setting}", caption),
                tables.pairs_table(together, self.measure, f"pairs_{setting}", over),
            ]
            centre = sweep.centre(setting)
            if centre is not None and apart:
                each = f"{label(setting)}, {centre.name}, by {self.measure.title}: corrected for all {len(apart)} pairs"
                table = tables.pairs_table(apart, self.measure, f"pairs_by_room_{setting}", each)
                items.append(Folded(f"{label(setting)}: room by room", [table]))
        return Part("pairs", "Detectors in pairs", items)

    def _logs(self) -> Part:
        if not self.sweep.recorded:
            words = Words("No real recording is among these results.")
            return Part("logs", "Real recordings", [words])
        table: Table = tables.logs_table(self.sweep, [MEASURES["relations"], MEASURES["turns"]])
        words = Words(
            "A recording is one drive and the replay of it has no chance in it: one number each, no interval, no test. "
            "A difference between two detectors here can be luck.",
            note=True,
        )
        return Part("logs", "Real recordings", [table, words])

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


def _noise(noise: float | None) -> str:
    return "the lidar's own noise" if noise is None else f"{100 * noise:g} cm of noise"


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
