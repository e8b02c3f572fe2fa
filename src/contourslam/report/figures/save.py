"""Figures as files."""

from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from contourslam.atomic import replacing
from contourslam.report.figures.style import STYLE


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as SVG or PNG, by the suffix of `path`; the same figure gives the same bytes.

    Raises
    ------
    ResultError
        If the file cannot be written.
    """
    dateless = {"Date": None} if path.suffix == ".svg" else {}
    with replacing(path) as temporary, matplotlib.rc_context(STYLE):
        figure.savefig(temporary, metadata=dateless)
