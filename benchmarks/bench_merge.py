"""Logs cut into parts by time, each part mapped alone, joined without a word of how they lie, beside the whole run.

The trajectories of all parts, carried into the frame of the merged map, are judged by all known relations of the log,
those from one part to another among them; where a log has none, by another system's poses, for a rough look.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.cli.run import DEFAULTS
from contourslam.joining.building import keyframes_of
from contourslam.joining.carrying import carry
from contourslam.joining.chart import Chart
from contourslam.joining.find import find_joint
from contourslam.joining.joint import Joint
from contourslam.joining.merging import Merged, merge_maps
from contourslam.maps import SavedMap
from contourslam.recordings import Message
from contourslam.replay import keep_map, make_mapper, replay
from contourslam.slam.dense import dense_trajectory
from contourslam.slam.mapper import Mapper
from logs import Log, Track, find_logs
from table import Table, publish

Floats = NDArray[np.float64]

PARTS = {"intel": 3, "mit_csail": 3, "aces": 2, "acapulco": 3}
COLUMNS = (
    "log", "parts", "pairs joined", "parts in the map", "keyframes", "error, whole run (m)", "merged (m)", "ratio",
    "raw odometry (m)", "joints found in (s)", "merged in (s)",
)  # fmt: skip


@dataclass(frozen=True)
class Part:
    """A part of a log, mapped from the origin of a frame of its own."""

    track: Track
    saved: SavedMap


def mapped(messages: Sequence[Message]) -> Part:
    """Map as `contourslam run` does: the trajectory has a pose at each odometry reading too."""
    made: list[Mapper] = []

    def make(*args: Any, **options: Any) -> Mapper:
        made.append(make_mapper(*args, **options))
        return made[-1]

    result = replay(messages, DEFAULTS, make=make)
    return Part(dense_trajectory(result), keep_map(made[-1], {}))


def cut(messages: Sequence[Message], parts: int) -> list[list[Message]]:
    """Parts of equal duration; stamps may run backwards, so the order of the file is kept within each."""
    stamps = np.array([message.stamp for message in messages])
    edges = np.linspace(stamps.min(), stamps.max(), parts + 1)[1:-1]
    number = np.searchsorted(edges, stamps, "right")
    return [[messages[i] for i in np.flatnonzero(number == part).tolist()] for part in range(parts)]


def together(merged: Merged, parts: Sequence[Part]) -> Track:
    """Trajectories of all parts in the frame of the merged map, by time."""
    stamps, poses, new = [], [], keyframes_of(merged.saved).poses
    for member, keys in zip(merged.members, merged.keys, strict=True):
        old = keyframes_of(parts[member].saved)
        stamps.append(parts[member].track[0])
        poses.append(carry(*parts[member].track, old.stamps, old.poses, new[keys]))
    return by_time((np.concatenate(stamps), np.concatenate(poses)))


def by_time(track: Track) -> Track:
    order = np.argsort(track[0], kind="stable")
    return track[0][order], track[1][order]


def error(log: Log, track: Track) -> tuple[float, str]:
    """Give one number to compare, and how it is told."""
    relations = log.relation_errors(track)
    if relations is not None:
        summary = relations.translation_summary
        return summary.mean, f"{summary.mean:.4f} ± {summary.sd:.4f}"
    distance = log.distance(track)
    return (np.nan, "-") if distance is None else (distance.rmse, f"{distance.rmse:.3f} from other poses")


def row(log: Log) -> list[object]:
    whole, parts = mapped(log.messages), [mapped(part) for part in cut(log.messages, PARTS[log.name])]
    began = process_time()
    charts = [Chart(part.saved) for part in parts]
    found = {pair: find_joint(charts[pair[0]], charts[pair[1]]) for pair in combinations(range(len(parts)), 2)}
    joints = {pair: joint for pair, joint in found.items() if isinstance(joint, Joint)}
    searched = process_time()
    merged = merge_maps([part.saved for part in parts], joints)[0]
    solved = process_time()
    (all_at_once, told), (joined, said) = error(log, by_time(whole.track)), error(log, together(merged, parts))
    complete = len(merged.members) == len(parts)
    return [
        log.name, len(parts), f"{len(merged.joints)} of {len(found)}", len(merged.members),
        len(keyframes_of(merged.saved)), told, said if complete else "-",
        f"{joined / all_at_once:.2f}" if complete else "-", error(log, log.odometry)[1],
        round(searched - began, 1), round(solved - searched, 1),
    ]  # fmt: skip


def main() -> None:
    rows = []
    for log in find_logs():
        if log.name in PARTS:
            rows.append(row(log))
            print(*rows[-1], flush=True)
    publish(Table("merge", COLUMNS, rows))


if __name__ == "__main__":
    main()
