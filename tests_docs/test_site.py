"""The documentation site: built strictly, whole, complete, and at home."""

import ast
import functools
import http.server
import os
import shutil
import subprocess
import sys
import threading
import zlib
from collections.abc import Iterator
from pathlib import Path

import pytest
from links import Page, dead_links, outside

pytestmark = pytest.mark.xdist_group("site")  # it is built once
ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "contourslam"
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
VISITED = ["index.html", "tutorial.html", "theory/filter.html", "gallery.html", "notebook.html", "readme.html"]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [Path(sys.executable).with_name("mkdocs"), "build", "--strict", "--site-dir", folder]
    quiet = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=quiet, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "WARNING -" not in done.stderr
    return folder


@pytest.fixture(scope="module")
def served(site: Path) -> Iterator[str]:
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_: object) -> None: ...

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site)) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()
        thread.join()


def public_names() -> list[str]:
    """Every public module, class, function and method, as their sources have them."""
    found = []
    for path in sorted(PACKAGE.rglob("*.py")):
        place = path.parent if path.stem == "__init__" else path.with_suffix("")
        module = ".".join(place.relative_to(PACKAGE.parent).parts)
        if "._" not in module:
            tree = ast.parse(path.read_text())
            assert ast.get_docstring(tree), f"{module} has no docstring"
            found += [module, *_inside(tree, module)]
    return found


def _inside(tree: ast.Module | ast.ClassDef, scope: str) -> Iterator[str]:
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            name = f"{scope}.{node.name}"
            assert ast.get_docstring(node), f"{name} has no docstring"
            yield name
            if isinstance(node, ast.ClassDef):
                yield from _inside(node, name)


def test_every_public_name_is_in_the_reference(site: Path) -> None:
    inventory = zlib.decompress((site / "objects.inv").read_bytes().split(b"\n", 4)[4]).decode()
    listed = {line.split()[0] for line in inventory.splitlines()}
    names = public_names()
    assert len(names) > 1000
    assert [name for name in names if name not in listed] == []


def test_no_link_inside_the_site_is_dead(site: Path) -> None:
    assert dead_links(site) == []


def test_no_page_loads_anything_from_elsewhere(site: Path) -> None:
    loaded = {link for path in site.rglob("*.html") for link in Page(path).loaded}
    assert len(loaded) > 20
    assert [link for link in sorted(loaded) if outside(link) and not link.startswith("data:")] == []


def test_equations_are_mathml_and_none_is_left_as_tex(site: Path) -> None:
    pages = [path.read_text() for path in (site / "theory").glob("*.html")]
    assert sum(page.count("<math") for page in pages) > 50
    assert not any('class="arithmatex"' in page for page in pages)


def test_each_example_has_its_picture_in_the_gallery(site: Path) -> None:
    shown = {link for link in Page(site / "gallery.html").links if link.startswith("gallery/")}
    assert shown == {f"gallery/{path.stem}.svg" for path in (ROOT / "examples").glob("[0-9]*.py")}


def test_the_pages_work_in_a_browser_and_ask_nothing_of_others(served: str) -> None:
    if CHROMIUM is None:
        pytest.skip("no Chromium on this machine")
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    wrong: list[str] = []
    options = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--disable-background-networking"]
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=options)
        page = browser.new_page()
        page.on("request", lambda asked: wrong.append(asked.url) if not _at_home(asked.url, served) else None)
        page.on("console", lambda said: wrong.append(said.text) if said.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: wrong.append(str(error)))
        for name in [*VISITED, "reference/contourslam.slam.html"]:
            page.goto(served + name)
            page.wait_for_load_state("networkidle")
            assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), name
            broken = page.evaluate("[...document.images].filter(i => i.complete && !i.naturalWidth).map(i => i.src)")
            assert broken == [], name
        page.set_viewport_size({"width": 390, "height": 800})
        for name in VISITED:
            page.goto(served + name)
            assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), f"{name} on a phone"
        page.set_viewport_size({"width": 1280, "height": 800})
        page.goto(served)
        page.fill("input.md-search__input", "covariance")
        page.wait_for_selector(".md-search-result__item")
        browser.close()
    assert wrong == []


def _at_home(address: str, served: str) -> bool:
    return address.startswith((served, "data:", "blob:")) or not outside(address)
