"""What detectors and rooms are called in figures and tables."""

LABELS = {
    "matched_filter": "matched filter",
    "wu": "Wu",
    "teh_chin": "Teh-Chin",
    "curvature_scale_space": "CSS",
}


def label(name: str) -> str:
    """Name of a detector or room as readers are shown it."""
    return LABELS.get(name, name.replace("_", " "))
