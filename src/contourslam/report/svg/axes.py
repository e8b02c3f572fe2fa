"""A pair of axes with what is drawn in them, as SVG text."""

import math
from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Colours that the colour-blind can tell apart (Okabe and Ito 2008).
BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#aa4499", "#7cc4f0"
INK, GREY, FAINT = "#222222", "#767676", "#c9c9c9"
SHADES = (
    "#f0f921", "#fcd225", "#fdae32", "#f68d45", "#e76f5a", "#d5546e", "#c03a83", "#a62098", "#8606a6", "#6300a7",
    "#3e049c", "#0d0887",
)  # fmt: skip
"""From little to much."""
_LEFT, _RIGHT, _TOP, _BOTTOM = 62.0, 14.0, 24.0, 42.0  # px around the axes


class Axes:
    """A rectangle of the plane, or of time and a quantity; changed in place by what is drawn into it.

    Parameters
    ----------
    x, y : (float, float)
        What the axes span.
    width, height : float
        Of the rectangle, px.
    labels : (str, str)
        Of the two axes.
    logarithmic : bool
        Of the second one.
    offset : (float, float)
        Upper left corner of the axes and all that is around them, px.
    """

    def __init__(
        self,
        x: tuple[float, float],
        y: tuple[float, float],
        width: float,
        height: float,
        *,
        labels: tuple[str, str] = ("", ""),
        logarithmic: bool = False,
        offset: tuple[float, float] = (0.0, 0.0),
    ) -> None:
        self.width, self.height = width, height
        self._log = logarithmic
        self._x, self._y = x, self._scaled(np.array(y, dtype=np.float64))
        self._left, self._top = offset[0] + _LEFT, offset[1] + _TOP
        self._inside: list[str] = []
        self._outside: list[str] = []
        self._labels = labels

    @property
    def outer(self) -> tuple[float, float]:
        """Width and height with all that is around the axes, px."""
        return self.width + _LEFT + _RIGHT, self.height + _TOP + _BOTTOM

    def _scaled(self, y: Floats) -> Floats:
        return np.log10(np.maximum(y, 1e-12)) if self._log else y

    def pixels(self, x: Floats, y: Floats) -> Floats:
        """Give points in px, shape (n, 2), none farther out than a frame's width, for viewers cannot draw that."""
        across = (np.asarray(x) - self._x[0]) / (self._x[1] - self._x[0])
        up = (self._scaled(np.asarray(y, dtype=np.float64)) - self._y[0]) / (self._y[1] - self._y[0])
        at = np.stack([self._left + self.width * across, self._top + self.height * (1.0 - up)], axis=-1)
        return np.asarray(np.clip(at, -2000.0, 4000.0))

    def line(self, x: Floats, y: Floats, colour: str, width: float = 1.0) -> None:
        """Draw a line; it is broken where a value is not finite."""
        at = self.pixels(x, y)
        known = np.array(np.isfinite(at).all(axis=1))
        begins = known & ~np.concatenate([[False], known[:-1]])
        words = [
            f"{'M' if begin else ''}{u:.1f} {v:.1f}" for (u, v), begin in zip(at[known], begins[known], strict=True)
        ]
        self._inside.append(f'<path d="{" ".join(words)}" fill="none" stroke="{colour}" stroke-width="{width}"/>')

    def segments(self, ends: Floats, colours: str | Sequence[str], width: float = 1.0) -> None:
        """Draw straight lines, shape (n, 2, 2), in their order."""
        at = self.pixels(ends[..., 0].ravel(), ends[..., 1].ravel()).reshape(-1, 4).tolist()
        self._by_colour([f"M{a:.1f} {b:.1f}L{c:.1f} {d:.1f}" for a, b, c, d in at], colours, width)

    def dots(self, points: Floats, colours: str | Sequence[str], size: float, opacity: float = 1.0) -> None:
        """Draw round dots, shape (n, 2), in their order."""
        at = self.pixels(points[:, 0], points[:, 1]).tolist()
        self._by_colour([f"M{a:.1f} {b:.1f}h0" for a, b in at], colours, size, opacity)

    def squares(self, points: Floats, fill: str, colour: str, size: float = 3.4) -> None:
        """Draw little squares."""
        at = (self.pixels(points[:, 0], points[:, 1]) - 0.5 * size).tolist()
        path = "".join(f"M{a:.1f} {b:.1f}h{size}v{size}h-{size}z" for a, b in at)
        self._inside.append(f'<path d="{path}" fill="{fill}" stroke="{colour}" stroke-width="0.8"/>')

    def band(self, x: Floats, low: Floats, high: Floats) -> None:
        """Fill what lies between two lines."""
        at = np.concatenate([self.pixels(x, low), self.pixels(x, high)[::-1]])
        words = " ".join(f"{u:.1f},{v:.1f}" for u, v in at[np.isfinite(at).all(axis=1)].tolist())
        self._inside.append(f'<polygon points="{words}" fill="{FAINT}" fill-opacity="0.7"/>')

    def rule(self, y: float) -> None:
        """Draw a line from side to side."""
        self.line(np.array(self._x), np.array([y, y]), GREY, 0.8)

    def legend(self, entries: Sequence[tuple[str, str]]) -> None:
        """Name colours above the axes."""
        left = self._left
        for name, colour in entries:
            mark = f'<path d="M{left:.0f} {self._top - 12:.0f}h16" stroke="{colour}" stroke-width="4"/>'
            self._outside += [mark, _text(left + 21, self._top - 8, name, "start")]
            left += 36.0 + 6.6 * len(name)

    def _by_colour(self, paths: list[str], colours: str | Sequence[str], width: float, opacity: float = 1.0) -> None:
        """Draw in order; neighbours of one colour share an element."""
        if isinstance(colours, str):
            colours = [colours] * len(paths)
        begin = 0
        for end in range(1, len(paths) + 1):
            if end == len(paths) or colours[end] != colours[begin]:
                path = "".join(paths[begin:end])
                faint = f' stroke-opacity="{opacity}"' if opacity < 1.0 else ""
                self._inside.append(
                    f'<path d="{path}" fill="none" stroke="{colours[begin]}" stroke-width="{width}" '
                    f'stroke-linecap="round"{faint}/>'
                )
                begin = end

    def svg(self) -> str:
        """Give all of it as SVG elements."""
        right, bottom = self._left + self.width, self._top + self.height
        grid, words = [], []
        for value in ticks(*self._x):
            at = float(self.pixels(np.array([value]), np.ones(1))[0, 0])
            grid.append(f"M{at:.1f} {self._top:.1f}V{bottom:.1f}")
            words.append(_text(at, bottom + 16, f"{value:g}", "middle"))
        for value in _decades(*self._y) if self._log else ticks(*self._y):
            at = float(self.pixels(np.zeros(1), np.array([value]))[0, 1])
            grid.append(f"M{self._left:.1f} {at:.1f}H{right:.1f}")
            words.append(_text(self._left - 7, at + 4, f"{value:g}", "end"))
        middle = self._top + 0.5 * self.height
        words.append(_text(0.5 * (self._left + right), bottom + 35, self._labels[0], "middle"))
        words.append(
            f'<text transform="translate({self._left - 46:.1f} {middle:.1f}) rotate(-90)" text-anchor="middle">'
            f"{escape(self._labels[1])}</text>"
        )
        clip = f"c{self._left:.0f}-{self._top:.0f}"
        frame = f'x="{self._left:.1f}" y="{self._top:.1f}" width="{self.width:.1f}" height="{self.height:.1f}"'
        parts = [
            f'<clipPath id="{clip}"><rect {frame}/></clipPath>',
            f'<path d="{"".join(grid)}" stroke="#e6e6e6" stroke-width="0.7"/>',
            f'<g clip-path="url(#{clip})">',
            *self._inside,
            f'</g><rect {frame} fill="none" stroke="{GREY}" stroke-width="0.8"/>',
            *words,
            *self._outside,
        ]
        return "\n".join(parts)

    def scale(self, label: str, low: float, high: float) -> None:
        """Draw the scale of the shades, logarithmic from low to high, on the right of the axes."""
        left, height = self._left + self.width + 16.0, 0.6 * self.height
        top, step = self._top + 0.2 * self.height, 0.6 * self.height / len(SHADES)
        for k, shade in enumerate(reversed(SHADES)):
            box = f'x="{left:.1f}" y="{top + k * step:.1f}" width="12" height="{step + 0.5:.1f}"'
            self._outside.append(f'<rect {box} fill="{shade}"/>')
        for share in (0.0, 0.25, 0.5, 0.75, 1.0):
            value = low * (high / low) ** share
            self._outside.append(_text(left + 17, top + height * (1.0 - share) + 4, f"{value:.2g}", "start"))
        self._outside.append(_text(left - 8, top - 12, label, "start"))


def shades(values: Floats) -> tuple[list[str], float, float]:
    """Give each value its shade on a logarithmic scale between the values' own bounds, and these."""
    low, high = np.quantile(values, [0.02, 1.0]).tolist()
    low = max(low, 1e-3)
    high = max(high, 1.1 * low)
    share = np.log(np.clip(values, low, high) / low) / math.log(high / low)
    steps = np.minimum((share * len(SHADES)).astype(np.int64), len(SHADES) - 1)
    return [SHADES[step] for step in steps], low, high


def ticks(low: float, high: float) -> list[float]:
    """Give about six round numbers between two."""
    step = 10.0 ** math.floor(math.log10((high - low) / 4.0))
    step *= next(factor for factor in (5.0, 2.0, 1.0) if step * factor <= (high - low) / 4.0)
    return [k * step for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def _decades(low: float, high: float) -> list[float]:
    """Give 1, 2, 5 times the powers of ten between two logarithms; the powers alone where they are many."""
    factors = (1.0, 2.0, 5.0) if high - low < 4.0 else (1.0,)
    values = [f * 10.0**k for k in range(math.floor(low), math.ceil(high) + 1) for f in factors]
    return [value for value in values if low - 1e-9 <= math.log10(value) <= high + 1e-9]


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
