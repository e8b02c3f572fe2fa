"""A pair of axes with what is drawn in them, as SVG text.

The text says by ``data-`` attributes what is what, so that the page's scripts can move, read and switch it.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from html import escape

import numpy as np
from numpy.typing import NDArray

from contourslam.report.svg import paths
from contourslam.report.svg.colours import FAINT, GREY, GRID, SHADES
from contourslam.report.svg.legend import LEFT, RIGHT, entry, entry_width, written
from contourslam.report.svg.ticks import decades, ticks

Floats = NDArray[np.float64]

_TOP, _BOTTOM = 24.0, 42.0  # px above and below the axes
_FARTHEST = 16_000.0  # px; viewers cannot draw what lies much farther out


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
    unit : str
        Of the second one's values, where the page shows them.
    logarithmic : bool
        Of the second one.
    offset : (float, float)
        Upper left corner of the axes and all that is around them, px.
    digits : int
        Decimals of a px that are kept.
    """

    def __init__(
        self,
        x: tuple[float, float],
        y: tuple[float, float],
        width: float,
        height: float,
        *,
        labels: tuple[str, str] = ("", ""),
        unit: str = "",
        logarithmic: bool = False,
        offset: tuple[float, float] = (0.0, 0.0),
        digits: int = 1,
    ) -> None:
        self.width, self.height = width, height
        self._log = logarithmic
        self._x, self._y = x, self._scaled(np.array(y, dtype=np.float64))
        self._left, self._top = offset[0] + LEFT, offset[1] + _TOP
        self._inside: list[str] = []
        self._outside: list[str] = []
        self._labels, self._unit, self._digits = labels, unit, digits

    @property
    def outer(self) -> tuple[float, float]:
        """Width and height with all that is around the axes, px."""
        return self.width + LEFT + RIGHT, self.height + _TOP + _BOTTOM

    def _scaled(self, y: Floats) -> Floats:
        return np.log10(np.maximum(y, 1e-12)) if self._log else y

    def pixels(self, x: Floats, y: Floats) -> Floats:
        """Give points in px, shape (n, 2), none so far out that viewers cannot draw it."""
        across = (np.asarray(x) - self._x[0]) / (self._x[1] - self._x[0])
        up = (self._scaled(np.asarray(y, dtype=np.float64)) - self._y[0]) / (self._y[1] - self._y[0])
        at = np.stack([self._left + self.width * across, self._top + self.height * (1.0 - up)], axis=-1)
        return np.asarray(np.clip(at, -_FARTHEST, _FARTHEST))

    @contextmanager
    def layer(self, name: str, *, shown: bool = True) -> Iterator[None]:
        """Whatever is drawn within belongs together and can be switched on the page."""
        self._inside.append(f'<g data-layer="{name}"{"" if shown else _HIDDEN}>')
        yield
        self._inside.append("</g>")

    def line(self, x: Floats, y: Floats, colour: str, width: float = 1.0, *, name: str = "") -> None:
        """Draw a line; it is broken where a value is not finite. The page tells the values of one with a name."""
        at = self.pixels(x, y)
        known = np.array(np.isfinite(at).all(axis=1))
        begins = known & ~np.concatenate([[False], known[:-1]])
        path = paths.lines(at[known], begins[known], self._digits)
        self._inside.append(
            f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}" stroke-linejoin="round"'
            f"{_named(name)}/>"
        )

    def trace(self, points: Floats, colour: str, width: float = 1.0) -> None:
        """Draw a line through points, shape (n, 2) or with more columns."""
        self.line(points[:, 0], points[:, 1], colour, width)

    def segments(self, ends: Floats, colours: str | Sequence[str], width: float = 1.0) -> None:
        """Draw straight lines, shape (n, 2, 2), in their order."""
        at = self.pixels(ends[..., 0].ravel(), ends[..., 1].ravel()).reshape(-1, 2, 2)
        self._by_colour(at, paths.segments, colours, width)

    def dots(self, points: Floats, colours: str | Sequence[str], size: float, opacity: float = 1.0) -> None:
        """Draw round dots, shape (n, 2), in their order."""
        at = self.pixels(points[:, 0], points[:, 1])
        self._by_colour(at, paths.dots, colours, size, opacity)

    def cloud(self, points: Floats, colour: str, size: float, opacity: float) -> None:
        """Draw many round dots, shape (n, 2), to whole px, and one for all that fall there."""
        at = np.unique(self.pixels(points[:, 0], points[:, 1]).round(), axis=0)
        self._inside.append(
            f'<path d="{"".join(paths.dots(at, 0))}" fill="none" stroke="{colour}" stroke-width="{size}" '
            f'stroke-linecap="round" stroke-opacity="{opacity}"/>'
        )

    def squares(self, points: Floats, fill: str, colour: str, size: float = 4.4) -> None:
        """Draw little squares with an edge: they are ends of lines, and so stay as large when the page zooms."""
        at = "".join(paths.dots(self.pixels(points[:, 0], points[:, 1]), self._digits))
        for stroke, width, mark in ((colour, size, ""), (fill, size - 1.6, ' data-filling=""')):
            self._inside.append(
                f'<path d="{at}" fill="none" stroke="{stroke}" stroke-width="{width:g}" stroke-linecap="square"{mark}/>'
            )

    def ellipses(self, points: Floats, covariances: Floats, sigmas: float, colour: str) -> None:
        """Draw ellipses of so many standard deviations, shapes (n, 2) and (n, 2, 2); axes of one scale only."""
        variances, directions = np.linalg.eigh(covariances)
        radii = sigmas * np.sqrt(np.maximum(variances, 0.0)) * self.width / (self._x[1] - self._x[0])
        turns = -np.degrees(np.arctan2(directions[:, 1, 1], directions[:, 0, 1]))
        pieces = []
        for (u, v), (small, large), turn in zip(
            self.pixels(points[:, 0], points[:, 1]).tolist(), radii.tolist(), turns.tolist(), strict=True
        ):
            du, dv = large * math.cos(math.radians(turn)), large * math.sin(math.radians(turn))
            arc = f"a{large:.3g} {small:.3g} {turn:.0f} 1 1 "
            pieces.append(f"M{u - du:.3f} {v - dv:.3f}{arc}{2 * du:.3f} {2 * dv:.3f}{arc}{-2 * du:.3f} {-2 * dv:.3f}z")
        self._inside.append(f'<path d="{"".join(pieces)}" fill="{colour}" fill-opacity="0.25" stroke="{colour}"/>')

    def band(self, x: Floats, low: Floats, high: Floats, *, name: str = "") -> None:
        """Fill what lies between two lines; the page tells the values of a band with a name."""
        at = np.stack([self.pixels(x, low), self.pixels(x, high)])
        at = at[:, np.isfinite(at).all(axis=(0, 2))]
        begins = np.arange(2 * at.shape[1]) == 0
        path = paths.lines(np.concatenate([at[0], at[1, ::-1]]), begins, self._digits)
        self._inside.append(f'<path d="{path}z" fill="{FAINT}" fill-opacity="0.7"{_named(name)}/>')

    def rule(self, y: float) -> None:
        """Draw a line from side to side."""
        self.line(np.array(self._x), np.array([y, y]), GREY, 0.8)

    def legend(self, entries: Sequence[tuple[str, str] | tuple[str, str, str, bool]]) -> None:
        """Name colours above the axes: name and colour, or these with a layer and whether it is shown."""
        left, marks = self._left, []
        for name, colour, *rest in entries:
            layer, shown = rest or ("", True)
            of = f' data-of="{layer}"' if layer else ""
            marks.append(f"<g{of}{'' if shown else _HIDDEN}>{entry(left, self._top - 8, name, colour)}</g>")
            left += entry_width(name) if shown else 0.0
        self._outside.append('<g data-legend="">' + "".join(marks) + "</g>")

    def _by_colour(
        self,
        at: Floats,
        piece: Callable[[Floats, int], list[str]],
        colours: str | Sequence[str],
        width: float,
        opacity: float = 1.0,
    ) -> None:
        """Draw in order; neighbours of one colour share an element."""
        if isinstance(colours, str):
            colours = [colours] * len(at)
        faint = f' stroke-opacity="{opacity}"' if opacity < 1.0 else ""
        begin = 0
        for end in range(1, len(at) + 1):
            if end == len(at) or colours[end] != colours[begin]:
                path = "".join(piece(at[begin:end], self._digits))
                self._inside.append(
                    f'<path d="{path}" fill="none" stroke="{colours[begin]}" stroke-width="{width}" '
                    f'stroke-linecap="round"{faint}/>'
                )
                begin = end

    def svg(self) -> str:
        """Give all of it as SVG elements."""
        left, top, right, bottom = self._left, self._top, self._left + self.width, self._top + self.height
        grid, words = [], []
        for value in ticks(*self._x):
            at = float(self.pixels(np.array([value]), np.ones(1))[0, 0])
            grid.append(f"M{at:.1f} {top:.1f}V{bottom:.1f}")
            words.append(written(at, bottom + 16, f"{value:g}", "middle"))
        for value in decades(*self._y) if self._log else ticks(*self._y):
            at = float(self.pixels(np.zeros(1), np.array([value]))[0, 1])
            grid.append(f"M{left:.1f} {at:.1f}H{right:.1f}")
            words.append(written(left - 7, at + 4, f"{value:g}", "end"))
        turned = f"translate({left - 46:.1f} {top + 0.5 * self.height:.1f}) rotate(-90)"
        frame = f'x="{left:.1f}" y="{top:.1f}" width="{self.width:.1f}" height="{self.height:.1f}"'
        box = f"{left:.1f} {top:.1f} {self.width:.1f} {self.height:.1f}"
        kind = ' data-log=""' if self._log else ""
        spans = f'data-x="{_span(self._x)}" data-y="{_span(self._y)}"{kind}'
        parts = [
            f'<g data-panel="" {spans} data-unit="{escape(self._unit)}">',
            f'<path data-grid="" d="{"".join(grid)}" stroke="{GRID}" stroke-width="0.7"/>',
            # A drawing within the drawing cuts off what sticks out, without a name that another could have too.
            f'<svg data-inside="" {frame} viewBox="{box}" preserveAspectRatio="none">',
            *self._inside,
            f'</svg><rect data-frame="" {frame} fill="none" stroke="{GREY}" stroke-width="0.8"/>',
            '<g data-ticks="">' + "".join(words) + "</g>",
            f'<text data-label="x" x="{0.5 * (left + right):.1f}" y="{bottom + 35:.1f}" text-anchor="middle">'
            f"{escape(self._labels[0])}</text>",
            f'<text data-label="y" transform="{turned}" text-anchor="middle">{escape(self._labels[1])}</text>',
            *self._outside,
            "</g>",
        ]
        return "\n".join(parts)

    def scale(self, layer: str, label: str, low: float, high: float) -> None:
        """Draw the scale of a layer's shades, logarithmic from low to high, on the right of the axes."""
        left, height = self._left + self.width + 16.0, 0.6 * self.height
        top, step = self._top + 0.2 * self.height, 0.6 * self.height / len(SHADES)
        parts = []
        for k, shade in enumerate(reversed(SHADES)):
            box = f'x="{left:.1f}" y="{top + k * step:.1f}" width="12" height="{step + 0.5:.1f}"'
            parts.append(f'<rect {box} fill="{shade}"/>')
        for share in (0.0, 0.25, 0.5, 0.75, 1.0):
            value = low * (high / low) ** share
            parts.append(written(left + 17, top + height * (1.0 - share) + 4, f"{value:.2g}", "start"))
        parts.append(written(left - 8, top - 12, label, "start"))
        self._outside.append(f'<g data-scale="{layer}">' + "".join(parts) + "</g>")


_HIDDEN = ' display="none"'


def _named(name: str) -> str:
    return f' data-name="{escape(name)}"' if name else ""


def _span(span: tuple[float, float] | Floats) -> str:
    return f"{span[0]:.9g} {span[1]:.9g}"
