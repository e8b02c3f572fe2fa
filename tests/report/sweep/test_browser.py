"""The page in a real browser: complete, as wide as a phone, and usable by those who do not see it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from contourslam.report.sweep.measures import MEASURES
from contourslam.report.sweep.page import write_sweep_report
from contourslam.report.sweep.parts import Parts
from contourslam.report.sweep.reading import sweep_of

pytest.importorskip("scipy")


@pytest.fixture(scope="module")
def page(
    sweep_rows: Callable[..., Any], log_rows: list[dict[str, Any]], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    folder = tmp_path_factory.mktemp("report")
    sweep = sweep_of([*sweep_rows((0.8, 1.0, 1.0, 1.0), failed=[("wu", 0)]), *log_rows], ["name = 'a'"])
    measures = [MEASURES["position"], MEASURES["false_negatives"]]
    write_sweep_report(folder, Parts(sweep, measures, "contourslam sweep-report a -o b"))
    return folder / "index.html"


@pytest.mark.parametrize("width", [390, 1280])
def test_it_asks_for_nothing_and_fits(page: Path, browse: Callable[..., Any], width: int) -> None:
    seen = browse(page, width=width)
    assert (seen.requests, seen.errors, seen.broken, seen.overflow) == ([], [], [], 0)


def test_axe_finds_no_fault(page: Path, browser: Any) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    for scheme, width in (("light", 1280), ("dark", 390)):
        with browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme) as context:
            tab = context.new_page()
            tab.goto(page.as_uri())
            tab.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
            assert [fault["id"] for fault in axe.Axe().run(tab).response["violations"]] == []
