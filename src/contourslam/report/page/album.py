"""Figures inside the page itself, so that it can be sent around as one file."""

import base64
import io
import re

import matplotlib
from matplotlib.figure import Figure

from contourslam.report.figures.style import STYLE
from contourslam.report.page.markup import Picture

_DOTS = 100  # per inch, for what is drawn as pixels inside a drawing
_LARGE = 300_000  # bytes; a drawing of more lines than that is smaller, and no worse, as pixels
_FINE_DOTS = 150


def _shortened(path: re.Match[bytes]) -> bytes:
    """Keep two decimals of a path's points, which is finer than any screen."""
    return re.sub(rb"(\.\d\d)\d+", rb"\1", path[0])


def embedded(figure: Figure, *, alt: str, caption: str) -> Picture:
    """Give a figure as a picture that the page holds; the same figure gives the same bytes."""
    text = re.sub(rb' d="[^"]*"', _shortened, _saved(figure, "svg", _DOTS))
    kind = "svg+xml"
    if len(text) > _LARGE:
        text, kind = _saved(figure, "png", _FINE_DOTS), "png"
    width, height = figure.get_size_inches() * 100.0
    source = f"data:image/{kind};base64," + base64.b64encode(text).decode("ascii")
    return Picture(source, round(width), round(height), alt, caption)


def _saved(figure: Figure, form: str, dots: int) -> bytes:
    file = io.BytesIO()
    with matplotlib.rc_context(STYLE):
        figure.savefig(file, format=form, dpi=dots, metadata={"Date": None} if form == "svg" else {})
    return file.getvalue()
