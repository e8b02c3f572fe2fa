"""Joints that the server has accepted, on the disk: one that starts anew joins the same maps without searching."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from contourslam.fleet.common import CommonMap
from contourslam.fleet.faults import Faults
from contourslam.fleet.inbox import Source
from contourslam.fleet.runs import Run
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


class Joints:
    """The joints of a server: kept as they are made, and those from before its begin given back; changed in place.

    Parameters
    ----------
    folder : Path or None
        None keeps nothing.
    faults : Faults
        Hear of what the disk refuses.
    """

    def __init__(self, folder: Path | None, faults: Faults) -> None:
        self._folder, self._faults = folder, faults
        self._before: list[KeptJoint] = []
        if folder is not None:
            try:
                self._before += kept_joints(folder)
            except OSError as error:
                faults.note(f"the joints that were kept cannot be read ({error}); they are looked for")

    def __len__(self) -> int:
        """Give the number of those from before that wait to be given back."""
        return len(self._before)

    def keep(self, at: float, joint: Joint, older: CommonMap, younger: CommonMap) -> None:
        """Keep a joint of two common maps, its ties being in the numbers of their keyframes."""
        if self._folder is None:
            return
        first = _owners(older, [tie.first for tie in joint.ties])
        second = _owners(younger, [tie.second for tie in joint.ties])
        try:
            keep_joint(self._folder, KeptJoint(at, joint, first, second))
        except OSError as error:
            self._faults.note(f"a joint cannot be kept ({error}); it is looked for again after a restart")

    def again(
        self, runs: Mapping[Source, Run], where: Mapping[Run, CommonMap]
    ) -> Iterator[tuple[CommonMap, CommonMap, Joint, float]]:
        """Give what was joined before, each once, as the common maps are when it is asked for.

        Parameters
        ----------
        runs : mapping of (str, int) to Run
        where : mapping of Run to CommonMap
            That each run belongs to.

        Yields
        ------
        CommonMap, CommonMap
            The older, and the younger that went into it.
        Joint
            In the numbers of their keyframes.
        float
            s, when it was made.
        """

        def common_of(owner: Owner) -> CommonMap | None:
            run = runs.get(owner[:2])
            return None if run is None else where.get(run)

        def key(common: CommonMap, owner: Owner) -> int | None:
            placed = common_of(owner) is common and owner[2] < len(runs[owner[:2]].keys)
            return runs[owner[:2]].keys[owner[2]] if placed else None

        kept, self._before = self._before, []
        for each in kept:
            older, younger = common_of(each.first[0]), common_of(each.second[0])
            if older is None or younger is None or older.number >= younger.number:
                continue
            joint = each.renumbered(partial(key, older), partial(key, younger))
            if joint.ties:
                yield older, younger, older.laid_by(joint, younger), each.at


def _owners(common: CommonMap, keys: list[int]) -> tuple[Owner, ...]:
    """Give keyframes of a common map in the numbers of their runs."""
    return tuple((run.robot, run.number, number) for run, number in (common.owners[key] for key in keys))


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
