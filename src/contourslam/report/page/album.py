"""Drawings inside the page itself, so that it can be sent around as one file."""

import base64

from contourslam.report.page.markup import Picture
from contourslam.report.svg.drawing import Drawing


def embedded(drawing: Drawing, *, alt: str, caption: str) -> Picture:
    """Give a drawing as a picture that the page holds; the same drawing gives the same bytes."""
    source = "data:image/svg+xml;base64," + base64.b64encode(drawing.text.encode()).decode("ascii")
    return Picture(source, drawing.width, drawing.height, alt, caption)
