"""The walls of a map made ready to be raised: twins become one, small gaps close, ends meet in their corners."""

import math

import numpy as np
from numpy.typing import NDArray

from contourslam.geometry.angles import wrap
from contourslam.slam.landmark_map import WallMap

Floats = NDArray[np.float64]
Named = list[tuple[str, Floats]]
"""Names with segments of shape (2, 2), m: seen from free space the first end is to the left."""

_TURN = math.radians(6.0)  # two walls that differ by less may be one
_OFFSET = 0.06  # m across; a door's leaf stands back by more
_GAP = 0.2  # m along; a door is wider
_REACH = 0.06  # m across, up to which contour points lie on a wall
_FACES = 0.8  # cosine between the normals of a contour point and of the wall it lies on
_STEP = 0.05  # m; the wall goes on where each such step holds a contour point
_BLANKS = 2  # steps in a row without one that do not end it
_CORNER = 0.12  # m; ends as close as this to where two walls meet are drawn to it
_CROSSING = math.radians(20.0)
_SHORTEST = 0.1  # m
_SQUARE = math.radians(9.0)  # what stands this nearly at a right angle to a wall that it meets does so
_MEETS = 0.3  # m


def clean_walls(walls: WallMap, points: Floats, names: str = "wall-{}") -> Named:
    """Give the walls as segments for a scene.

    Parameters
    ----------
    walls : WallMap
    points : ndarray, shape (n, 4)
        Contour points that were seen, and their normals towards free space: x, y (m), nx, ny. Walls are drawn out as
        far as there are points on them.
    names : str
        Form of the names, with a place for the id.

    Returns
    -------
    list of (str, ndarray of shape (2, 2))
        Joined at their corners by :func:`join_ends` only together with what else stands there.
    """
    order = np.argsort(-np.hypot(*(walls.end_points[:, 1] - walls.end_points[:, 0]).T), kind="stable")
    left = [(int(walls.ids[i]), walls.end_points[i][::-1].copy()) for i in order]
    merged: list[tuple[int, Floats]] = []
    for number, segment in left:
        for k, (other, kept) in enumerate(merged):
            if _are_one(kept, segment):
                merged[k] = (other, _merge(kept, segment))
                break
        else:
            merged.append((number, segment))
    drawn = [(names.format(number), draw_out(segment, points)) for number, segment in sorted(merged, key=_number)]
    return [(name, segment) for name, segment in drawn if math.dist(*segment) >= _SHORTEST]


def _number(entry: tuple[int, Floats]) -> int:
    return entry[0]


def frame(segment: Floats) -> tuple[Floats, Floats, float]:
    """Unit vector along the segment, the one to its left (into the wall), and its length."""
    along = segment[1] - segment[0]
    length = float(np.hypot(*along))
    along = along / length
    return along, np.array([-along[1], along[0]]), length


def _are_one(kept: Floats, other: Floats) -> bool:
    """Whether a segment goes on where a longer one is, on the same side of the same wall."""
    along, across, length = frame(kept)
    direction = other[1] - other[0]
    turn = wrap(np.array(math.atan2(direction[1], direction[0]) - math.atan2(along[1], along[0])))
    if abs(float(turn)) > _TURN or (np.abs((other - kept[0]) @ across) > _OFFSET).any():
        return False
    s = (other - kept[0]) @ along
    return bool(s.min() < length + _GAP and s.max() > -_GAP)


def _merge(kept: Floats, other: Floats) -> Floats:
    """One segment along both, its line their mean by length."""
    along, _, length = frame(kept)
    _, _, short = frame(other)
    weight = np.array([length, length, short, short])
    ends = np.concatenate([kept, other])
    middle = np.average(ends, axis=0, weights=weight)
    values, vectors = np.linalg.eigh(np.einsum("n,ni,nj->ij", weight, ends - middle, ends - middle))
    direction = vectors[:, int(np.argmax(values))]
    direction = direction if direction @ along > 0.0 else -direction
    s = (ends - middle) @ direction
    return np.stack([middle + s.min() * direction, middle + s.max() * direction])


