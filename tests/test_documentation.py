"""What the documents name is there."""

import importlib
import re
import shlex
import subprocess
import sys
from pathlib import Path

from contourslam.cli import main
from contourslam.cli.entry import COMMANDS, command_class, parse

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


def resolves(name: str) -> bool:
    """Whether a dotted name below the package is a module or something in one."""
    parts = name.split(".")
    for cut in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(["contourslam", *parts[:cut]]))
        except ModuleNotFoundError:
            continue
        return cut == len(parts) or (cut == len(parts) - 1 and hasattr(found, parts[cut]))
    return False


def test_every_function_that_the_equations_lead_to_exists() -> None:
    text = (ROOT / "docs" / "paper.md").read_text()
    rows = [line for line in text.splitlines() if line.startswith("|")]
    names = [name for line in rows for name in re.findall(r"`([a-z_]+\.[A-Za-z_.]+)`", line)]
    assert len(names) > 30
    assert [name for name in names if not resolves(name)] == []


def test_every_full_name_in_a_document_exists() -> None:
    names = {
        name
        for document in DOCUMENTS
        for name in re.findall(r"`contourslam\.([a-z_]+(?:\.[A-Za-z_]+)*)`", document.read_text())
    }
    assert names
    assert [name for name in sorted(names) if not resolves(name)] == []


def test_every_link_between_documents_leads_somewhere() -> None:
    links = [
        (document, target)
        for document in DOCUMENTS
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", document.read_text())
        if not target.startswith("figures/")  # drawn when the site is built, whose own test follows its links
    ]
    assert links
    assert [link for link in links if not (link[0].parent / link[1]).exists()] == []


def test_the_package_is_installed_from_a_clone_for_it_is_on_no_index() -> None:
    more = [ROOT / "docs" / "notebook.py", ROOT / "ros2" / "contourslam_ros" / "README.md"]
    texts = {document: document.read_text() for document in [*DOCUMENTS, *more]}
    assert any(re.search(r"pip install '?[./]", text) for text in texts.values())
    assert [d.name for d, text in texts.items() if re.search(r"pip install (-\S+ )*['\"]?contourslam", text)] == []


def test_every_benchmark_has_its_place_in_the_tables() -> None:
    text = (ROOT / "BENCHMARK.md").read_text()
    for script in (ROOT / "benchmarks").glob("bench_*.py"):
        name = script.stem.removeprefix("bench_")
        assert f"<!-- {name} -->" in text
        assert f"<!-- /{name} -->" in text


def test_every_command_in_a_document_parses() -> None:
    lines = [line.strip() for document in DOCUMENTS for line in document.read_text().splitlines()]
    commands = [line for line in lines if re.match(r"contourslam [a-z]", line)]
    assert {line.split()[1] for line in commands} >= COMMANDS.keys() - {"compare"}
    for line in commands:
        alone = re.sub(r" --config \S+", "", re.split(r" (?:>|\||&&) ", line)[0])  # the file is made by another line
        words = shlex.split(alone, comments=True)[1:]
        assert type(parse(words)) is command_class(words[0])


def test_the_python_code_of_readme_runs(tmp_path: Path) -> None:
    recording = tmp_path / "recording"
    assert main(["simulate", "-o", str(recording), "--duration", "2"]) == 0
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    assert "my_log.bag" in code
    command = [sys.executable, "-W", "error", "-c", code.replace("my_log.bag", str(recording))]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert len(done.stdout.splitlines()) >= 20
