"""A map comes back from its file to the bit, or not at all."""

import dataclasses
import resource
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from contourslam.errors import MapError, ResultError
from contourslam.maps import Contoured, SavedMap, load_map, save_map

Make = Callable[..., SavedMap]
Same = Callable[[SavedMap, SavedMap], None]
Parts = Callable[[SavedMap], dict[str, Any]]
WriteFile = Callable[..., None]


@given(
    seed=st.integers(0, 2**32),
    landmarks=st.integers(0, 12),
    keyframes=st.none() | st.integers(0, 9),
    points=st.integers(0, 3000),
    graph=st.booleans(),
)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_map_comes_back_to_the_bit(
    tmp_path: Path, make_saved: Make, same: Same, seed: int, landmarks: int, keyframes: int, points: int, graph: bool
) -> None:
    saved = make_saved(seed, landmarks=landmarks, keyframes=keyframes, points=points, graph=graph)
    save_map(tmp_path / "a.cmap", saved)
    again = load_map(tmp_path / "a.cmap")
    same(again, saved)
    save_map(tmp_path / "b.cmap", again)
    assert (tmp_path / "a.cmap").read_bytes() == (tmp_path / "b.cmap").read_bytes()


def test_what_is_loaded_may_be_changed_in_place(tmp_path: Path, make_saved: Make, parts: Parts) -> None:
    """Compiled kernels take arrays that may not be changed for others, and would be compiled again."""
    save_map(tmp_path / "a.cmap", make_saved())
    for name, array in parts(load_map(tmp_path / "a.cmap")).items():
        assert array.flags.writeable and array.flags.aligned and array.dtype.isnative, name


def test_what_packs_well_is_packed(tmp_path: Path, make_saved: Make, same: Same) -> None:
    saved = make_saved(keyframes=300, points=300_000)
    assert saved.keyframes is not None
    saved.keyframes.points[:] = 0.25
    save_map(tmp_path / "a.cmap", saved)
    assert (tmp_path / "a.cmap").stat().st_size < 0.1 * saved.keyframes.points.nbytes
    same(load_map(tmp_path / "a.cmap"), saved)


def test_a_file_written_by_the_book_loads(
    tmp_path: Path, make_saved: Make, same: Same, parts: Parts, write_file: WriteFile
) -> None:
    saved = make_saved()
    packed = ("corners.ids", "keyframes.points", "relations.robust")
    write_file(tmp_path / "a.cmap", parts(saved), about=saved.about, packed=packed)
    same(load_map(tmp_path / "a.cmap"), saved)


@pytest.mark.parametrize("keyframes", [None, 6])
def test_a_file_of_version_1_loads(
    tmp_path: Path, make_saved: Make, same: Same, parts: Parts, write_file: WriteFile, keyframes: int | None
) -> None:
    saved = make_saved(keyframes=keyframes, graph=False)
    old = {name: array for name, array in parts(saved).items() if name != "keyframes.drives"}
    write_file(tmp_path / "old.cmap", old, version=1, about=saved.about)
    if saved.keyframes is not None:
        one_drive = dataclasses.replace(saved.keyframes, drives=np.zeros(len(saved.keyframes), np.int64))
        saved = dataclasses.replace(saved, keyframes=one_drive)
    same(load_map(tmp_path / "old.cmap"), saved)


def test_a_file_of_version_1_may_not_hold_what_came_later(
    tmp_path: Path, make_saved: Make, parts: Parts, write_file: WriteFile
) -> None:
    write_file(tmp_path / "old.cmap", parts(make_saved(graph=False)), version=1)
    with pytest.raises(MapError, match=r"no keyframes\.drives of <i8 in version 1"):
        load_map(tmp_path / "old.cmap")


def test_a_newer_file_is_refused_by_name(tmp_path: Path, make_saved: Make, parts: Parts, write_file: WriteFile) -> None:
    def change(header: dict[str, Any]) -> None:
        header["sections"] = "something else"

    path = tmp_path / "new.cmap"
    write_file(path, parts(make_saved()), version=3, change=change)
    with pytest.raises(MapError, match=r"new\.cmap: written by a newer contourslam \(version 3 .* update contourslam"):
        load_map(path)


@pytest.mark.parametrize("content", [b"", b"\x8fCM", b"PK\x03\x04" + bytes(100), b"{}", b"\x8fCMAP\n\x1a" + bytes(100)])
def test_what_is_no_map_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.cmap"
    path.write_bytes(content)
    with pytest.raises(MapError, match=r"x\.cmap: (is no map|damaged)"):
        load_map(path)


def test_what_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"none\.cmap: cannot be read \(No such file"):
        load_map(tmp_path / "none.cmap")
    with pytest.raises(MapError, match=r"cannot be read \(Is a directory"):
        load_map(tmp_path)


