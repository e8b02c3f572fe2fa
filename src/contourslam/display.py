"""How results show themselves in a notebook: a table of figures beside a small drawing, as HTML text."""

from collections.abc import Mapping
from html import escape

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

# Seen on white and on black, and told apart by the colour-blind (after Okabe and Ito 2008).
WALL, CORNER, WAY, ODOMETRY, TRUTH, POINT = "currentColor", "#d55e00", "#2b8fd0", "#b58a2a", "#2a9d6f", "#8a8f98"
CONTOURS = ("#2b8fd0", "#d58a00", "#2a9d6f", "#c0508a", "#7a6fd0")
"""Of neighbouring contours, in turn."""
WIDTH, HEIGHT, MARGIN = 360.0, 300.0, 8.0  # px, of the largest drawing
MOST = 1500  # points of one layer: the eye cannot tell more in a drawing of this size, and a notebook stays small


class Sketch:
    """Points and lines of the plane, drawn to one scale with x to the right and y up; changed in place by each layer.

    Parameters
    ----------
    label : str
        What is to be seen, for those who cannot see it.
    """

    def __init__(self, label: str) -> None:
        self._label = label
        self._layers: list[tuple[str, Floats, str, float]] = []  # "dots", "ways" or "lines"; points; colour; width, px

    def dots(self, points: ArrayLike, colour: str, size: float = 2.0) -> None:
        """Draw dots, shape (n, 2); of very many, some, evenly chosen."""
        self._layers.append(("dots", _some(_finite(np.reshape(points, (-1, 2)))), colour, size))

    def way(self, points: ArrayLike, colour: str, width: float = 1.2) -> None:
        """Draw a line through points, shape (n, 2); of very many, some, evenly chosen."""
        self._layers.append(("ways", _some(_finite(np.reshape(points, (-1, 2)))), colour, width))

    def lines(self, ends: ArrayLike, colour: str, width: float = 1.6) -> None:
        """Draw straight lines, shape (n, 2, 2); of very many, the longest."""
        rows = np.reshape(np.asarray(ends, dtype=np.float64), (-1, 4))
        rows = rows[np.isfinite(rows).all(axis=1)]
        if len(rows) > MOST:
            length = np.hypot(rows[:, 2] - rows[:, 0], rows[:, 3] - rows[:, 1])
            rows = rows[np.sort(np.argsort(-length, kind="stable")[:MOST])]
        self._layers.append(("lines", rows.reshape(-1, 2), colour, width))

    def svg(self) -> str:
        """Give it as an SVG element; nothing where there is nothing to draw."""
        everything = np.concatenate([np.empty((0, 2)), *(points for _, points, _, _ in self._layers)])
        if not len(everything):
            return ""
        low, span = everything.min(axis=0), np.maximum(np.ptp(everything, axis=0), 1e-6)
        scale = min((WIDTH - 2.0 * MARGIN) / span[0], (HEIGHT - 2.0 * MARGIN) / span[1])
        width, height = (scale * span + 2.0 * MARGIN).tolist()
        parts = []
        for kind, points, colour, thickness in self._layers:
            at = MARGIN + scale * (points - low)
            at[:, 1] = height - at[:, 1]
            path = _path(kind, at)
            if path:
                parts.append(
                    f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{thickness}" '
                    'stroke-linecap="round" stroke-linejoin="round"/>'
                )
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{escape(self._label)}" '
            f'width="{width:.0f}" height="{height:.0f}" viewBox="0 0 {width:.1f} {height:.1f}" '
            f'style="max-width:100%;height:auto">{"".join(parts)}</svg>'
        )


def card(title: str, figures: Mapping[str, object], drawing: str = "") -> str:
    """Give a title, a table of figures and a drawing as one HTML element; colours are the notebook's own.

    Parameters
    ----------
    title : str
    figures : mapping of str to object
        Shown as text, in their order.
    drawing : str
        SVG, as of :meth:`Sketch.svg`.
    """
    cell = 'style="text-align:left;padding:1px 10px 1px 0;font-weight:normal;vertical-align:top"'
    rows = "".join(
        f'<tr style="background:none"><th scope="row" {cell}>{escape(name)}</th>'
        f"<td {cell}>{escape(str(value))}</td></tr>"
        for name, value in figures.items()
    )
    table = f'<table style="border:none;border-collapse:collapse;margin:0">{rows}</table>' if rows else ""
    beside = "display:flex;flex-wrap:wrap;gap:16px;align-items:flex-start"
    return f'<div style="{beside}"><div><strong>{escape(title)}</strong>{table}</div>{drawing}</div>'


def metres(value: float) -> str:
    """Give a length as people read it."""
    return f"{1e3 * value:.1f} mm" if abs(value) < 0.1 else f"{value:.2f} m"


def _finite(points: Floats) -> Floats:
    rows = np.asarray(points, dtype=np.float64)
    return rows[np.isfinite(rows).all(axis=1)]


def _some(points: Floats) -> Floats:
    if len(points) <= MOST:
        return points
    return points[np.linspace(0, len(points) - 1, MOST).astype(np.int64)]


def _path(kind: str, at: Floats) -> str:
    if kind == "dots":
        return "".join(f"M{x:.1f} {y:.1f}h0" for x, y in at.tolist())
    words = [f"{x:.1f} {y:.1f}" for x, y in at.tolist()]
    if kind == "ways":
        return "M" + "L".join(words) if words else ""
    return "".join(f"M{a}L{b}" for a, b in zip(words[::2], words[1::2], strict=True))
