"""The trajectory against known relative poses: in numbers, over time and over the map."""

from typing import Any

from contourslam.report.page.album import drawn
from contourslam.report.page.markup import Cell, Row, Section, paragraph, table
from contourslam.report.page.run.facts import error_facts
from contourslam.report.page.run.values import RunValues, count, degrees, length
from contourslam.report.svg.series import relation_drawing
from contourslam.report.svg.way import error_map_drawing

_HEADERS = ("trajectory", "mean", "sd", "median", "max", "rotation, mean", "rotation, median")

_WORDS = (
    "Good errors lie flat and far below raw odometry's, whose error grows with the way between two times. A peak "
    "in time that is a spot on the map is a place where the map is off; errors everywhere tell of a loop left open."
)


def section(values: RunValues) -> Section | None:
    """Give the section; None without relations."""
    judged, metrics = values.relations, values.metrics
    if judged is None or not len(judged.stamps):
        return None
    rows = [_row("estimate" if judged.online is None else "refined at the end", metrics["relations"])]
    errors = {"estimate": judged.estimate.translation}
    if judged.online is not None:
        rows.append(_row("online, as known at the time", metrics["online_relations"]))
        errors["online"] = judged.online.translation
    rows.append(_row("raw odometry", metrics["odometry_relations"], aside=True))
    errors["raw odometry"] = judged.odometry.translation
    caption = f"Error over {count(len(judged.stamps), 'known relative pose')} (Kuemmerle et al. 2009)"
    later = judged.stamps[:, 1]
    over_time = drawn(
        relation_drawing(later - values.begin, errors),
        kind="chart",
        name="relation-errors",
        alt="Error of each relation over time on a logarithmic scale: " + ", ".join(errors),
        caption="Each relation at its second time, on a logarithmic scale; errors below 1 mm are drawn at 1 mm.",
    )
    over_map = drawn(
        error_map_drawing(values.result, later, judged.estimate.translation),
        kind="map",
        name="relation-map",
        facts=error_facts(values, later, judged.estimate.translation),
        alt="Map with a dot for each relation where the robot was at its second time, coloured by its error",
        caption="The same errors at the place where the robot was at the second time, the largest on top.",
    )
    words = "relation_errors.csv beside this page holds the error of every relation."
    outside = judged.estimate.outside
    if outside:
        words += f" {count(outside, 'relation')} lie beyond the ends of the trajectory, and their errors say so."
    body = paragraph(_WORDS) + table(caption, _HEADERS, rows) + over_time + over_map + paragraph(words, "note")
    return Section("relations", "Error against known relative poses", body)


def _row(name: str, errors: dict[str, Any], *, aside: bool = False) -> Row:
    translation, rotation = errors["translation"], errors["rotation"]
    cells = [Cell(length(translation[key])) for key in ("mean", "sd", "median", "max")]
    return Row(name, [*cells, *(Cell(degrees(rotation[key])) for key in ("mean", "median"))], aside)
