"""The theory pages: equations that convert, names that exist, blocks that print what they say, figures that draw."""

import contextlib
import importlib
import io
import re
import runpy
from collections.abc import Callable
from pathlib import Path

import pytest
from latex2mathml.converter import convert
from matplotlib.figure import Figure
from matplotlib.text import Text

from contourslam.report.figures.save import save_figure

FOLDER = Path(__file__).parents[1] / "docs" / "theory"
PAGES = sorted(set(FOLDER.glob("*.md")) - {FOLDER / "index.md"})
NAMES = [
    name
    for source in sorted((FOLDER / "drawings").glob("*.py"))
    for name in re.findall(r"^def figure_(\w+)", source.read_text(), re.MULTILINE)
]
SLOW = {"refined", "consistency", "error_bounds"}  # a second or more each, and the site's own test draws them too
BLOCK = re.compile(r"^```python\n(.*?)^```\n(?:\n```text\n(.*?)^```)?", re.MULTILINE | re.DOTALL)
ANY_BLOCK = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def prose(page: Path) -> str:
    """A page without its blocks of code."""
    return ANY_BLOCK.sub("", page.read_text())


def equations(page: Path) -> list[str]:
    """TeX of all equations, displayed and in the text."""
    text = prose(page)
    displayed = re.findall(r"\$\$(.+?)\$\$", text, re.DOTALL)
    return displayed + re.findall(r"\$([^$\n]+)\$", re.sub(r"\$\$.+?\$\$", "", text, flags=re.DOTALL))


@pytest.fixture(scope="session")
def figures() -> dict[str, Callable[[], Figure]]:
    found: dict[str, Callable[[], Figure]] = runpy.run_path(str(FOLDER / "figures.py"))["FIGURES"]
    return found


def test_every_equation_of_the_paper_has_its_place() -> None:
    text = "\n".join(prose(page) for page in PAGES)
    numbers = [
        int(n)
        for equation in re.findall(r"\$\$(.+?)\$\$", text, re.DOTALL)
        for n in re.findall(r"\\qquad \((\d+)\)$", equation)
    ]
    assert sorted(numbers) == list(range(1, 32))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_equation_becomes_mathml(page: Path) -> None:
    found = equations(page)
    assert len(found) > 5
    for tex in found:
        mathml = convert(tex)
        # What latex2mathml does not know it writes out as it stands.
        assert "\\" not in mathml, tex


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_name_on_a_page_exists(page: Path) -> None:
    names = set(re.findall(r"`(contourslam\.[\w.]+)`", prose(page)))
    assert names
    for name in names:
        module, _, thing = name.rpartition(".")
        assert hasattr(importlib.import_module(module), thing), name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_block_prints_what_the_page_shows(page: Path) -> None:
    blocks = BLOCK.findall(page.read_text())
    assert blocks
    for code, shown in blocks:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(code, str(page), "exec"), {"__name__": page.stem})
        assert printed.getvalue() == shown


def test_every_figure_is_on_a_page_and_every_picture_is_a_figure() -> None:
    shown = [name for page in PAGES for name in re.findall(r"!\[[^\]]+\]\(figures/(\w+)\.svg\)", page.read_text())]
    assert sorted(shown) == sorted(NAMES)


def test_the_registry_has_every_figure(figures: dict[str, Callable[[], Figure]]) -> None:
    assert sorted(figures) == sorted(NAMES)


@pytest.mark.parametrize("name", sorted({*NAMES} - SLOW))
def test_a_figure_draws_itself_legibly(name: str, figures: dict[str, Callable[[], Figure]], tmp_path: Path) -> None:
    figure = figures[name]()
    small = [text.get_text() for text in figure.findobj(Text) if text.get_text().strip() and text.get_fontsize() < 9.0]
    assert small == []
    assert [axes.get_title() for axes in figure.axes if axes.get_title()] == []
    save_figure(figure, tmp_path / "figure.svg")
    assert 5_000 < (tmp_path / "figure.svg").stat().st_size < 1_000_000
