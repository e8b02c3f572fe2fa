"""What the figures for a paper share."""

from typing import Any, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from contourslam.report.figures.style import LINES, logarithmic


def line_style(i: int) -> dict[str, Any]:
    """Colour and dashes of the i-th run."""
    colour, dashes = LINES[i % len(LINES)]
    return {"color": colour, "linestyle": dashes}


def verbatim(name: str) -> str:
    """Give a name from outside so that matplotlib shows it as it stands.

    Between two dollar signs it would read mathematics, and it leaves what begins with an underscore out of legends.
    """
    return (" " if name.startswith("_") else "") + name.replace("$", r"\$")


def legend_below(figure: Figure, axes: Axes, columns: int) -> Figure:
    """Name below the figure what these axes show, in so many columns at most."""
    handles, names = axes.get_legend_handles_labels()
    if names:
        figure.legend(handles, names, loc="outside lower center", ncols=min(columns, len(names)))
    return figure


def spread_logarithmic(axes: Axes, axis: Literal["x", "y"]) -> None:
    """Make an axis logarithmic; where it spans much, the powers of ten alone have room for their numbers."""
    logarithmic(axes, axis)
    low, high = axes.get_xlim() if axis == "x" else axes.get_ylim()
    if high > 100.0 * low:
        (axes.xaxis if axis == "x" else axes.yaxis).set_major_locator(LogLocator(subs=(1.0,), numticks=20))
