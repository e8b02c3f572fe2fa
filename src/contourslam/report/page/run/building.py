"""The map, the way driven and the loops that were closed."""

from contourslam.report.page.album import embedded
from contourslam.report.page.markup import Section, figure
from contourslam.report.page.run.values import RunValues, count
from contourslam.report.svg.way import map_drawing


def section(values: RunValues) -> Section:
    """Give the section; every run has it."""
    result = values.result
    x, y = result.poses[:, 0], result.poses[:, 1]
    caption = f"Corners and walls as mapped, and the way driven: {x.max() - x.min():.0f} by {y.max() - y.min():.0f} m."
    if result.loops:
        caption += (
            f" The {count(len(result.loops), 'loop')} lead from the later pose, dotted, to the earlier one that saw "
            "the same place; the colour says how far the estimate was off before."
        )
    picture = embedded(
        map_drawing(result),
        alt=f"Map with {count(len(result.corner_map.ids), 'corner')}, {count(len(result.wall_map.ids), 'wall')}, "
        f"the way driven and {count(len(result.loops), 'loop')}",
        caption=caption,
    )
    return Section("map", "Map", figure(picture))
