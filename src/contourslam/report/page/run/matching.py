"""How well scans and landmarks fitted, over time."""

from contourslam.report.page.album import embedded
from contourslam.report.page.markup import Section, figure
from contourslam.report.page.run.values import RunValues
from contourslam.report.svg.series import matching_drawing


def section(values: RunValues) -> Section | None:
    """Give the section; None where nothing was matched."""
    quality, corrected = values.result.quality is not None, bool((values.result.nis_dof > 0).any())
    if not (quality or corrected):
        return None
    said = []
    if quality:
        said.append("Quality: how well each scan's contours fitted the local map, 0 where nothing matched.")
    if corrected:
        said.append(
            "NIS: the innovation of the landmarks against what the filter expected; far above 1 it is too sure."
        )
    picture = embedded(
        matching_drawing(values.result),
        alt=" and ".join(["matching quality"] * quality + ["normalised innovation squared"] * corrected) + " over time",
        caption=" ".join([*said, "Lines are running medians, bands hold 90 % of the scans."]),
    )
    return Section("matching", "Matching over time", figure(picture))
