"""Pages and pictures that are made when the site is built: reference, gallery, figures, files that are linked to."""

import ast
import os
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from links import INCLUDED, ROOT, anchor_of_example, files_linked, page_of

PACKAGE = ROOT / "src" / "contourslam"
_HIDDEN = "---\nsearch:\n  exclude: true\n---\n\n"


def included() -> Iterator[tuple[str, str]]:
    """Documents that stand outside ``docs/``."""
    for document, page in INCLUDED.items():
        yield page, (ROOT / document).read_text()


def rooms() -> dict[str, str]:
    """Every package, and every module right below the whole, with the first line of its docstring; by dotted name."""
    sources = [*PACKAGE.glob("*.py"), *PACKAGE.rglob("*/__init__.py")]
    found = {_dotted(path): _summary(path) for path in sources if path != PACKAGE / "__init__.py"}
    return dict(sorted(found.items()))


def reference() -> Iterator[tuple[str, str]]:
    """One page for each of them, and a list."""
    whole = "::: contourslam\n    options: {show_submodules: false}"
    lines = ["# Reference", "", whole, "", "| module | what |", "|---|---|"]
    for name, summary in rooms().items():
        lines.append(f"| [`{name}`]({name}.md) | {summary} |")
        yield f"reference/{name}.md", _room_page(name)
    yield "reference/index.md", "\n".join(lines) + "\n"


def _room_page(name: str) -> str:
    """A package's docstring with those of its modules; packages inside it have pages of their own."""
    modules = sorted(ROOT.joinpath("src", *name.split(".")).glob("*.py"))
    inner = [f"{name}.{path.stem}" for path in modules if not path.stem.startswith("_")]
    whole = f"::: {name}\n    options: {{heading_level: 1, show_submodules: false}}"
    return "\n\n".join([whole, *(f"::: {module}" for module in inner)]) + "\n"


def _dotted(path: Path) -> str:
    place = path.parent if path.stem == "__init__" else path.with_suffix("")
    return ".".join(place.relative_to(ROOT / "src").parts)


def sources(pages: dict[str, str]) -> Iterator[tuple[str, str]]:
    """A view of each file that a page links to and that is no page itself."""
    linked = {path for page, text in pages.items() for path in files_linked(text, page)}
    for path in sorted(linked):
        page = page_of(path)
        if page.startswith("source/") and (ROOT / path).is_file():
            kind = {".py": "python", ".json": "json", ".yaml": "yaml", ".h": "cpp"}.get(Path(path).suffix, "text")
            text = (ROOT / path).read_text()
            yield page, f"{_HIDDEN}# {path}\n\n``````{kind}\n{text}\n``````\n"


def figures(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Figures of the theory pages: what each ``figure_NAME`` of ``figures.py`` returns, as ``figures/NAME.svg``."""
    from contourslam.report.figures.save import save_figure

    script = folder / "figures.py"
    if not script.exists():
        return
    place = script.parent.relative_to(ROOT / "docs").as_posix()
    with tempfile.TemporaryDirectory() as temporary:
        for name, function in runpy.run_path(str(script)).items():
            if name.startswith("figure_"):
                picture = Path(temporary) / f"{name.removeprefix('figure_')}.svg"
                save_figure(function(), picture)
                yield f"{place}/figures/{picture.name}", picture.read_bytes()


def gallery() -> Iterator[tuple[str, str | bytes]]:
    """The examples: what each draws and prints now, and its code."""
    paths = sorted((ROOT / "examples").glob("[0-9]*.py"))
    with tempfile.TemporaryDirectory() as temporary, ThreadPoolExecutor(os.cpu_count()) as pool:
        pictures = [Path(temporary) / f"{path.stem}.svg" for path in paths]
        prints = list(pool.map(run_example, paths, pictures))
        for picture in pictures:
            yield f"gallery/{picture.name}", picture.read_bytes()
    text = [(ROOT / "docs" / "build" / "gallery.md").read_text()]
    for path, printed in zip(paths, prints, strict=True):
        title, _, rest = ast.get_docstring(ast.parse(path.read_text()), clean=True).partition("\n")  # type: ignore[union-attr]
        name, _, more = title.rstrip(".").partition(": ")
        code = path.read_text().split('"""\n', maxsplit=1)[1].strip()
        text += [
            f"## {name} {{ #{anchor_of_example(path.stem)} }}",
            f"{more[:1].upper()}{more[1:]}." if more else "",
            rest.split("\n\n    ")[0].split("\n\nusage:")[0].strip(),
            f"![What examples/{path.name} draws](gallery/{path.stem}.svg)",
            f"```bash\npython examples/{path.name}\n```",
            f"```text\n{printed.rstrip()}\n```",
            f'??? example "The code, examples/{path.name}"\n\n' + _indented(f"```python\n{code}\n```"),
        ]
    yield "gallery.md", "\n\n".join(filter(None, text)) + "\n"


def run_example(path: Path, picture: Path) -> str:
    """Run an example in a process of its own, keep what it draws, and give what it prints."""
    runner = Path(__file__).with_name("run_example.py")
    environment = os.environ | {"MPLBACKEND": "template"}  # draws nothing, and shows it without a word
    done = subprocess.run(
        [sys.executable, "-W", "error", str(runner), str(path), str(picture)],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        cwd=picture.parent,
    )
    if done.returncode != 0:
        raise RuntimeError(f"{path} failed:\n{done.stderr}")
    return done.stdout.replace(f"{tempfile.gettempdir()}/", "/tmp/")


def _summary(source: Path) -> str:
    docstring = ast.get_docstring(ast.parse(source.read_text())) or ""
    return docstring.partition("\n")[0]


def _indented(text: str) -> str:
    return "\n".join(f"    {line}" if line else "" for line in text.splitlines())
