"""Joints that the server has accepted, on the disk: one that starts anew joins the same maps without searching."""

import json
import os
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from contourslam.joining.joint import Evidence, Joint, Tie

NAME = "joints.jsonl"
Owner = tuple[str, int, int]  # robot, run, number of a keyframe in it


@dataclass(frozen=True, slots=True)
class KeptJoint:
    """A joint, in the numbers of the runs: these hold whatever numbers the common maps have.

    Attributes
    ----------
    at : float
        s, in the clock of whoever drove the server.
    joint : Joint
        Its ties in their order as below.
    first, second : tuple of (str, int, int)
        Robot, run and keyframe of either side of each tie.
    """

    at: float
    joint: Joint
    first: tuple[Owner, ...]
    second: tuple[Owner, ...]

    def renumbered(self, first: Callable[[Owner], int | None], second: Callable[[Owner], int | None]) -> Joint:
        """Give the joint with its ties in other numbers, without those that have none."""
        ends = zip(self.joint.ties, map(first, self.first), map(second, self.second), strict=True)
        ties = (replace(tie, first=a, second=b) for tie, a, b in ends if a is not None and b is not None)
        return replace(self.joint, ties=tuple(ties))


def keep_joint(folder: Path, kept: KeptJoint) -> None:
    """Add a joint to those of a folder.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    with (folder / NAME).open("a") as file:
        file.write("\n" + json.dumps(asdict(kept), default=_plain) + "\n")  # a line before may have been torn
        file.flush()
        os.fsync(file.fileno())


def kept_joints(folder: Path) -> Iterator[KeptJoint]:
    """Read the joints of a folder in their order, but for what a crash has left half written: that is looked for again.

    Raises
    ------
    OSError
        If they cannot be read.
    """
    path = folder / NAME
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            kept = _kept(json.loads(line))
        except (ValueError, TypeError, KeyError):
            continue
        yield kept


def _kept(row: dict[str, Any]) -> KeptJoint:
    joint = row["joint"]
    ties = tuple(
        Tie(tie["first"], tie["second"], np.array(tie["pose"]), np.array(tie["covariance"]))
        for tie in joint["ties"]  # older files say more of each, which nobody needs
    )
    whole = Joint(np.array(joint["pose"]), ties, Evidence(**joint["evidence"]), joint["method"])
    owners = (tuple((str(name), int(run), int(key)) for name, run, key in row[end]) for end in ("first", "second"))
    return KeptJoint(float(row["at"]), whole, *owners)


def _plain(value: Any) -> Any:
    return value.tolist()
