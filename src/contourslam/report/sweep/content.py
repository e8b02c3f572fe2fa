"""What the report says, before it is a page or a Markdown file."""

from collections.abc import Sequence
from dataclasses import dataclass

from contourslam.report.page.markup import Row
from contourslam.report.svg.drawing import Drawing


@dataclass(frozen=True, slots=True)
class Words:
    """A paragraph; a note is in smaller print."""

    text: str
    note: bool = False


@dataclass(frozen=True, slots=True)
class Points:
    """A list of sentences."""

    texts: Sequence[str]


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading inside a part."""

    text: str


@dataclass(frozen=True, slots=True)
class Code:
    """A text as it stands."""

    text: str
    language: str = ""


@dataclass(frozen=True, slots=True)
class Table:
    """A table before it is written as HTML, CSV, LaTeX or Markdown.

    Attributes
    ----------
    name : str
        Of its files.
    caption : str
    headers : sequence of str
        Of the rows' names first.
    rows : sequence of Row
    """

    name: str
    caption: str
    headers: Sequence[str]
    rows: Sequence[Row]


@dataclass(frozen=True, slots=True)
class Chart:
    """A drawing.

    Attributes
    ----------
    name : str
        Of its file.
    drawing : Drawing
    alt : str
        The drawing in words.
    caption : str
    """

    name: str
    drawing: Drawing
    alt: str
    caption: str


@dataclass(frozen=True, slots=True)
class Charts:
    """Drawings side by side where there is room."""

    charts: Sequence[Chart]


@dataclass(frozen=True, slots=True)
class Folded:
    """What the page opens when asked, and a Markdown file leaves out."""

    summary: str
    items: "Sequence[Item]"


Item = Words | Points | Heading | Code | Table | Charts | Folded


@dataclass(frozen=True, slots=True)
class Part:
    """A part of the report.

    Attributes
    ----------
    anchor : str
        Its name in links, and of its place in a Markdown file.
    title : str
    items : sequence of Item
    """

    anchor: str
    title: str
    items: Sequence[Item]
