import sys
from pathlib import Path

import pytest

from contourslam.errors import MissingExtraError, ResultError
from contourslam.simulation.picture import render_room
from contourslam.simulation.rooms import ROOMS


def test_a_room_is_rendered_with_its_colours(tmp_path: Path) -> None:
    image = pytest.importorskip("matplotlib.image", reason="needs the extra 'report'")
    path = tmp_path / "room.png"
    try:
        render_room(ROOMS["furnished_room"], path, width=320, height=240)
    except ResultError as error:
        pytest.skip(f"no graphics on this machine: {error}")
    pixels = image.imread(path)
    assert pixels.shape[:2] == (240, 320)
    red = (pixels[..., 0] > 0.5) & (pixels[..., 1] < 0.35)  # the armchair and the red box
    assert 20 < red.sum() < 5000
    assert pixels[:3].min() > 0.95  # nothing is cut off at the upper edge


def test_without_mujoco_the_error_names_the_extra(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"contourslam\[simulation\]"):
        render_room(ROOMS["furnished_room"], tmp_path / "room.png")
