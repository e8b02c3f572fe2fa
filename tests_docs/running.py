"""Lines of the documents, run as a reader would paste them."""

import os
import re
import shlex
import signal
import subprocess
import sys
import threading
from pathlib import Path
from queue import Empty, Queue

from contourslam.cli.entry import command_class, parse

ROOT = Path(__file__).parents[1]
BIN = Path(sys.executable).parent
LIMIT = 200.0  # s that one line may take


def environment() -> dict[str, str]:
    """Path with the commands of this environment first; no browser opens."""
    return os.environ | {"PATH": f"{BIN}:{os.environ['PATH']}", "BROWSER": "true", "PYTHONUNBUFFERED": "1"}


def run_line(line: str, folder: Path) -> str:
    """Run a line of a shell, which must succeed, and give what it says."""
    done = subprocess.run(
        ["bash", "-c", line], cwd=folder, env=environment(), capture_output=True, text=True, timeout=LIMIT, check=False
    )
    said = done.stdout + done.stderr
    assert done.returncode == 0, f"{line}\nexit code {done.returncode}\n{said}"
    assert "Traceback" not in said, f"{line}\n{said}"
    return said


def run_python(code: str, folder: Path) -> str:
    """Run a block of Python, which must succeed."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env=environment() | {"MPLBACKEND": "template"},
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert done.returncode == 0, f"{code}\n{done.stderr}"
    return done.stdout


def serve_line(line: str, folder: Path) -> str:
    """Start what serves until Ctrl-C, wait for its address, press Ctrl-C."""
    process = subprocess.Popen(
        ["bash", "-c", f"exec {line}"],
        cwd=folder,
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    lines: Queue[str] = Queue()
    reader = threading.Thread(target=lambda: [lines.put(said) for said in process.stdout], daemon=True)  # type: ignore[union-attr]
    reader.start()
    said = ""
    try:
        while "http://" not in said:
            try:
                said += lines.get(timeout=LIMIT if process.poll() is None else 1.0)
            except Empty:
                raise AssertionError(f"{line}\nno address was told\n{said}") from None
        os.killpg(process.pid, signal.SIGINT)
        code = process.wait(LIMIT)
    finally:
        process.kill()
        process.wait()
        reader.join(10.0)
        process.stdout.close()
    while not lines.empty():
        said += lines.get()
    assert code in (0, 130), f"{line}\nexit code {code}\n{said}"
    assert "Traceback" not in said, f"{line}\n{said}"
    return said


def check_install(line: str) -> None:
    """Every extra that a line of pip asks for must exist."""
    import tomllib

    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    for names in re.findall(r"\[([\w,]+)\]", line):
        assert set(names.split(",")) <= extras.keys(), line


def check_line(line: str) -> None:
    """Hold a line that is not run against what there is: parser, launch files, targets, paths."""
    for part in re.split(r"&&|\|\||\||;", re.sub(r"\s>\s*\S+", "", _without_comment(line))):
        words = shlex.split(part)
        if words[:1] == ["sudo"]:
            words = words[1:]
        if not words:
            continue
        if words[0] == "contourslam":
            assert type(parse(words[1:])) is command_class(words[1]), line
        elif words[:3] == ["ros2", "launch", "contourslam_ros"]:
            assert (ROOT / "ros2" / "contourslam_ros" / "launch" / words[3]).is_file(), line
        elif words[0] == "make":
            check_make(words)
        elif "pip" in Path(words[0]).name:
            check_install(line)
        for word in words:
            if word.split("/")[0] in ("ros2", "firmware", "examples", "deploy", "docs") and "/" in word:
                assert (ROOT / word).exists(), line


def check_make(words: list[str]) -> None:
    """Every target that a line of make names must exist."""
    folder = ROOT / words[words.index("-C") + 1] if "-C" in words else ROOT
    targets = [word for word in words[1:] if "=" not in word and not word.startswith("-") and word not in words[:3:2]]
    rules = (folder / "Makefile").read_text()
    for target in targets:
        if folder != ROOT / target:
            assert re.search(rf"^{re.escape(target)}\b.*:", rules, re.MULTILINE), f"there is no target {target}"


def _without_comment(line: str) -> str:
    return re.sub(r"\s#.*$|^#.*$", "", line)
