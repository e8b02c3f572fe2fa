"""What the sections share: numbers as text, the names of things, and figures as files beside the page."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from contourslam.experiments.replays import Mode
from contourslam.report.figures.save import save_figure
from contourslam.report.page.markup import Cell, Picture

COORDINATES = ("x", "y", "theta")
SIGNS = {"x": "x", "y": "y", "theta": "θ"}
UNITS = {"x": "m", "y": "m", "theta": "rad"}
MODE_NAMES: dict[Mode, str] = {"corners": "corners only", "walls": "corners with walls"}


@dataclass(frozen=True, slots=True)
class Gallery:
    """Where the figures go: ``figures/`` in the report's folder."""

    folder: Path

    def add(self, name: str, figure: Figure, *, alt: str, caption: str, scale: float = 100.0) -> Picture:
        """Save a figure as SVG and PDF, and give it as a picture for the page, so many px an inch large."""
        save_figure(figure, *(self.folder / "figures" / f"{name}.{form}" for form in ("svg", "pdf")))
        width, height = figure.get_size_inches() * scale
        source = f"figures/{name}.svg"
        return Picture(source, round(width), round(height), alt, caption, others=(source, f"figures/{name}.pdf"))


def number(value: float | None, digits: int = 4) -> str:
    """Give a number with so many decimals, a dash where it is not known."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def percent(value: float | None) -> str:
    """Give a share in percent, a dash where it is not known."""
    return "–" if value is None or not np.isfinite(value) else f"{100 * value:.1f} %"


def spread(value: Mapping[str, Any] | None, digits: int = 4, *, better: bool = False) -> Cell:
    """Give an aggregated number with its standard deviation."""
    if not value or value.get("mean") is None:
        return Cell("–")
    sd = value.get("sd")
    return Cell(number(value["mean"], digits), "" if sd is None else f"± {sd:.{digits}f}", better)


def position(metrics: Mapping[str, Any]) -> float:
    """RMSE of the position, both coordinates together, m; NaN where it is not known."""
    rmse = metrics.get("rmse") or {}
    return float(np.hypot(rmse.get("x", np.nan), rmse.get("y", np.nan)))
