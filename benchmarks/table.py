"""Measured tables: printed, kept as JSON, and put between their markers into the documents that have them."""

import json
import os
import platform
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCUMENTS = (ROOT / "BENCHMARK.md", ROOT / "README.md")


@dataclass(frozen=True)
class Table:
    """What one benchmark measured.

    Attributes
    ----------
    name : str
        Marker of the table in the documents.
    columns : sequence of str
    rows : sequence of sequences
        Cells; a float is printed with three significant digits.
    """

    name: str
    columns: Sequence[str]
    rows: Sequence[Sequence[object]]

    def markdown(self) -> str:
        """Give the table as Markdown."""
        lines = [self.columns, ["---"] * len(self.columns), *([_cell(cell) for cell in row] for row in self.rows)]
        return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _cell(value: object) -> str:
    if not isinstance(value, float):
        return f"{value:,}" if isinstance(value, int) else str(value)
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def machine() -> str:
    """Name the machine that measured, in a line."""
    info = Path("/proc/cpuinfo")
    models = re.findall(r"model name\s*: (.*)", info.read_text()) if info.exists() else []
    model = models[0] if models else platform.processor() or platform.machine()
    return f"{model}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}"


def publish(table: Table) -> None:
    """Print the table, keep it as JSON, and with ``--write`` put it into the documents."""
    print(table.markdown())
    kept = ROOT / "out" / "benchmarks" / f"{table.name}.json"
    kept.parent.mkdir(parents=True, exist_ok=True)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    kept.write_text(json.dumps({"machine": machine(), "rows": rows}, indent=2) + "\n")
    if "--write" in sys.argv[1:]:
        begin, end = f"<!-- {table.name} -->", f"<!-- /{table.name} -->"
        block = f"{begin}\nOn {machine()}:\n\n{table.markdown()}\n{end}"
        pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
        places = [document for document in DOCUMENTS if pattern.search(document.read_text())]
        if not places:
            raise SystemExit(f"no document has a place for the table {table.name!r}: add {begin} and {end}")
        for document in places:
            document.write_text(pattern.sub(lambda match: block, document.read_text()))
