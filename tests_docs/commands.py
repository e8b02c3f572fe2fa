"""The blocks of the documents that can be run, and what they need to be there."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted(
    path
    for pattern in ("*.md", "docs/**/*.md", "firmware/mega/README.md", "ros2/contourslam_ros/README.md")
    for path in ROOT.glob(pattern)
    if "build" not in path.parts
)
"""Every document that becomes a page of the site."""

ELSEWHERE = (
    "with ROS 2",
    "on the robot",
    "on a Raspberry Pi",
    "on your computer",
    "with the firmware",
    "on a cluster",
    "minutes",
)
"""Titles of blocks that cannot be run here, or take too long: their commands are only held against the real parser."""
SERVES = "until Ctrl-C"
"""Title of a block whose commands serve until Ctrl-C."""
ONCE = "once"
"""Title of a block that installs: the newcomer's tests do that."""

FOLLOWED = tuple(f"docs/how_to/{name}.md" for name in ("own_detector", "nav2", "reading_the_report"))
"""Documents whose blocks a newcomer runs in a clone of his own: once is enough."""

_BLOCK = re.compile(
    r"^(?P<indent> *)```(?P<kind>bash|python|toml)(?: title=\"(?P<title>[^\"]*)\")?\n(?P<text>.*?)^(?P=indent)```$"
    r"(?:\s*^(?P=indent)```text\n(?P<shown>.*?)^(?P=indent)```$)?",
    re.MULTILINE | re.DOTALL,
)
_NEEDS = re.compile(r"<!-- needs: (.*?) -->")


@dataclass(frozen=True, slots=True)
class Block:
    """A block of a document: "bash", "python" or "toml", its title, its lines without what they are indented by.

    `shown` is the block of text that follows at once: what the reader is told that this one prints.
    """

    kind: str
    title: str
    text: str
    shown: str = ""

    @property
    def file(self) -> bool:
        """Whether the title names a file that the block is the content of."""
        return bool(re.fullmatch(r"[\w./-]+\.(py|yaml|sh|toml)", self.title))

    @property
    def run(self) -> bool:
        """Whether it is run where it stands."""
        return self.title in ("", SERVES) and self.kind != "toml"

    def lines(self) -> list[str]:
        """Commands of a block of the shell, one each, lines that go on joined."""
        joined = re.sub(r"\\\n\s*", " ", self.text)
        return [line for line in joined.splitlines() if line.strip() and not line.lstrip().startswith("#")]


def blocks(document: Path) -> list[Block]:
    """All blocks of a document, in order."""
    found = []
    for block in _BLOCK.finditer(document.read_text()):
        lines = block["text"].splitlines(keepends=True)
        text = "".join(line.removeprefix(block["indent"]) for line in lines)
        found.append(Block(block["kind"], block["title"] or "", text, block["shown"] or ""))
    return found


def unsaid(shown: str, said: str) -> list[str]:
    """Lines that are shown but were not said; figures may differ, their decimals not. One that ends in … may be cut."""
    known = {_shape(line) for line in said.splitlines()}
    return [line for line in shown.splitlines() if not line.endswith("…") and _shape(line) not in known]


def _shape(line: str) -> str:
    """A line with each digit before a point one nought, and those after it as many."""
    figures = re.sub(r"-?\d+(\.\d+)?", lambda figure: "0" + re.sub(r"\d", "0", figure[1] or ""), line)
    return " ".join(figures.split())


def needs(document: Path) -> list[str]:
    """Names of the files and folders that must be there before a document's commands are run."""
    return " ".join(_NEEDS.findall(document.read_text())).split()
