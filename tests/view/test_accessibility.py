"""The page for those who do not see it, do not see it well, or have no mouse: checked by axe, and by its keys."""

import math

import pytest

from contourslam.view.pace import Pace

STATE = "contourslam.model.status?.state"


@pytest.fixture(scope="module")
def faults():
    """Ask axe what is wrong with a page, in words."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
    checker = axe.Axe()

    def ask(page) -> list[str]:
        found = checker.run(page).response["violations"]
        return [f"{fault['id']}: {node['target']} {node['html']}" for fault in found for node in fault["nodes"]]

    return ask


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 360])
def test_axe_finds_nothing_while_it_is_mapped_and_a_corner_is_open(served, opened, wait, faults, scheme, width) -> None:
    one, server = served(60, ("matched_filter", "wu"), pace=Pace(math.inf))
    page = opened(server, width=width, color_scheme=scheme)
    wait(page, f"{STATE} === 'finished' && contourslam.model.maps.length === 2 && contourslam.drawn === 59")
    page.evaluate("document.querySelector('#layers').open = true")
    page.evaluate(
        "(() => { const goto = document.querySelector('#goto'); goto.value = contourslam.model.maps[0].corner_ids[0];"
        "goto.dispatchEvent(new Event('change')); })()"
    )
    wait(page, "!document.querySelector('#cornercard').hidden && contourslam.model.story")
    one.show.memory.add_event(1.0, "trouble", "the cable was pulled")
    wait(page, "document.querySelector('#events li .trouble')")
    assert faults(page) == []
    page.select_option("#speed", "0.5")
    page.click("#play")  # again from the beginning
    wait(page, "contourslam.model.status.at !== null && contourslam.model.frame.index < 40")
    assert faults(page) == []
