"""Tables as others take them: CSV for a spreadsheet, LaTeX (booktabs) for a paper."""

import csv
import io
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contourslam.report.page.markup import Cell, Row

UNKNOWN = ("", "-", "–")
"""What stands where nothing is known."""
_NUMBER = r"[-−]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.(\d+))?(?:e[-+]?\d+)?"
_WITH_UNIT = re.compile(rf"({_NUMBER})( ?)(\D{{0,4}})")
_LATEX = {
    "\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}", '"': r"\textquotedbl{}",
    "θ": r"$\theta$", "σ": r"$\sigma$", "χ": r"$\chi$", "°": r"$^{\circ}$", "²": "$^2$", "±": r"$\pm$",
    "×": r"$\times$", "−": "$-$", "–": "--", "→": r"$\to$", "″": "''", "\n": " ",
}  # fmt: skip


def to_csv(headers: Sequence[str], rows: "Sequence[Row]") -> str:
    """Give a table as CSV (RFC 4180).

    A unit that all numbers of a column share goes into its header, thousands are not grouped, what is not known is
    empty, and a column of standard deviations follows the one that has them.

    Parameters
    ----------
    headers : sequence of str
        Of the rows' names first, then of their cells.
    rows : sequence of Row
    """
    names = list(headers[:1])
    columns: list[list[str]] = [[row.name for row in rows]]
    for header, cells in zip(headers[1:], _columns(headers, rows), strict=True):
        unit = _unit(cells)
        names.append(f"{header} ({unit})".strip() if unit else header)
        columns.append([_plain(cell.text, unit) for cell in cells])
        small = [cell.small for cell in cells]
        if any(small):
            spread = all(text.startswith("±") for text in small if text)
            names.append(f"{names[-1]}, {'sd' if spread else 'note'}".lstrip(", "))
            columns.append([_plain(text.removeprefix("±").strip(), unit) for text in small])
    text = io.StringIO()
    csv.writer(text).writerows([names, *zip(*columns, strict=True)])
    return text.getvalue()


def to_latex(caption: str, headers: Sequence[str], rows: "Sequence[Row]") -> str:
    r"""Give a table as LaTeX with booktabs' rules; numbers of a column stand with their points below each other.

    Parameters
    ----------
    caption : str
    headers, rows
        As :func:`to_csv`. Cells marked as better are bold.
    """
    kinds, titles, columns = "l", [latex(headers[0])] if headers else [], [[latex(row.name) for row in rows]]
    for header, cells in zip(headers[1:], _columns(headers, rows), strict=True):
        unit = _unit(cells)
        numbers = [_WITH_UNIT.fullmatch(cell.text) for cell in cells]
        kinds += "r" if any(numbers) else "l"
        titles.append(latex(f"{header} ({unit})".strip() if unit else header))
        places = max((len(found[2] or "") for found in numbers if found), default=0)
        widest = max((cell.small for cell in cells), key=len, default="")
        columns.append([_latex_cell(cell, unit, places, widest) for cell in cells])
    lines = [" & ".join(line) + r" \\" for line in (titles, *zip(*columns, strict=True))]
    body = [r"\toprule", lines[0], r"\midrule", *lines[1:], r"\bottomrule"]
    return "\n".join(
        [
            r"% \usepackage{booktabs}",
            r"\begin{table}",
            r"  \centering",
            f"  \\caption{{{latex(caption)}}}",
            f"  \\begin{{tabular}}{{{kinds}}}",
            *(f"    {line}" for line in body),
            r"  \end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def latex(text: str) -> str:
    """Escape a text for LaTeX."""
    return "".join(_LATEX.get(sign, sign) for sign in text)


def _columns(headers: Sequence[str], rows: "Sequence[Row]") -> "list[list[Cell]]":
    return [[row.cells[at] for row in rows] for at in range(len(headers) - 1)]


def _unit(cells: "Sequence[Cell]") -> str:
    """Unit of all numbers in a column; nothing where they have several, or some cell is no number."""
    known = [_WITH_UNIT.fullmatch(cell.text) for cell in cells if cell.text not in UNKNOWN]
    units = {found[4] if found else "" for found in known}
    return units.pop() if len(units) == 1 else ""


def _plain(text: str, unit: str) -> str:
    if text in UNKNOWN:
        return ""
    found = _WITH_UNIT.fullmatch(text)
    if found is None or found[4] not in ("", unit):
        return text
    return found[1].replace(",", "").replace("−", "-")


def _latex_cell(cell: "Cell", unit: str, places: int, widest: str) -> str:
    found = _WITH_UNIT.fullmatch(cell.text)
    shown = latex(cell.text.removesuffix(unit).strip().replace("-", "−") if found else cell.text)
    text = rf"\textbf{{{shown}}}" if cell.better else shown
    if found and found[4] in ("", unit) and (lacking := places - len(found[2] or "")):
        point = "" if found[2] else "."
        text += rf"\phantom{{{point}{'0' * lacking}}}"
    if cell.small:
        text += f" {latex(cell.small)}"
    elif found and widest:
        text += rf" \phantom{{{latex(widest)}}}"
    return text
