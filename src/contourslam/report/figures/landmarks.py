"""How often each landmark was seen and missed (the paper's Fig. 7)."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from contourslam.report.figures.style import FAINT, INK, VERMILION, colour, styled


@styled
def landmark_figure(detector: str, observed: NDArray[np.int64], failed: NDArray[np.int64]) -> Figure:
    """Draw a bar per landmark, seen below and missed above, with the false-negative rate f/(f + o) as a dot.

    Parameters
    ----------
    detector : str
        Gives the colour.
    observed, failed : ndarray of int, shape (n,)
        How often each landmark was seen (o), and how often it should have been but was not (f).

    Returns
    -------
    Figure
    """
    figure = Figure(figsize=(6.0, 3.4), layout="constrained")
    counts = figure.add_subplot()
    order = np.argsort(-(observed + 1e-6 * failed), kind="stable")
    o, f = observed[order], failed[order]
    place = np.arange(1, len(order) + 1)
    counts.bar(place, o, width=0.8, color=colour(detector), label="observed, o")
    counts.bar(place, f, width=0.8, bottom=o, color=FAINT, hatch="////", edgecolor="white", label="failed, f")
    counts.set(xlabel="landmark, by times observed", ylabel="scans", xlim=(0.3, max(len(order), 1) + 0.7))
    counts.xaxis.set_major_locator(MaxNLocator(integer=True))
    counts.grid(visible=False, axis="x")
    rates = counts.twinx()
    chances = np.maximum(o + f, 1)
    rates.plot(
        place, f / chances, linestyle="none", marker="o", markersize=4.5, color=VERMILION, markeredgecolor="white"
    )
    rates.set_ylim(0.0, 1.0)
    rates.set_ylabel("false-negative rate f/(f + o)")
    rates.spines["right"].set_visible(True)
    rates.grid(visible=False)
    handles, names = counts.get_legend_handles_labels()
    handles.append(rates.lines[0])
    total = float(f.sum() / max(o.sum() + f.sum(), 1))
    names.append(f"rate (all together {100.0 * total:.1f} %)")
    rates.lines[0].set_color(INK)
    figure.legend(handles, names, loc="outside upper left", ncols=3)
    return figure
