"""Links of a built site, followed."""

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag


class Page(HTMLParser):
    """Anchors and links of one page, and among these what it loads by itself."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if value and (name == "id" or (name == "name" and tag == "a")):
                self.anchors.add(value)
            elif value and name in ("href", "src") and tag != "base":
                self.links.append(value)
                if name == "src" or tag == "link":
                    self.loaded.append(value)


def outside(link: str) -> bool:
    return "://" in link or link.startswith(("mailto:", "data:", "//"))


def dead_links(site: Path) -> list[str]:
    """Each link that leads to no file of the site, or to no anchor of its page."""
    pages = {path: Page(path) for path in site.rglob("*.html")}
    dead = []
    for path, page in pages.items():
        for link in page.links:
            if outside(link):
                continue
            goal, anchor = urldefrag(link)
            base = site if goal.startswith("/") else path.parent  # the page for what is not found has absolute links
            target = (base / unquote(goal).lstrip("/")).resolve() if goal else path
            target = target / "index.html" if target.is_dir() else target
            lost = target in pages and anchor and unquote(anchor) not in pages[target].anchors
            if not target.is_file() or lost:
                dead.append(f"{path.relative_to(site)}: {link}")
    return dead
