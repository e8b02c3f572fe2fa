"""The notebook of the documents runs to its last cell, without a warning, and shows what it speaks of."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("matplotlib")

NOTEBOOK = Path(__file__).parents[1] / "docs" / "notebook.py"

# Runs the cells as a notebook does: the value of a last line is shown.
RUNNER = r"""
import ast, re, sys, warnings
from pathlib import Path
warnings.simplefilter("error")
import matplotlib
matplotlib.use("agg")
import matplotlib.pyplot as plt
pictures = []
plt.show = lambda: (pictures.extend(plt.get_fignums()), plt.close("all"))
names = {"__name__": "__main__"}
shown = []
for number, cell in enumerate(re.split(r"^# %%.*$", Path(sys.argv[1]).read_text(encoding="utf-8"), flags=re.M)):
    tree = ast.parse(cell)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, f"cell {number}", "exec"), names)
    if last is not None:
        value = eval(compile(ast.Expression(last.value), f"cell {number}", "eval"), names)
        if hasattr(value, "_repr_html_"):
            shown.append(type(value).__name__)
            assert value._repr_html_().startswith("<div")
print("pictures:", len(pictures))
print("shown:", *shown)
"""


@pytest.fixture(scope="module")
def said() -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", RUNNER, str(NOTEBOOK)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return done.stdout


def test_the_notebook_runs_and_shows_its_results_and_pictures(said: str) -> None:
    assert "pictures: 5\n" in said
    for kind in ("LaserScan", "Contours", "Detection", "RunResult"):
        assert kind in said.splitlines()[-1]


def test_the_map_beats_the_wheels_as_the_notebook_says(said: str) -> None:
    mapped, wheels = (float(re.search(rf"{what}: ([\d.]+) mm", said)[1]) for what in ("position", "alone"))
    assert mapped < 0.2 * wheels


def test_jupytext_takes_it_for_a_notebook() -> None:
    jupytext = pytest.importorskip("jupytext")
    cells = jupytext.read(NOTEBOOK).cells
    assert {cell.cell_type for cell in cells} == {"markdown", "code"}
    assert cells[0].source.startswith("# ")
    lines = [line for cell in cells if cell.cell_type == "code" for line in cell.source.splitlines()]
    assert max(map(len, lines)) <= 100  # what a page shows without scrolling
