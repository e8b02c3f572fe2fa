"""Several maps put side by side as one, before it is solved: keyframes, what binds them, what they saw."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.contour.contours import Floats, Ints
from contourslam.errors import MapError
from contourslam.geometry.poses import compose
from contourslam.graph.places import ROBUST_TIES
from contourslam.joining.joint import Joint
from contourslam.joining.shared import identify
from contourslam.maps.saved_map import Contoured, Relations, SavedMap, Seen, Stretches
from contourslam.matching.small import turned

Pair = tuple[int, int]
"""Two maps by their numbers; the second is seen from the first."""

NOT_JOINABLE = (
    "the map cannot be joined to others: it holds no keyframes, or not what binds them; map anew with --back-end graph"
)


@dataclass(frozen=True, slots=True)
class Built:
    """Several maps in one frame, not solved yet.

    Attributes
    ----------
    saved : SavedMap
        Its corners and walls are those of the first map alone, its covariances those that each map had in itself.
    keys : tuple of ndarray of int
        Of each map, where its keyframes stand in the new one.
    """

    saved: SavedMap
    keys: tuple[Ints, ...]


@dataclass(frozen=True, slots=True)
class _Part:
    """One of the maps, all that is needed being there.

    Attributes
    ----------
    keyframes, relations, seen, stretches
        Of the map.
    frame : ndarray, shape (3,)
        Of the map in the new one.
    keys : ndarray of int, shape (k,)
        Where its keyframes stand in the new map.
    fresh : ndarray of bool, shape (k,)
        True for those that no map before it holds.
    """

    keyframes: Contoured
    relations: Relations
    seen: Seen
    stretches: Stretches
    frame: Floats
    keys: Ints
    fresh: NDArray[np.bool_]


def build(maps: Sequence[SavedMap], frames: Floats, joints: Mapping[Pair, Joint]) -> Built:
    """Put maps side by side.

    A keyframe that several maps hold, because a drive is in all of them, is taken once.

    Parameters
    ----------
    maps : sequence of SavedMap
        The frame of the first is that of the new map, and its landmarks keep their ids.
    frames : ndarray, shape (n, 3)
        Frame of each map in that of the new one, about: m, m, rad.
    joints : mapping of (int, int) to Joint
        By the numbers of the two maps.

    Returns
    -------
    Built

    Raises
    ------
    MapError
        If a map does not hold what binds its keyframes.
    """
    parts = _parts(maps, frames)
    saved = SavedMap(
        maps[0].corners,
        maps[0].walls,
        _keyframes(parts),
        _relations(parts, joints),
        _seen(parts),
        _stretches(parts),
        _about(maps),
    )
    return Built(saved, tuple(part.keys for part in parts))


def keyframes_of(saved: SavedMap) -> Contoured:
    """Give the keyframes of a map that can be joined to others.

    Raises
    ------
    MapError
        If it does not hold what binds them.
    """
    if saved.keyframes is None or not saved.continuable:
        raise MapError(NOT_JOINABLE)
    return saved.keyframes


def _parts(maps: Sequence[SavedMap], frames: Floats) -> list[_Part]:
    known = identify([keyframes_of(saved) for saved in maps])
    parts: list[_Part] = []
    count = 0
    for saved, frame, keys in zip(maps, frames, known, strict=True):
        keyframes, relations, seen, stretches = saved.keyframes, saved.relations, saved.seen, saved.stretches
        if keyframes is None or relations is None or seen is None or stretches is None:
            raise MapError(NOT_JOINABLE)
        fresh = keys >= count
        parts.append(_Part(keyframes, relations, seen, stretches, frame, keys, fresh))
        count += int(fresh.sum())
    return parts


def _stack(pieces: Sequence[NDArray[Any]]) -> Any:
    return np.concatenate(pieces)


def _keyframes(parts: Sequence[_Part]) -> Contoured:
    lengths = [np.diff(part.keyframes.starts) for part in parts]
    drives: list[Ints] = []
    for part in parts:
        _, numbers = np.unique(part.keyframes.drives[part.fresh], return_inverse=True)
        drives.append(numbers + (1 + max((int(earlier.max(initial=-1)) for earlier in drives), default=-1)))
    return Contoured(
        _stack([part.keyframes.stamps[part.fresh] for part in parts]),
        _stack([compose(part.frame, part.keyframes.poses[part.fresh]) for part in parts]),
        _stack([_turned(part.keyframes.covariances[part.fresh], part.frame[2]) for part in parts]),
        _stack([part.keyframes.blurs[part.fresh] for part in parts]),
        np.cumsum([0, *_stack([n[part.fresh] for n, part in zip(lengths, parts, strict=True)])]),
        _stack([part.keyframes.points[np.repeat(part.fresh, n)] for n, part in zip(lengths, parts, strict=True)]),
        _stack(drives),
    )


def _turned(covariances: Floats, angle: float) -> Floats:
    return np.array([turned(covariance, angle) for covariance in covariances]).reshape(-1, 3, 3)


def _relations(parts: Sequence[_Part], joints: Mapping[Pair, Joint]) -> Relations:
    """Relations of all maps, those of a drive that is in several of them once."""
    rows: dict[tuple[int, int, bytes, bool], tuple[Floats, Floats, float]] = {}
    for number, part in enumerate(parts):
        old, keys = part.relations, part.keys
        for i, (first, second) in enumerate(zip(old.first.tolist(), old.second.tolist(), strict=True)):
            if first < 0 and number:
                continue  # one map holds the frame
            name = int(keys[first]) if first >= 0 else -1, int(keys[second]), old.poses[i].tobytes(), bool(old.ties[i])
            rows.setdefault(name, (old.poses[i], old.information[i], float(old.robust[i])))
    for one, other, pose, information, tie in _ties(parts, joints):
        rows.setdefault((one, other, pose.tobytes(), tie), (pose, information, ROBUST_TIES))
    return Relations(
        np.array([first for first, _, _, _ in rows], np.int64),
        np.array([second for _, second, _, _ in rows], np.int64),
        np.array([pose for pose, _, _ in rows.values()]).reshape(-1, 3),
        np.array([information for _, information, _ in rows.values()]).reshape(-1, 3, 3),
        np.array([robust for _, _, robust in rows.values()], np.float64),
        np.array([tie for _, _, _, tie in rows], np.bool_),
    )


def _ties(parts: Sequence[_Part], joints: Mapping[Pair, Joint]) -> Iterator[tuple[int, int, Floats, Floats, bool]]:
    """Keyframes, pose and information of all ties of the joints, and of the surest of each once more, to stay."""
    for (first, second), joint in joints.items():
        one, other = parts[first].keys, parts[second].keys
        ties = tuple(tie for tie in joint.ties if one[tie.first] != other[tie.second])
        for tie, information, replaceable in replace(joint, ties=ties).bonds():
            yield int(one[tie.first]), int(other[tie.second]), tie.pose, information, replaceable


def _seen(parts: Sequence[_Part]) -> Seen:
    """Sightings of all maps; landmarks get new ids in all but the first, save those that a shared drive names."""
    keys, ids, rows = (np.empty(0, np.int32), np.empty(0, np.int32), np.empty((0, parts[0].seen.rows.shape[1]), "f4"))
    failures = np.empty(0, np.int64)
    for part in parts:
        seen, fresh = part.seen, part.fresh[part.seen.keys]
        at = part.keys[seen.keys].astype(np.int32)
        into = np.full(len(seen.failures), -1, np.int64)
        old = np.flatnonzero(~fresh & (seen.ids >= 0))
        same = np.searchsorted(keys, at[old]) + old - np.searchsorted(seen.keys, seen.keys[old])
        known = (same < len(keys)) & (keys[np.minimum(same, len(keys) - 1)] == at[old]) if len(keys) else same < 0
        old, same = old[known], same[known]
        known = ids[same] >= 0
        into[seen.ids[old[known]]] = ids[same[known]]
        new = into < 0
        np.maximum.at(failures, into[~new], seen.failures[~new])  # both counted the misses of the shared drive
        into[new] = len(failures) + np.arange(new.sum())
        failures = np.concatenate([failures, seen.failures[new]])
        keys, rows = np.concatenate([keys, at[fresh]]), np.concatenate([rows, seen.rows[fresh]])
        named = np.append(into, -1).astype(np.int32)[seen.ids]
        ids = np.concatenate([ids, named[fresh]])
    return Seen(keys, ids, rows, failures)


def _stretches(parts: Sequence[_Part]) -> Stretches:
    """Stretches of all maps by their anchors, those of a drive that is in several maps once."""
    pieces: dict[int, tuple[Ints, Floats]] = {}
    for part in parts:
        old = part.stretches
        for i, anchor in enumerate(old.anchors.tolist()):
            entries = slice(old.starts[i], old.starts[i + 1])
            pieces.setdefault(int(part.keys[anchor]), (part.keys[old.members[entries]], old.seen[entries]))
    anchors = sorted(pieces)
    return Stretches(
        np.array(anchors, np.int64),
        np.cumsum([0, *(len(pieces[anchor][0]) for anchor in anchors)]),
        np.concatenate([np.empty(0, np.int64), *(pieces[anchor][0] for anchor in anchors)]),
        np.concatenate([np.empty((0, 3)), *(pieces[anchor][1] for anchor in anchors)]),
    )


def _about(maps: Sequence[SavedMap]) -> dict[str, str]:
    """What is true of all maps, and the recordings of each."""
    about = {name: text for name, text in maps[0].about.items() if all(m.about.get(name) == text for m in maps)}
    recordings = [line for saved in maps for line in saved.about.get("recordings", "").splitlines()]
    return about | ({"recordings": "\n".join(dict.fromkeys(recordings))} if recordings else {})
