"""The logs that the benchmarks run over: where they are, what is in them, and how a trajectory is judged by them.

They are looked for in ../shared/data, or in the folder that the variable LOGS names. Each folder in it that holds a
log (*.log.xz, *.clf.xz, or the same unpacked) counts; its reference is *.relations.xz (hand-verified relative poses)
or, for a rough look only, *.gmapping_poses.txt.xz (the poses that another system found).
"""

import os
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.evaluation.relations import RelationErrors, poses_at, relation_errors
from contourslam.evaluation.trajectory import ErrorSummary, absolute_error
from contourslam.recordings import Message, Recording, open_recording, read_relations
from contourslam.scan import Odometry
from table import ROOT

Floats = NDArray[np.float64]
Track = tuple[Floats, Floats]
"""Stamps (s), shape (t,), and poses (m, m, rad), shape (t, 3)."""


@dataclass(frozen=True)
class Log:
    """One folder with a log and what it is judged by.

    Attributes
    ----------
    name : str
    path : Path
        The log.
    relations, reference : Path or None
        Known relative poses; another system's poses.
    """

    name: str
    path: Path
    relations: Path | None
    reference: Path | None

    @cached_property
    def recording(self) -> Recording:
        """The log, opened once."""
        return open_recording(self.path)

    @cached_property
    def messages(self) -> list[Message]:
        """All that is in it, in the order of the file."""
        return list(self.recording.messages())

    @cached_property
    def odometry(self) -> Track:
        """Every reading of the wheels."""
        wheels = [message for message in self.messages if isinstance(message, Odometry)]
        return np.array([o.stamp for o in wheels]), np.array([o.pose for o in wheels])

    def relation_errors(self, track: Track) -> RelationErrors | None:
        """Hold a trajectory against the known relative poses; None where there are none."""
        if self.relations is None:
            return None
        return relation_errors(*track, *read_relations(self.relations), *self.odometry)

    def distance(self, track: Track) -> ErrorSummary | None:
        """Distance (m) from another system's poses after moving the whole trajectory to fit; None where there are none.

        The file's columns are the logger's stamp, the IPC stamp (the recordings' clock), x, y and heading.
        """
        if self.reference is None:
            return None
        rows = np.loadtxt(self.reference, ndmin=2)
        found = poses_at(rows[:, 1], *track, *self.odometry)
        return absolute_error(found, rows[:, 2:5], aligned=True).translation


def find_logs() -> list[Log]:
    """Give the logs at hand by name; none is said on the way."""
    place = Path(os.environ.get("LOGS", ROOT.parent / "shared" / "data"))
    logs = []
    for folder in sorted(path for path in place.glob("*") if path.is_dir()):
        found = [_first(folder, pattern) for pattern in ("*.log*", "*.clf*", "*.relations*", "*.gmapping_poses*")]
        path = found[0] or found[1]
        if path is not None:
            logs.append(Log(folder.name, path, *found[2:]))
    if not logs:
        print(f"no logs in {place}; name a folder of logs with LOGS=FOLDER")
    return logs


def _first(folder: Path, pattern: str) -> Path | None:
    return min(folder.glob(pattern), default=None)
