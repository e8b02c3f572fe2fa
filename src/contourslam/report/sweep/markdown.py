"""The report as Markdown, whole or in places of a document that someone wrote around it.

A place is a pair of comments, ``<!-- sweep:findings -->`` and ``<!-- /sweep:findings -->``; what stands between them is
replaced. So a document can hold numbers that nobody typed.
"""

import re
import tempfile
from collections.abc import Sequence
from html import escape
from pathlib import Path

from contourslam.atomic import make_folder, write_text
from contourslam.errors import ResultError
from contourslam.nearest import no_such, unreadable
from contourslam.report.page.markup import Cell
from contourslam.report.sweep.content import Chart, Charts, Code, Folded, Heading, Item, Part, Points, Table, Words
from contourslam.report.sweep.parts import Parts

_PICTURES = "pictures"
_PLACE = re.compile(r"<!-- sweep:([\w-]+) -->\n.*?<!-- /sweep:\1 -->", re.DOTALL)


def check_place(path: Path) -> None:
    """Refuse a Markdown file that cannot be written, before any work is done for it.

    Raises
    ------
    ResultError
        If it is a folder, or its folder cannot be made or written.
    """
    if path.is_dir():
        raise ResultError(f"{path}: is a folder; name a file")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise ResultError(f"{path}: cannot be written ({error.strerror or error}); choose another file") from error


def write_markdown(path: Path, report: Parts) -> list[Path]:
    """Write the report into a Markdown file, and its figures into ``pictures/`` beside it.

    Parameters
    ----------
    path : Path
        A document with places for parts of the report, which are filled; where there is no file, all parts are written.
    report : Parts
        What it says.

    Returns
    -------
    list of Path
        The files written; figures only of the parts that are in the document.

    Raises
    ------
    ResultError
        If the document has no place, or one for a part that there is none of, or a file cannot be read or written.
    """
    parts = {part.anchor: part for part in report.all()}
    whole = "\n\n".join(f"## {part.title}\n\n{_place(name, '')}" for name, part in parts.items() if part.items)
    try:
        text = path.read_text(encoding="utf-8") if path.exists() else f"# Sweep of landmark detectors\n\n{whole}\n"
    except (OSError, UnicodeDecodeError) as error:
        raise ResultError(unreadable(path, error) if isinstance(error, OSError) else f"{path}: is not UTF-8") from error
    wanted = [match.group(1) for match in _PLACE.finditer(text)]
    if not wanted:
        raise ResultError(f"{path}: has no place for the report; add lines such as {_place('findings', '')!r}")
    for name in wanted:
        if name not in parts:
            raise ResultError(f"{path}: {no_such('part of the report', name, parts)}")
    charts = [chart for name in wanted for chart in _charts(parts[name].items)]
    stem, files = path.stem, [path]
    if charts:
        make_folder(path.parent / _PICTURES)
    for chart in charts:
        files.append(path.parent / _PICTURES / f"{stem}_{chart.name}.svg")
        write_text(files[-1], chart.drawing.text)
    write_text(path, _PLACE.sub(lambda match: _place(match.group(1), _part(parts[match.group(1)], stem)), text))
    return files


def _place(name: str, content: str) -> str:
    return f"<!-- sweep:{name} -->\n{content}<!-- /sweep:{name} -->"


def _part(part: Part, stem: str) -> str:
    texts = [text for item in part.items if (text := _item(item, stem))] or ["Nothing of this was run."]
    return "".join(f"{text}\n\n" for text in texts)


def _charts(items: Sequence[Item]) -> list[Chart]:
    return [chart for item in items if isinstance(item, Charts) for chart in item.charts]


def _item(item: Item, stem: str) -> str:
    match item:
        case Words(text):
            return text
        case Points(texts):
            return "\n".join(f"- {text}" for text in texts)
        case Heading(text):
            return f"**{text}**"
        case Code(text, language):
            return f"```{language}\n{text}\n```" if language else f"`{text}`"
        case Table(_, caption, headers, rows):
            lines = [headers, ["---"] * len(headers)]
            lines += [[f"*{row.name}*" if row.aside else row.name, *map(_cell, row.cells)] for row in rows]
            return f"{caption}:\n\n" + "\n".join(f"| {' | '.join(line)} |" for line in lines)
        case Charts(charts):
            images = "\n".join(
                f'<img src="{_PICTURES}/{stem}_{chart.name}.svg" alt="{escape(chart.alt)}" width="49%">'
                for chart in charts
            )
            return f"<p>\n{images}\n</p>"
        case Folded():
            return ""


def _cell(cell: Cell) -> str:
    text = f"{cell.text} ({cell.small})" if cell.small else cell.text
    text = text.replace("|", "\\|").replace("<", "&lt;")
    return f"**{text}**" if cell.better else text
