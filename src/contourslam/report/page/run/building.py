"""The map, the way driven and the loops that were closed."""

from contourslam.report.page.album import drawn
from contourslam.report.page.markup import Section, paragraph
from contourslam.report.page.run.facts import map_facts
from contourslam.report.page.run.values import RunValues, count
from contourslam.report.svg.way import map_drawing

_WORDS = (
    "In a good map each wall is one straight line, corners sit where walls meet, and the way returns along itself. "
    "Walls drawn twice side by side, or a bent corridor, tell of a pose that was lost or a loop that was missed."
)


def section(values: RunValues) -> Section:
    """Give the section; every run has it."""
    result = values.result
    x, y = result.poses[:, 0], result.poses[:, 1]
    caption = (
        "Corners (filled where matter fills their angle) and walls as mapped, and the way driven, "
        f"{x.max() - x.min():.0f} by {y.max() - y.min():.0f} m."
    )
    if result.loops:
        caption += (
            f" The {count(len(result.loops), 'loop')} lead from the later pose, dotted, to the earlier one that saw "
            "the same place; the colour says how far the estimate was off before."
        )
    figure = drawn(
        map_drawing(result, layers=True),
        kind="map",
        name="map",
        alt=f"Map with {count(len(result.corner_map.ids), 'corner')}, {count(len(result.wall_map.ids), 'wall')}, "
        f"the way driven and {count(len(result.loops), 'loop')}",
        caption=caption,
        facts=map_facts(values, result.poses),
    )
    return Section("map", "Map", paragraph(_WORDS) + figure)
