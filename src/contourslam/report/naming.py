"""What detectors and rooms are called in figures and tables, and the colours of detectors."""

from contourslam.report.svg.colours import BLUE, GREEN, PURPLE, VERMILION

LABELS = {
    "matched_filter": "matched filter",
    "wu": "Wu",
    "teh_chin": "Teh-Chin",
    "curvature_scale_space": "CSS",
}
COLOURS = {"matched_filter": BLUE, "wu": GREEN, "teh_chin": VERMILION, "curvature_scale_space": PURPLE}
"""Of the paper's four; others get what is left."""


def label(name: str) -> str:
    """Name of a detector or room as readers are shown it."""
    return LABELS.get(name, name.replace("_", " "))
