"""Which arrays a map file holds, by version: their names, types and shapes."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contourslam.maps.saved_map import Contoured, Relations, SavedMap, Seen, Stretches
from contourslam.slam.landmark_map import CornerMap, WallMap

Array = NDArray[Any]
Layout = tuple[str, tuple[int | str, ...]]
"""Type and shape of an array; a letter in the shape is a length that all arrays with this letter share."""

VERSION = 2
F8, F4, I8, I4, B1 = "<f8", "<f4", "<i8", "<i4", "|b1"

PARTS: dict[str, tuple[type, dict[str, Layout]]] = {
    "corners": (
        CornerMap,
        {
            "ids": (I8, ("c",)),
            "positions": (F8, ("c", 2)),
            "covariances": (F8, ("c", 2, 2)),
            "directions": (F8, ("c",)),
            "openings": (F8, ("c",)),
            "convex": (B1, ("c",)),
            "observed": (I8, ("c",)),
            "failed": (I8, ("c",)),
        },
    ),
    "walls": (
        WallMap,
        {
            "ids": (I8, ("w",)),
            "end_points": (F8, ("w", 2, 2)),
            "end_point_covariances": (F8, ("w", 2, 2, 2)),
            "normals": (F8, ("w",)),
            "line_covariances": (F8, ("w", 2, 2)),
            "observed": (I8, ("w",)),
            "failed": (I8, ("w",)),
        },
    ),
    "keyframes": (
        Contoured,
        {
            "stamps": (F8, ("k",)),
            "poses": (F8, ("k", 3)),
            "covariances": (F8, ("k", 3, 3)),
            "blurs": (F8, ("k",)),
            "starts": (I8, ("k+1",)),
            "points": (F4, ("n", 4)),
            "drives": (I8, ("k",)),
        },
    ),
    "relations": (
        Relations,
        {
            "first": (I8, ("r",)),
            "second": (I8, ("r",)),
            "poses": (F8, ("r", 3)),
            "information": (F8, ("r", 3, 3)),
            "robust": (F8, ("r",)),
            "ties": (B1, ("r",)),
        },
    ),
    "seen": (
        Seen,
        {"keys": (I4, ("s",)), "ids": (I4, ("s",)), "rows": (F4, ("s", 13)), "failures": (I8, ("f",))},
    ),
    "stretches": (
        Stretches,
        {"anchors": (I8, ("p",)), "starts": (I8, ("p+1",)), "members": (I8, ("m",)), "seen": (F8, ("m", 3))},
    ),
}
"""Parts of a map in today's version, each the class that holds it and its arrays in the order of the file."""

NEEDED = ("corners", "walls")
NOT_IN_VERSION_1 = ("keyframes.drives", "relations.", "seen.", "stretches.")


def layouts(version: int) -> dict[str, Layout]:
    """Arrays that a file of this version may hold, by name, in the order of the file."""
    every = {f"{part}.{name}": layout for part, (_, arrays) in PARTS.items() for name, layout in arrays.items()}
    if version == 1:
        return {name: layout for name, layout in every.items() if not name.startswith(NOT_IN_VERSION_1)}
    return every


def missing(names: set[str], version: int) -> Iterator[str]:
    """Names of the arrays that are not there although they, or others of their part, are needed."""
    parts = {name.split(".")[0] for name in names} | set(NEEDED)
    for name in layouts(version):
        if name.split(".")[0] in parts and name not in names:
            yield name


def misshapen(shapes: Mapping[str, tuple[int, ...]], version: int) -> Iterator[tuple[str, str]]:
    """Names of the arrays whose shapes do not fit their layout, or each other, and what is wrong with each."""
    lengths: dict[str, int] = {}
    for name, (_, wanted) in layouts(version).items():
        shape = shapes.get(name)
        if shape is None:
            continue
        fits = len(shape) == len(wanted)
        for length, want in zip(shape, wanted, strict=False):
            if isinstance(want, int):
                fits &= length == want
            else:
                letter, plus, _ = want.partition("+")
                fits &= length - bool(plus) == lengths.setdefault(letter, length - bool(plus)) >= 0
        if not fits:
            known = tuple(lengths.get(str(want), want) for want in wanted)
            yield name, f"has the shape {shape}, not {known}".replace("'", "")


def to_arrays(saved: SavedMap) -> dict[str, Array]:
    """Arrays of a map by name, as they stand in the file."""
    return {
        f"{part}.{name}": np.asarray(getattr(values, name))
        for part, (_, names) in PARTS.items()
        if (values := getattr(saved, part)) is not None
        for name in names
    }


def to_map(arrays: Mapping[str, Array], about: dict[str, str]) -> SavedMap:
    """Put a map together from the arrays of a file of any version."""
    arrays = dict(arrays)
    if "keyframes.stamps" in arrays:  # all of one drive before there were several
        arrays.setdefault("keyframes.drives", np.zeros(len(arrays["keyframes.stamps"]), np.int64))
    parts = {
        part: kind(**{name: arrays[f"{part}.{name}"] for name in names})
        for part, (kind, names) in PARTS.items()
        if f"{part}.{next(iter(names))}" in arrays
    }
    return SavedMap(**parts, about=about)
