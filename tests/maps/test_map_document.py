"""docs/map_file.md says what a map file holds, and its reader reads one."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from contourslam.maps import SavedMap, save_map
from contourslam.maps.layout import VERSION, layouts

TEXT = (Path(__file__).parents[2] / "docs" / "map_file.md").read_text()


def test_the_document_names_every_section_with_its_type() -> None:
    rows = [line.split("|") for line in TEXT.splitlines() if line.startswith("| `") and "." in line.split("|")[1]]
    said = {name: kinds for _, names, kinds, *_ in rows for name in re.findall(r"`([a-z_.]+)`", names)}
    assert said.keys() == layouts(VERSION).keys()
    for name, (dtype, shape) in layouts(VERSION).items():
        assert dtype[1:] in said[name], name
        kinds = said[name].replace(" + ", "+").replace(" × ", ",").replace(";", "|").replace(" ", "")
        assert re.search(rf"(^|[,|]){','.join(map(str, shape)).replace('+', '[+]')}($|[,|])", kinds), (name, kinds)


def test_the_reader_in_the_document_reads_a_map(
    tmp_path: Path, make_saved: Callable[..., SavedMap], parts: Callable[[SavedMap], dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    saved = make_saved(landmarks=400)
    save_map(tmp_path / "map.cmap", saved)
    (code,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    got: dict[str, Any] = {}
    exec(code.replace('open("map.cmap", "rb").read()', '__import__("pathlib").Path("map.cmap").read_bytes()'), got)
    assert got["arrays"].keys() == parts(saved).keys()
    assert Path("map.cmap").stat().st_size < sum(array.nbytes for array in parts(saved).values()) + 10_000
    for name, array in parts(saved).items():
        np.testing.assert_array_equal(got["arrays"][name], array, err_msg=name)
