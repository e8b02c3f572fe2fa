"""Where a path of the repository is on the site.

The pages are written for a code host too, so they link to files such as ``../BENCHMARK.md`` and
``../src/contourslam/slam/ekf.py``. On the site each such link leads to the page that shows the file.
"""

import posixpath
import re
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]

INCLUDED = {
    "README.md": "readme.md",
    "BENCHMARK.md": "benchmark.md",
    "CHANGELOG.md": "changelog.md",
    "DEVELOPMENT.md": "development.md",
    "firmware/mega/README.md": "firmware.md",
    "ros2/contourslam_ros/README.md": "ros2.md",
}
"""Documents outside ``docs/`` and the page that each becomes."""

PAGE_OF_FOLDER = {"examples": "gallery.md", "src/contourslam": "reference/index.md", "src": "reference/index.md"}

_FENCED = re.compile(r"^(?P<fence>`{3,}|~{3,}).*?^(?P=fence)`*~*[ ]*$", re.MULTILINE | re.DOTALL)
_TARGET = re.compile(r"""(\]\(|\bsrc="|\bhref=")([^)"\s]+)""")
_FOREIGN = re.compile(r"<script\b[^>]*>(?:(?!</script>).)*?https://cdn(?:(?!</script>).)*</script>", re.DOTALL)
_HREF = re.compile(r"""(\bhref=")([^"\s]+)""")
_OUTSIDE = re.compile(r"[a-z][a-z0-9+.-]*:|#|/")


def place_in_repository(page: str) -> str:
    """Path in the repository of what a page was made of."""
    return {page: document for document, page in INCLUDED.items()}.get(page, f"docs/{page}")


def page_of(path: str) -> str:
    """Page or file of the site, by its path below ``docs/``, that shows a file or a folder of the repository."""
    if path in INCLUDED:
        return INCLUDED[path]
    if path.startswith("docs/"):
        return path.removeprefix("docs/")
    if f"{path}/README.md" in INCLUDED:
        return INCLUDED[f"{path}/README.md"]
    if path in PAGE_OF_FOLDER:
        return PAGE_OF_FOLDER[path]
    if path.startswith("examples/"):
        return f"gallery.md#{anchor_of_example(Path(path).stem)}"
    if path.startswith("src/contourslam/"):
        return _reference(path.removeprefix("src/").removesuffix("/__init__.py"))
    return f"source/{path}.md"


def _reference(path: str) -> str:
    """Page of a package, or the place of a module on its package's page."""
    name = path.removesuffix(".py").replace("/", ".")
    room = name.rpartition(".")[0]
    if not path.endswith(".py") or room == "contourslam":
        return f"reference/{name}.md"
    return f"reference/{room}.md#{name}"


def anchor_of_example(stem: str) -> str:
    """Anchor in the gallery of the example of that file name."""
    return stem.replace("_", "-")


def outside_of_code(markdown: str, change: Callable[[str], str]) -> str:
    """Apply a change to all of a page but its fenced blocks."""
    parts, end = [], 0
    for block in _FENCED.finditer(markdown):
        parts += [change(markdown[end : block.start()]), block.group()]
        end = block.end()
    return "".join([*parts, change(markdown[end:])])


def files_linked(markdown: str, page: str) -> set[str]:
    """Paths in the repository that a page links to."""
    found = set()

    def collect(text: str) -> str:
        for target in _TARGET.finditer(text):
            if not _OUTSIDE.match(target[2]):
                found.add(_in_repository(target[2].partition("#")[0], page))
        return text

    outside_of_code(markdown, collect)
    return found


def rewritten(markdown: str, page: str) -> str:
    """Lead every link of a page to where its target is on the site."""
    return outside_of_code(markdown, lambda text: _TARGET.sub(lambda target: _lead(target, page), text))


def rewritten_html(html: str, page: str) -> str:
    """Do the same for a notebook, which was never Markdown here, and take out what it would load from elsewhere."""
    return _HREF.sub(lambda target: _lead(target, page), _FOREIGN.sub("", html))


def _lead(target: re.Match[str], page: str) -> str:
    if _OUTSIDE.match(target[2]):
        return target[0]
    path, hash_mark, anchor = target[2].partition("#")
    goal, _, own_anchor = page_of(_in_repository(path, page)).partition("#")
    anchor = anchor or own_anchor
    relative = posixpath.relpath(goal, posixpath.dirname(page) or ".")
    if target[1] == 'href="':  # MkDocs leaves HTML as it is
        relative = re.sub(r"\.md$", ".html", relative)
    return target[1] + relative + (f"#{anchor}" if anchor else hash_mark)


_FULL_NAME = re.compile(r"(?<![\[`])`(contourslam\.[a-z_]+(?:\.[A-Za-z_]\w*)*)`(?!\])")
_NAME = re.compile(r"(?<![\[`])`([a-z_]+\.[A-Za-z_.]+)`(?!\])")


def with_names_linked(markdown: str, page: str) -> str:
    """Lead each full name of something in the package to its place in the reference, where it has one."""
    markdown = outside_of_code(markdown, lambda text: _FULL_NAME.sub(lambda name: _linked(name[1], name[1]), text))
    if page == "paper.md":  # where all names are below the package
        below = outside_of_code(
            markdown, lambda text: _NAME.sub(lambda name: _linked(f"contourslam.{name[1]}", name[1]), text)
        )
        return below
    return markdown


def _linked(identifier: str, text: str) -> str:
    return f'<autoref identifier="{identifier}" optional><code>{text}</code></autoref>'


def _in_repository(target: str, page: str) -> str:
    return posixpath.normpath(posixpath.join(posixpath.dirname(place_in_repository(page)), target))
