"""The few pieces of HTML that the report is made of; every text is escaped here and nowhere else."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from string import Template

from contourslam.report.page.shell import shell
from contourslam.report.page.tables import to_csv, to_latex


@dataclass(frozen=True, slots=True)
class Cell:
    """A table cell.

    Attributes
    ----------
    text : str
    small : str
        Put behind it in small print.
    better : bool
        Marks a number that beats the paper's, or that is the best of the runs.
    """

    text: str
    small: str = ""
    better: bool = False


@dataclass(frozen=True, slots=True)
class Row:
    """A table row; an aside is a reference that does not compete."""

    name: str
    cells: Sequence[Cell]
    aside: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture, with the words for those who cannot see it: a file beside the page.

    `others` are files of the same picture in other formats.
    """

    source: str
    width: int
    height: int
    alt: str
    caption: str
    chart: bool = True
    others: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the page; `body` is HTML."""

    anchor: str
    title: str
    body: str


def paragraph(text: str, kind: str = "") -> str:
    """Give a paragraph."""
    attribute = f' class="{escape(kind)}"' if kind else ""
    return f"<p{attribute}>{escape(text)}</p>"


def table(
    caption: str, headers: Sequence[str], rows: Sequence[Row], *, stacked: bool = False, words: Sequence[str] = ()
) -> str:
    """Give a table with a caption and header cells, to be copied as CSV or LaTeX; it scrolls where it is too wide.

    One that is stacked is made narrow: heads and long cells are wrapped, small print stands below its number. Columns
    whose heads are among `words` hold no numbers and begin at the left.
    """
    left = ' class="left"'
    head = "".join(
        f'<th scope="col"{left * (header in words)}>{escape(header)}</th>' if header else "<td></td>"
        for header in headers
    )
    lefts = [number for number, header in enumerate(headers[1:]) if header in words]
    body = "\n".join(_row(row, lefts) for row in rows)
    return (
        f'<div class="wide{" stacked" * stacked}" tabindex="0" role="region" aria-label="{escape(caption)}"><table>\n'
        f"<caption><span>{escape(caption)}</span></caption>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>\n"
        f'<p class="copy" hidden>{_copy("CSV", to_csv(headers, rows))} '
        f'{_copy("LaTeX", to_latex(caption, headers, rows))} <span role="status"></span></p>'
    )


def _copy(form: str, text: str) -> str:
    """Give the button that copies a text; ``tables.js`` makes it do so. A browser drops a carriage return as it is."""
    held = escape(text).replace("\r", "&#13;")
    return f'<button type="button" data-text="{held}">Copy as {form}</button>'


def _row(row: Row, lefts: Sequence[int]) -> str:
    kind = ' class="aside"' if row.aside else ""
    cells = "".join(_cell(cell, left=number in lefts) for number, cell in enumerate(row.cells))
    return f'<tr{kind}><th scope="row">{escape(row.name)}</th>{cells}</tr>'


_LONG = 16  # characters from which a cell is words to be wrapped where the table is stacked


def _cell(cell: Cell, *, left: bool) -> str:
    kinds = ["better"] * cell.better or ["words"] * (len(cell.text) > _LONG)
    kinds += ["left"] * left
    kind = f' class="{" ".join(kinds)}"' if kinds else ""
    small = f" <small>{escape(cell.small)}</small>" if cell.small else ""
    return f"<td{kind}>{escape(cell.text)}{small}</td>"


def figure(picture: Picture) -> str:
    """Give a figure; a file opens in full size when clicked."""
    kind = "chart" if picture.chart else "photo"
    source = escape(picture.source)
    image = (
        f'<img class="{kind}" src="{source}" width="{picture.width}" height="{picture.height}" '
        f'alt="{escape(picture.alt)}">'
    )
    image = f'<a href="{source}">{image}</a>'
    links = "".join(
        f' <a href="{escape(other)}">{escape(other.rpartition(".")[2].upper())}</a>' for other in picture.others
    )
    return f"<figure>{image}<figcaption>{escape(picture.caption)}{links}</figcaption></figure>"


def pair(pictures: Sequence[Picture]) -> str:
    """Give figures side by side where there is room."""
    return f'<div class="pair">{"".join(map(figure, pictures))}</div>' if pictures else ""


def verbatim(text: str) -> str:
    """Give a text as it stands, such as a configuration."""
    return f'<pre tabindex="0">{escape(text)}</pre>'


def heading(text: str) -> str:
    """Give a heading inside a section."""
    return f"<h3>{escape(text)}</h3>"


def folded(summary: str, body: str) -> str:
    """Give a part that opens when asked; `body` is HTML."""
    return f"<details><summary>{escape(summary)}</summary>{body}</details>"


def definitions(terms: dict[str, str]) -> str:
    """Give names and values."""
    pairs = (f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in terms.items())
    return f"<dl>{''.join(pairs)}</dl>"


def bullets(texts: Sequence[str]) -> str:
    """Give a list."""
    return f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>"


def tiles(figures: Sequence[tuple[str, str, str]]) -> str:
    """Give the headline figures: value, what it is, and what to hold it against."""
    body = "".join(
        f"<li><strong>{escape(value)}</strong> <span>{escape(name)}</span> <small>{escape(beside)}</small></li>"
        for value, name, beside in figures
    )
    return f'<ul class="tiles">{body}</ul>'


def page(
    title: str,
    *,
    lead: str,
    sections: Sequence[Section],
    footer: str,
    banner: str = "",
    summary: str = "",
    scripts: Sequence[str] = (),
) -> str:
    """Give the whole page, its style and scripts inside.

    Parameters
    ----------
    title, footer : str
    lead : str
        Opening words.
    sections : sequence of Section
    banner : str
        A warning above it all.
    summary : str
        HTML between the opening words and the contents, such as tiles.
    scripts : sequence of str
        What this page runs beside what every page does (:func:`contourslam.report.page.shell.shell`).

    Returns
    -------
    str
    """
    template = Template(files("contourslam.report.page").joinpath("template.html").read_text(encoding="utf-8"))
    return template.substitute(
        title=escape(title),
        **shell(scripts),
        banner=f'<p class="warning" role="status">{escape(banner)}</p>' if banner else "",
        lead=paragraph(lead, "lead") + summary,
        contents="\n".join(f'<li><a href="#{escape(s.anchor)}">{escape(s.title)}</a></li>' for s in sections),
        sections="\n".join(
            f'<section aria-labelledby="{escape(s.anchor)}">\n<h2 id="{escape(s.anchor)}">{escape(s.title)}</h2>\n'
            f"{s.body}\n</section>"
            for s in sections
        ),
        footer=escape(footer),
    )
