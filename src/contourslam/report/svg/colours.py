"""The colours of drawings, and how a quantity becomes one; ``page/drawn.css`` gives each another on dark paper."""

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Colours that the colour-blind can tell apart (Okabe and Ito 2008).
BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#aa4499", "#7cc4f0"
INK, GREY, FAINT, GRID, SHEET = "#222222", "#767676", "#c9c9c9", "#e6e6e6", "#ffffff"
SHADES = (
    "#f0f921", "#fcd225", "#fdae32", "#f68d45", "#e76f5a", "#d5546e", "#c03a83", "#a62098", "#8606a6", "#6300a7",
    "#3e049c", "#0d0887",
)  # fmt: skip
"""From little to much."""


def shades(values: Floats) -> tuple[list[str], float, float]:
    """Give each value its shade on a logarithmic scale between the values' own bounds, and these."""
    low, high = np.quantile(values, [0.02, 1.0]).tolist()
    low = max(low, 1e-3)
    high = max(high, 1.1 * low)
    share = np.log(np.clip(values, low, high) / low) / math.log(high / low)
    steps = np.minimum((share * len(SHADES)).astype(np.int64), len(SHADES) - 1)
    return [SHADES[step] for step in steps], low, high