def line(header: dict[str, Any], name: str) -> dict[str, Any]:
    return next(line for line in header["sections"] if line["name"] == name)


HUGE = 1 << 50
FALSE_TABLES: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "huge": (lambda h: line(h, "keyframes.points").update(shape=[HUGE, 4], packing="zlib"), "contradict"),
    "huge_and_plain": (lambda h: line(h, "keyframes.points").update(shape=[HUGE, 4], stored=16 * HUGE), "ends there"),
    "negative": (lambda h: line(h, "keyframes.points").update(shape=[-1, 4]), "a number of keyframes.points is none"),
    "overflow": (lambda h: line(h, "corners.ids").update(shape=[1 << 63]), "a number of corners.ids is none"),
    "fraction": (lambda h: line(h, "corners.ids").update(offset=20.5), "a number of corners.ids is none"),
    "true": (lambda h: line(h, "corners.ids").update(checksum=True), "a number of corners.ids is none"),
    "object": (lambda h: line(h, "corners.ids").update(dtype="|O"), r"no corners\.ids of \|O"),
    "big_endian": (lambda h: line(h, "corners.ids").update(dtype=">i8"), "no corners.ids of >i8"),
    "no_text": (lambda h: line(h, "corners.ids").update(name=["corners.ids"]), "a name is no text"),
    "no_packing": (lambda h: line(h, "corners.ids").update(packing="lzma"), "contradict"),
    "too_much_said": (lambda h: line(h, "corners.ids").update(more=1), "cannot be understood"),
    "too_little_said": (lambda h: line(h, "corners.ids").pop("shape"), "cannot be understood"),
    "unknown": (lambda h: line(h, "corners.ids").update(name="corners.__class__"), "no corners.__class__"),
    "twice": (lambda h: h["sections"].append(line(h, "corners.ids")), "corners.ids comes more than once"),
    "one_missing": (lambda h: h["sections"].remove(line(h, "seen.ids")), "seen.ids is missing"),
    "all_missing": (lambda h: h["sections"].clear(), "corners.ids is missing"),
    "another_length": (lambda h: line(h, "walls.normals").update(shape=[99]), "walls.normals has the shape"),
    "another_depth": (lambda h: line(h, "walls.normals").update(shape=[]), "walls.normals has the shape"),
    "moved": (lambda h: line(h, "walls.normals").update(offset=20), "should begin at byte"),
    "not_packed": (lambda h: line(h, "keyframes.points").update(packing="zlib"), "cannot be unpacked"),
    "no_list": (lambda h: h.update(sections=7), "cannot be understood"),
    "no_about": (lambda h: h.pop("about"), "cannot be understood"),
    "about_a_number": (lambda h: h["about"].update(x=1), "cannot be understood"),
}


@pytest.mark.parametrize("name", FALSE_TABLES)
def test_a_sealed_header_that_lies_takes_no_memory(
    tmp_path: Path, make_saved: Make, parts: Parts, write_file: WriteFile, name: str
) -> None:
    change, problem = FALSE_TABLES[name]
    path = tmp_path / "x.cmap"
    write_file(path, parts(make_saved()), change=change)
    with pytest.raises(MapError, match=problem) as refused:
        load_map(path)
    assert str(path) in str(refused.value)
    assert "at byte" in str(refused.value)


def test_an_array_that_unpacks_to_more_than_it_says_is_refused(
    tmp_path: Path, make_saved: Make, parts: Parts, write_file: WriteFile
) -> None:
    """A megabyte of zeros in a kilobyte, given out as a few numbers."""
    arrays = parts(make_saved(graph=False))
    few = arrays["keyframes.points"]
    arrays["keyframes.points"] = np.zeros((1 << 16, 4), np.float32)
    path = tmp_path / "x.cmap"
    write_file(
        path,
        arrays,
        packed=("keyframes.points",),
        change=lambda h: line(h, "keyframes.points").update(shape=list(few.shape)),
    )
    with pytest.raises(MapError, match=rf"keyframes\.points at byte \d+: it does not unpack to {few.nbytes} bytes"):
        load_map(path)


def spoil(saved: SavedMap, name: str, value: Any) -> None:
    part, array = name.split(".")
    getattr(getattr(saved, part), array).reshape(-1)[...] = value


CONTRADICTIONS = {
    "corners.ids": 5,
    "corners.positions": np.nan,
    "corners.covariances": np.inf,
    "walls.ids": -1,
    "walls.line_covariances": -1.0,
    "walls.observed": -1,
    "keyframes.stamps": np.nan,
    "keyframes.starts": 1,
    "keyframes.drives": 2,
    "keyframes.blurs": -1e-9,
    "keyframes.points": np.inf,
    "relations.first": -2,
    "relations.second": 6,
    "relations.poses": np.nan,
    "relations.robust": 0.0,
    "seen.keys": 99,
    "seen.ids": 10,
    "seen.rows": 0.5,
    "seen.failures": -1,
    "stretches.anchors": 6,
    "stretches.starts": 0,
    "stretches.members": -1,
    "stretches.seen": np.inf,
}


