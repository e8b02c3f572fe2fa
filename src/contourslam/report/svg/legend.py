"""Colours and their names, and a title with them above a drawing, as SVG text."""

from collections.abc import Sequence
from html import escape

LEFT, RIGHT = 62.0, 14.0
"""Beside the axes, px."""
_ROW = 18.0  # px
_PER_LETTER = 6.6  # px, about


def written(x: float, y: float, text: str, anchor: str) -> str:
    """Text at a place, px."""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'


def entry(x: float, y: float, name: str, colour: str) -> str:
    """A piece of line in a colour, and what it stands for; px, `y` is the text's base line."""
    stroke = f'<path d="M{x:.0f} {y - 4:.0f}h16" stroke="{colour}" stroke-width="4"/>'
    return stroke + written(x + 21, y, name, "start")


def entry_width(name: str) -> float:
    """Width of an entry up to the next, px."""
    return 36.0 + _PER_LETTER * len(name)


class Header:
    """A title, and below it the names of colours in as many rows as they need; a panel above axes.

    Parameters
    ----------
    title : str
    entries : sequence of (str, str)
        Name and colour.
    width : float
        Of the axes below, px.
    """

    def __init__(self, title: str, entries: Sequence[tuple[str, str]], width: float) -> None:
        self._parts = [f'<text x="{LEFT:.0f}" y="{_ROW:.0f}" font-weight="600">{escape(title)}</text>']
        right = LEFT + width + RIGHT
        x, y = LEFT, _ROW + 20.0
        for name, colour in entries:
            wide = entry_width(name)
            if x > LEFT and x + wide > right:
                x, y = LEFT, y + _ROW
            self._parts.append(entry(x, y, name, colour))
            x += wide
        self.outer = right, y - 4.0

    def svg(self) -> str:
        """Give all of it as SVG elements."""
        return "\n".join(self._parts)
