"""Figures as files."""

from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from contourslam.atomic import replacing
from contourslam.report.figures.style import STYLE


def save_figure(figure: Figure, *paths: Path) -> None:
    """Write a figure as SVG, PDF or PNG, by the suffix of each path; the same figure gives the same bytes.

    Raises
    ------
    ResultError
        If a file cannot be written.
    """
    with matplotlib.rc_context(STYLE):
        for path in paths:
            dateless = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path.suffix, {})
            with replacing(path) as temporary:
                figure.savefig(temporary, metadata=dateless)
            figure.set_layout_engine("none")  # it is laid out now, and that takes as long as to draw it
