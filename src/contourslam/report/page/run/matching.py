"""How well scans and landmarks fitted, and how sure of itself the estimate was, over time."""

from contourslam.report.page.album import drawn
from contourslam.report.page.markup import Section, paragraph
from contourslam.report.page.run.values import RunValues
from contourslam.report.svg.series import matching_drawing

_NIS = (
    (
        "NIS: the innovation of the landmarks against what the filter expected, per degree of freedom.",
        "A good NIS scatters about 1; for long far above, the filter is too sure, far below, too cautious.",
    ),
    (
        "NIS: how far the contours take the pose from where the wheels had it, per degree of freedom.",
        "NIS is small where the wheels are good, for they are taken for worse than that; where it rises, wheels slip, "
        "and where it is high from the first turn, the lidar is not where it is said to be, or the clocks differ.",
    ),
)  # of the filter, of the graph


def section(values: RunValues) -> Section | None:
    """Give the section; None where nothing was matched."""
    quality, corrected = values.result.quality is not None, bool((values.result.nis_dof > 0).any())
    if not (quality or corrected):
        return None
    good, said = [], []
    if quality:
        good.append("Good matching stays near 1; where it falls for long, the scans saw little that they knew.")
        said.append("Quality: how well each scan's contours fitted the local map, 0 where nothing matched.")
    if corrected:
        what, how = _NIS[values.result.back_end == "graph"]
        good.append(how)
        said.append(what)
    good.append("The stated σ should fall where known places are seen again, and not grow without end.")
    said.append("Position σ: the larger axis of what the estimate states of itself.")
    figure = drawn(
        matching_drawing(values.result),
        kind="chart",
        name="matching",
        alt=", ".join(
            ["matching quality"] * quality + ["normalised innovation squared"] * corrected + ["position sigma"]
        )
        + " over time",
        caption=" ".join([*said, "Lines are running medians, bands hold 90 % of the scans."]),
    )
    return Section("matching", "Matching over time", paragraph(" ".join(good)) + figure)
