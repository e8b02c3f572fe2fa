"""What MkDocs calls while it builds the site (``hooks`` in mkdocs.yml)."""

from collections.abc import Iterator
from typing import Any

from links import ROOT, rewritten, rewritten_html, with_names_linked
from mathml import with_mathml
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from pages import figures, gallery, included, reference, rooms, sources


def on_config(config: MkDocsConfig) -> None:
    """Fill the reference's place in the navigation."""
    for entry in config.nav or []:
        if "Reference" in entry:
            entry["Reference"] += [{name.removeprefix("contourslam."): f"reference/{name}.md"} for name in rooms()]


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what is made and not written."""
    for path, content in _made():
        files.append(File.generated(config, path, content=content))
    texts = {file.src_uri: file.content_string for file in files.documentation_pages() if file.src_uri.endswith(".md")}
    for path, text in sources(texts):
        files.append(File.generated(config, path, content=text))
    return files


def _made() -> Iterator[tuple[str, str | bytes]]:
    yield from included()
    yield from reference()
    yield from gallery()
    yield from figures(ROOT / "docs" / "theory")


def on_page_markdown(markdown: str, page: Page, **_: Any) -> str:
    """Lead links and names to where their targets are on the site."""
    uri = page.file.src_uri
    return with_names_linked(rewritten(markdown, uri), uri)


def on_page_content(html: str, page: Page, **_: Any) -> str:
    """Write equations as MathML, and lead the links of the notebook, which comes as HTML."""
    uri = page.file.src_uri
    return rewritten_html(html, uri) if uri.endswith(".py") else with_mathml(html)
