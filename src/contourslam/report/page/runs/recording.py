"""Runs of one recording over one another: trajectories, their differences over time, errors and maps."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contourslam.evaluation.bootstrap import PairedDifference
from contourslam.geometry.poses import transform
from contourslam.report.figures.paper_errors import differences_figure, distribution_figure
from contourslam.report.figures.paper_maps import maps_figure, ways_figure
from contourslam.report.figures.style import DOUBLE
from contourslam.report.page.common import number
from contourslam.report.page.markup import Cell, Row, Section, figure, heading, pair, paragraph
from contourslam.report.page.run.values import degrees
from contourslam.report.page.runs.values import PX, RunsReport
from contourslam.report.runs_groups import Group, Pair
from contourslam.slam.landmark_map import CornerMap, WallMap

Floats = NDArray[np.float64]

_UNITS = {"m": ("mm", 1e3), "rad": ("mrad", 1e3)}


def section(report: RunsReport, group: Group) -> Section | None:
    """Give the section; None for a single run, which stands beside no other."""
    if len(group.runs) < 2:
        return None
    title = "Over one another" if len(report.groups) == 1 else f"Over one another: {group.recording}"
    parts = [paragraph(_alignment(group)), _ways(report, group), *_errors(report, group), _maps(report, group)]
    return Section(report.name("together", group), title, "\n".join(parts))


def _alignment(group: Group) -> str:
    """Say how the runs came into one world."""
    first = group.runs[0].name
    if all(run.result.truth is not None and not run.aligned for run in group.runs):
        return "All runs stand as they are in the world of the recording's true poses; none was moved."
    moved = []
    for run, motion in zip(group.runs[1:], group.motions[1:], strict=True):
        moved.append(f"{run.name} by {_length(math.hypot(motion[0], motion[1]))} and {degrees(float(motion[2]))}")
    return (
        f"Each run was moved as a whole, without scale, so that its positions fit those of {first} best in the least "
        f"squares at the scans that both have: {'; '.join(moved)}. The errors in the tables do not depend on it."
    )


def _length(value: float) -> str:
    return f"{value:.2f} m" if value >= 1.0 else f"{100 * value:.1f} cm" if value >= 0.01 else f"{1000 * value:.2g} mm"


def _ways(report: RunsReport, group: Group) -> str:
    first, names = group.runs[0], ", ".join(run.name for run in group.runs)
    ways = {run.name: group.moved(at) for at, run in enumerate(group.runs)}
    differences = group.differences()
    over_one_another = report.gallery.add(
        report.name("trajectories", group),
        ways_figure(ways, first.result.wall_map.end_points),
        alt=f"Trajectories of {names} over the walls that {first.name} mapped",
        caption=f"Trajectories over one another; grey: walls as {first.name} mapped them.",
        scale=PX,
    )
    said = "; ".join(
        f"{name} {_length(float(one.position.mean()))} on average, {_length(float(one.position.max()))} at most"
        for name, one in differences.items()
    )
    apart = report.gallery.add(
        report.name("differences", group),
        differences_figure({name: (one.times, one.position, one.heading) for name, one in differences.items()}),
        alt=f"Distance and turn of each run's pose from that of {first.name} over time: {said}",
        caption=f"How far each pose lies from that of {first.name} at the same scan, medians of 150 pieces of the "
        f"drive: {said}. A difference is no error: it does not say which one is right.",
        scale=PX,
    )
    return pair([over_one_another, apart])


def _errors(report: RunsReport, group: Group) -> list[str]:
    pictures = []
    for errors in group.errors():
        what, ending = errors.measure, " m" if errors.unit == "m" else errors.unit
        medians = ", ".join(f"{run} {np.nanmedian(values):.4f}{ending}" for run, values in errors.of.items())
        pictures.append(
            report.gallery.add(
                report.name(errors.name, group),
                distribution_figure(errors),
                alt=f"Share of {what}s below a value, one line a run; medians: {medians}",
                caption=f"{what[0].upper()}{what[1:]}: share below a value. Medians: {medians}.",
                scale=PX,
            )
        )
    pairs = group.pairs()
    if not (pictures or pairs):
        return [paragraph("None of these runs was judged by true poses or by known relative poses.", "note")]
    return [heading("Errors"), pair(pictures), *(_pairs(report, group, pairs) if pairs else [])]


def _pairs(report: RunsReport, group: Group, pairs: list[Pair]) -> list[str]:
    tables = []
    for measure in dict.fromkeys(one.measure for one in pairs):
        chosen = [one for one in pairs if one.measure == measure]
        unit, scale = _UNITS[chosen[0].unit]
        headers = ["runs", f"mean ({unit})", "low", "high", "first smaller in", "pairs", "the interval says"]
        rows = []
        for one in chosen:
            found = one.difference
            cells = [*(number(round(scale * value, 3) + 0.0, 3) for value in (found.mean, found.low, found.high))]
            cells += [f"{100 * found.share:.0f} %", f"{found.count:,}", _verdict(found)]
            rows.append(Row(f"{one.first} − {one.second}", [Cell(cell) for cell in cells]))
        caption = f"First minus second, {measure}: mean difference and its 95 % bootstrap interval"
        caption += "" if len(report.groups) == 1 else f"; {group.recording}"
        name = report.name("difference_of_" + measure.replace(", ", "_").replace(" ", "_"), group)
        tables.append(report.table(name, caption, headers, rows))
    words = (
        "Errors near each other in a drive are alike, so blocks of neighbours are drawn, as long as the root of their "
        "number (2000 draws, seed 0); fewer than 100 pairs give too few blocks for an interval. "
        "The interval tells what other stretches like these of the same drive could have "
        "given. It tells nothing of another building or robot, and of many rows one in twenty is outside by chance. "
        "A difference that is sure may still be too small to matter."
    )
    return [*tables, paragraph(words, "note")]


def _verdict(found: PairedDifference) -> str:
    if math.isnan(found.low):
        return "too few pairs"
    return "first smaller" if found.high < 0.0 else "second smaller" if found.low > 0.0 else "undecided"


def _maps(report: RunsReport, group: Group) -> str:
    maps: dict[str, tuple[WallMap, CornerMap, Floats]] = {}
    for at, (run, motion) in enumerate(zip(group.runs, group.motions, strict=True)):
        walls, corners = run.result.wall_map, run.result.corner_map
        walls = replace(walls, end_points=transform(motion, walls.end_points))
        corners = replace(corners, positions=transform(motion, corners.positions))
        maps[run.name] = walls, corners, group.moved(at)
    sizes = "; ".join(f"{run.name} {len(run.result.corner_map.ids)} corners" for run in group.runs)
    picture = report.gallery.add(
        report.name("maps", group),
        maps_figure(maps, width=DOUBLE, columns=2 if len(maps) in (2, 4) else 3),
        alt=f"Maps of the runs side by side, to one scale: {sizes}",
        caption="Maps side by side, to one scale: walls black, corners as squares (filled: convex), the way blue.",
        scale=150.0,
    )
    return heading("Maps") + figure(picture)
