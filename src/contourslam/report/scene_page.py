"""The pictures of a 3-D scene in the page of the run that it was made from."""

import json
import re
from pathlib import Path
from typing import Any

from contourslam.atomic import write_text
from contourslam.errors import ResultError
from contourslam.report.page.markup import Picture, Section, figure, paragraph

_FOLDER = "scene"


def scene_section(folder: Path) -> Section | None:
    """Give the section about the scene in a result folder; None where there is none.

    Raises
    ------
    ResultError
        If what the folder says about the scene cannot be read.
    """
    path = folder / _FOLDER / "scene.json"
    if not path.exists():
        return None
    try:
        about: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        pictures = [
            (folder / _FOLDER / name, name, *_size(folder / _FOLDER / name)) for name in ("preview.png", "inside.png")
        ]
        shares = ", ".join(
            f"{float(part):.0%} of each {kind}" for kind, part in about["seen"].items() if part is not None
        )
        words = (
            f"scene/scene.glb beside this page is the model ({about['bytes'] / 1e6:.1f} MB); any glTF viewer opens it. "
            f"Pictures show {shares}; the rest is hatched. It was coloured from {about['pictures']['used']} pictures."
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ResultError(
            f"{path}: is no description of a scene ({error}); make it anew with `contourslam scene`"
        ) from error
    texts = {"preview.png": "seen from above, walls in front left out", "inside.png": "seen from inside"}
    shown = [
        figure(
            Picture(
                f"{_FOLDER}/{name}", width, height, f"The model {texts[name]}", f"The model {texts[name]}.", chart=False
            )
        )
        for _, name, width, height in pictures
    ]
    return Section("scene", "3-D scene", "".join(shown) + paragraph(words, "note"))


def _size(path: Path) -> tuple[int, int]:
    """Width and height of a PNG file."""
    with path.open("rb") as file:
        head = file.read(24)
    if len(head) < 24 or head[12:16] != b"IHDR":
        raise ValueError(f"{path.name} is no PNG file")
    return int.from_bytes(head[16:20], "big"), int.from_bytes(head[20:24], "big")


def add_scene(folder: Path) -> None:
    """Put the section into the page that is there already; without a page nothing is done.

    Raises
    ------
    ResultError
        If a file cannot be read or written.
    """
    page, section = folder / "index.html", scene_section(folder)
    if section is None or not page.exists():
        return
    try:
        text = page.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise ResultError(f"{page}: cannot be read ({error})") from error
    write_text(page, with_section(text, section))


def with_section(text: str, section: Section) -> str:
    """Put a section behind the first one of a page, in place of one of the same name."""
    block = (
        f'<section aria-labelledby="{section.anchor}">\n<h2 id="{section.anchor}">{section.title}</h2>\n'
        f"{section.body}\n</section>"
    )
    entry = f'<li><a href="#{section.anchor}">{section.title}</a></li>'
    there = re.compile(rf'\n?<section aria-labelledby="{section.anchor}">.*?</section>', re.DOTALL)
    text = there.sub("", text).replace(f"\n{entry}", "")
    text = text.replace("</section>", f"</section>\n{block}", 1)
    first = re.search(r'<li><a href="#[^"]*">[^<]*</a></li>', text)
    return text if first is None else text[: first.end()] + f"\n{entry}" + text[first.end() :]
