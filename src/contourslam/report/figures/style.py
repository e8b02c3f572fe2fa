"""One look for all figures: quiet axes, colours that the colour-blind can tell apart (Okabe and Ito 2008)."""

import functools
from collections.abc import Callable
from typing import Any, Literal, ParamSpec

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from contourslam.report.naming import COLOURS
from contourslam.report.naming import label as label
from contourslam.report.svg import colours

P = ParamSpec("P")

BLUE, ORANGE, GREEN, VERMILION, PURPLE = colours.BLUE, colours.ORANGE, colours.GREEN, colours.VERMILION, colours.PURPLE
INK, GREY, FAINT, SKY = colours.INK, colours.GREY, colours.FAINT, "#56b4e9"
_OTHERS = (ORANGE, SKY, INK, GREY)

STYLE: dict[Any, Any] = {
    "figure.dpi": 100,
    "savefig.dpi": 160,
    "font.size": 10.0,
    "font.family": "DejaVu Sans",
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": colours.GRID,
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "lines.linewidth": 1.4,
    "svg.fonttype": "path",
    "pdf.fonttype": 42,  # TrueType, embedded: journals refuse type 3
    "svg.hashsalt": "contourslam",
    "path.simplify_threshold": 0.3,
}

PAPER: dict[Any, Any] = STYLE | {
    "font.size": 8.0,
    "font.family": "STIXGeneral",  # comes with matplotlib, and stands well beside Times
    "mathtext.fontset": "stix",
    "axes.titlesize": 8.0,
    "axes.titleweight": "normal",
    "axes.titlelocation": "center",
    "axes.linewidth": 0.5,
    "axes.edgecolor": INK,
    "axes.labelpad": 2.0,
    "grid.linewidth": 0.4,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.major.width": 0.5,
    "ytick.major.width": 0.5,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "legend.fontsize": 8.0,
    "legend.handlelength": 1.8,
    "legend.columnspacing": 1.2,
    "lines.linewidth": 0.9,
    "figure.constrained_layout.h_pad": 0.025,
    "figure.constrained_layout.w_pad": 0.025,
}
"""For a paper: 8 pt in the end, for figures are made as wide as they are printed."""
SINGLE, DOUBLE = 3.5, 7.16
"""Width of one column and of both, as IEEE's journals have them, inches."""
LINES = (
    (BLUE, "-"), (VERMILION, (0, (4, 1.5))), (GREEN, (0, (5, 1.5, 1, 1.5))), (PURPLE, (0, (1, 1))),
    (ORANGE, (0, (7, 2))), (SKY, (0, (3, 1, 1, 1, 1, 1))), (INK, (0, (2, 2))), (GREY, "-"),
)  # fmt: skip
"""Colour and dashes of the first run, the second and so on: what has no colour is told by its dashes."""


def colour(detector: str) -> str:
    """Colour of a detector: its own for the four, a fixed other one for a user's."""
    return COLOURS.get(detector) or _OTHERS[sum(detector.encode()) % len(_OTHERS)]


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw a figure in the house style, without changing matplotlib's settings for anyone else."""
    return _in(STYLE, draw)


def for_paper(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw a figure in the style of a paper, likewise."""
    return _in(PAPER, draw)


def _in(style: dict[Any, Any], draw: Callable[P, Figure]) -> Callable[P, Figure]:
    @functools.wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with matplotlib.rc_context(style):
            return draw(*args, **kwargs)

    return drawn


def logarithmic(axes: Axes, axis: Literal["x", "y"]) -> None:
    """Make an axis logarithmic, with plain numbers at 1, 2 and 5."""
    if axis == "x":
        axes.set_xscale("log")
    else:
        axes.set_yscale("log")
    scale = axes.xaxis if axis == "x" else axes.yaxis
    scale.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=20))
    scale.set_minor_locator(NullLocator())
    scale.set_major_formatter("{x:g}")
