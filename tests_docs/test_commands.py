"""Every command in a document is run, or, where that needs a robot, held against the real parser."""

import re
from pathlib import Path

import pytest
from commands import DOCUMENTS, ELSEWHERE, FOLLOWED, ONCE, ROOT, SERVES, blocks, needs, unsaid
from made import Made
from running import check_install, check_line, check_make, run_line, run_python, serve_line

THEORY = ROOT / "docs" / "theory"  # tests/test_theory.py runs it, and holds what it prints against the page
RUN = [
    document
    for document in DOCUMENTS
    if any(block.run for block in blocks(document))
    and (document.parent != THEORY or document.stem == "index")
    and document.relative_to(ROOT).as_posix() not in FOLLOWED
]
CLONE = re.compile(r"git clone |\.ci/run")


def named(document: Path) -> str:
    return document.relative_to(ROOT).as_posix()


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    return Made(tmp_path_factory.mktemp("made"))


@pytest.mark.parametrize("document", RUN, ids=named)
def test_the_commands_of_a_document_run_as_they_stand(document: Path, made: Made, tmp_path: Path) -> None:
    for name in needs(document):
        made.put(name, tmp_path)
    for block in blocks(document):
        said = ""
        if block.file:
            (tmp_path / block.title).write_text(block.text)
        elif block.run and block.kind == "python":
            said = run_python(block.text, tmp_path)
        elif block.run:
            for line in block.lines():
                if "pip install" in line:
                    check_install(line)
                elif line.startswith("make "):  # .ci/run runs them
                    check_make(line.partition(" #")[0].split())
                elif block.title == SERVES:
                    said += serve_line(line, tmp_path)
                elif not CLONE.match(line):
                    said += run_line(line, tmp_path)
        assert not block.run or unsaid(block.shown, said) == [], said


@pytest.mark.parametrize("document", DOCUMENTS, ids=named)
def test_what_cannot_be_run_here_is_what_the_program_understands(document: Path) -> None:
    for block in blocks(document):
        if block.kind == "python":
            compile(block.text, named(document), "exec")
        if block.title and not block.file:
            assert block.title in (*ELSEWHERE, ONCE, SERVES), (
                f"{block.title!r} is none of the titles of blocks that are not run"
            )
            for line in block.lines() if block.kind == "bash" else []:
                check_line(line)


def test_what_a_block_shows_is_held_against_what_it_said() -> None:
    said = "RMSE x, m     0.0014   -0.1300\nscans: 600 in 20 s\n"
    assert unsaid("RMSE x, m   0.0021  0.2000\nscans: 5 in 7 s\nwhatever …\n", said) == []
    for stale in ("RMSE x, m  0.002  0.2000", "RMSE of x, m  0.0021  0.2000", "scans: 5 in 7.5 s"):
        assert unsaid(stale, said) == [stale]


def test_no_command_stands_where_no_test_looks() -> None:
    """An indented block, or one of another kind than bash, would not be run."""
    for document in DOCUMENTS:
        text = re.sub(r"^( *)```bash.*?^\1```$", "", document.read_text(), flags=re.MULTILINE | re.DOTALL)
        stray = re.findall(r"^ *(?:contourslam|ros2 launch|pip install|python|make|git) .*$", text, re.MULTILINE)
        assert stray == [], named(document)


def test_what_a_clone_makes_is_run_by_the_continuous_integration() -> None:
    lines = [line for document in DOCUMENTS for block in blocks(document) if block.run for line in block.lines()]
    made = {line.split()[1] for line in lines if line.startswith("make ")}
    run = set(re.findall(r"^make ([\w-]+)", (ROOT / ".ci" / "run").read_text(), re.MULTILINE))
    measured = {target for target in made if target.startswith("bench")}
    assert made - measured - run <= {"robot-in-the-loop", "firmware", "docs"}  # parts of test-firmware and test-docs