@pytest.mark.parametrize("name", CONTRADICTIONS)
def test_a_map_that_contradicts_itself_is_neither_saved_nor_loaded(
    tmp_path: Path, make_saved: Make, parts: Parts, write_file: WriteFile, name: str
) -> None:
    saved = make_saved(1)
    path = tmp_path / "x.cmap"
    write_file(path, parts(saved))
    load_map(path)
    spoil(saved, name, CONTRADICTIONS[name])
    write_file(path, parts(saved))
    with pytest.raises(MapError, match=rf"x\.cmap: damaged in its section {name} at byte \d+: "):
        load_map(path)
    with pytest.raises(MapError, match=rf"y\.cmap: not saved, for the map contradicts itself: {name} "):
        save_map(tmp_path / "y.cmap", saved)
    assert list(tmp_path.iterdir()) == [path]


def test_a_matrix_that_is_not_symmetric_is_refused(tmp_path: Path, make_saved: Make) -> None:
    saved = make_saved(1)
    assert saved.keyframes is not None
    saved.keyframes.covariances[2, 0, 1] += 1e-3
    with pytest.raises(MapError, match=r"keyframes\.covariances a matrix is not symmetric"):
        save_map(tmp_path / "x.cmap", saved)


def test_a_truth_value_is_0_or_1(tmp_path: Path, make_saved: Make, parts: Parts, write_file: WriteFile) -> None:
    arrays = parts(make_saved(1))
    arrays["corners.convex"] = np.full(len(arrays["corners.convex"]), 2, np.uint8).view(np.bool_)
    write_file(tmp_path / "x.cmap", arrays)
    with pytest.raises(MapError, match=r"corners\.convex at byte \d+: a truth value"):
        load_map(tmp_path / "x.cmap")


def test_numbers_that_would_lose_digits_are_not_saved(tmp_path: Path, make_saved: Make) -> None:
    saved = make_saved()
    assert saved.keyframes is not None
    wide = dataclasses.replace(saved.keyframes, points=saved.keyframes.points.astype(np.float64))
    with pytest.raises(MapError, match=r"keyframes\.points holds float64, which does not fit into float32"):
        save_map(tmp_path / "x.cmap", dataclasses.replace(saved, keyframes=wide))


def test_arrays_of_different_lengths_are_not_saved(tmp_path: Path, make_saved: Make) -> None:
    saved = make_saved()
    assert saved.keyframes is not None
    short: Contoured = dataclasses.replace(saved.keyframes, stamps=saved.keyframes.stamps[:-1])
    with pytest.raises(MapError, match=r"keyframes\.poses has the shape \(6, 3\), not \(5, 3\)"):
        save_map(tmp_path / "x.cmap", dataclasses.replace(saved, keyframes=short))


def test_a_novel_about_the_map_is_too_long(tmp_path: Path, make_saved: Make) -> None:
    with pytest.raises(MapError, match="leave some of it out"):
        save_map(tmp_path / "x.cmap", dataclasses.replace(make_saved(), about={"note": "x" * (1 << 20)}))


@pytest.mark.skipif(sys.platform != "linux", reason="limits the size of a file as Linux does")
def test_a_full_disk_leaves_the_old_map(tmp_path: Path, make_saved: Make, same: Same) -> None:
    path = tmp_path / "x.cmap"
    save_map(path, make_saved(1))
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, hard))
    try:
        with pytest.raises(ResultError, match=r"x\.cmap: cannot be written .* free space"):
            save_map(path, make_saved(2, points=10_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    same(load_map(path), make_saved(1))
    assert list(tmp_path.iterdir()) == [path]


def test_two_writers_at_once_do_not_mix(tmp_path: Path, make_saved: Make) -> None:
    path, maps = tmp_path / "x.cmap", [make_saved(seed, points=5000) for seed in range(2)]

    def write(saved: SavedMap) -> None:
        for _ in range(10):
            save_map(path, saved)

    save_map(path, maps[0])
    threads = [threading.Thread(target=write, args=(saved,)) for saved in maps]
    for thread in threads:
        thread.start()
    read = [load_map(path).about["made"]]
    while any(thread.is_alive() for thread in threads):
        read.append(load_map(path).about["made"])
    for thread in threads:
        thread.join()
    assert set(read) <= {"0", "1"}
    assert list(tmp_path.iterdir()) == [path]
