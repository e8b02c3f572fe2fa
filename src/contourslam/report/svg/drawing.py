"""A finished drawing: SVG text with its size."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from contourslam.report.svg.colours import INK, SHEET

SCALE_WIDTH = 96.0  # px that a scale of shades takes beside its axes


class Panel(Protocol):
    """A part of a drawing, as wide as the drawing or less."""

    @property
    def outer(self) -> tuple[float, float]:
        """Width and height with all that is around it, px."""

    def svg(self) -> str:
        """Give all of it as SVG elements, at its place in the drawing."""


@dataclass(frozen=True, slots=True)
class Drawing:
    """A drawing.

    Attributes
    ----------
    text : str
        A whole SVG document that refers to nothing outside, and has no ids: any number of them can stand in a page.
    width, height : int
        px.
    """

    text: str
    width: int
    height: int


def drawing(panels: Sequence[Panel], *, beside: float = 0.0) -> Drawing:
    """Put panels, which stand one below the other, on one white sheet, with so many px left free beside them."""
    width = round(max(panel.outer[0] for panel in panels) + beside)
    height = round(sum(panel.outer[1] for panel in panels))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}" '
        f'font-family="system-ui, sans-serif" font-size="12" fill="{INK}">'
    )
    sheet = f'<rect width="100%" height="100%" fill="{SHEET}"/>'
    return Drawing("\n".join([head, sheet, *(panel.svg() for panel in panels), "</svg>\n"]), width, height)