def draw_out(segment: Floats, points: Floats, reach: float = _REACH) -> Floats:
    """Draw a segment out on both sides as far as contour points lie on it, within `reach` across (m)."""
    along, across, length = frame(segment)
    offset, s = (points[:, :2] - segment[0]) @ across, (points[:, :2] - segment[0]) @ along
    on = (np.abs(offset) < reach) & (points[:, 2:] @ across < -_FACES)
    return np.stack(
        [
            segment[0] - _run(-s[on]) * along,
            segment[1] + _run(s[on] - length) * along,
        ]
    )


def _run(beyond: Floats) -> float:
    """How far points go on from 0 without a larger gap, m."""
    steps = np.unique(np.floor(beyond[beyond > 0.0] / _STEP).astype(np.int64))
    last = -1
    for step in steps.tolist():
        if step > last + 1 + _BLANKS:
            break
        last = step
    return float(beyond[(beyond > 0.0) & (beyond < (last + 1) * _STEP)].max()) if last >= 0 else 0.0


def square_up(segments: Named, walls: Named) -> Named:
    """Turn segments about their middles so that they are at right angles to, or in line with, the wall they meet."""
    squared = []
    for name, segment in segments:
        middle, direction = segment.mean(axis=0), segment[1] - segment[0]
        angle = math.atan2(direction[1], direction[0])
        for _, wall in sorted(walls, key=lambda entry: -math.dist(*entry[1])):
            gap = min(math.dist(a, b) for a in segment for b in wall)
            along, _, length = frame(wall)
            turn = float(wrap(np.array(4.0 * (math.atan2(along[1], along[0]) - angle)))) / 4.0
            if gap < _MEETS and abs(turn) < _SQUARE and length > math.dist(*segment):
                half = 0.5 * math.dist(*segment) * np.array([math.cos(angle + turn), math.sin(angle + turn)])
                segment = np.stack([middle - half, middle + half])
                break
        squared.append((name, segment))
    return squared


def join_ends(segments: Named) -> Named:
    """Draw ends that nearly meet to the point where their lines cross; an end is moved once.

    Parameters
    ----------
    segments : list of (str, ndarray of shape (2, 2))

    Returns
    -------
    list of (str, ndarray of shape (2, 2))
        In the same order.
    """
    moved = [segment.copy() for _, segment in segments]
    found = []
    for i in range(len(moved)):
        for j in range(i + 1, len(moved)):
            crossing = _crossing(moved[i], moved[j])
            if crossing is None:
                continue
            gaps = [np.hypot(*(moved[k] - crossing).T) for k in (i, j)]
            ends = [int(np.argmin(gap)) for gap in gaps]
            if max(float(gaps[0].min()), float(gaps[1].min())) < _CORNER:
                found.append((float(gaps[0].min() + gaps[1].min()), i, ends[0], j, ends[1], crossing))
            else:  # an end that meets the other in its middle
                for k, other, gap, end in ((i, j, gaps[0], ends[0]), (j, i, gaps[1], ends[1])):
                    along, _, length = frame(moved[other])
                    s = float((crossing - moved[other][0]) @ along)
                    if float(gap.min()) < 0.5 * _CORNER and 0.0 < s < length:
                        found.append((float(gap.min()), k, end, k, end, crossing))
    done: set[tuple[int, int]] = set()
    for _, i, first, j, second, crossing in sorted(found, key=lambda entry: entry[:5]):
        if (i, first) not in done and (j, second) not in done:
            moved[i][first] = moved[j][second] = crossing
            done |= {(i, first), (j, second)}
    return [(name, segment) for (name, _), segment in zip(segments, moved, strict=True)]


def _crossing(first: Floats, second: Floats) -> Floats | None:
    """Where two lines cross; None where they are all but parallel."""
    a, b = first[1] - first[0], second[1] - second[0]
    across = a[0] * b[1] - a[1] * b[0]
    if abs(across) < math.sin(_CROSSING) * np.hypot(*a) * np.hypot(*b):
        return None
    d = second[0] - first[0]
    return np.asarray(first[0] + a * (d[0] * b[1] - d[1] * b[0]) / across)
