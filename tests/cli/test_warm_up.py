import json
from pathlib import Path

import pytest

from contourslam.cli import main, warm_up
from contourslam.live import rehearsal


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """One stage in place of all; tests/live/test_rehearsal.py and tests/fleet/test_rehearsal.py have all of them."""
    whole = rehearsal.stages
    monkeypatch.setattr(rehearsal, "stages", lambda folder: [whole(folder)[-1]])
    monkeypatch.setattr(warm_up, "_fleet", list)


@pytest.mark.usefixtures("short")
def test_what_was_warmed_up_is_warm(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["warm-up"]) == 0
    capsys.readouterr()
    assert main(["warm-up", "--check"]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("all is warm: nothing was left to compile")
    assert said.err == ""
    assert main(["warm-up", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["compiled"] == 0
    assert found["seconds"] > 0
    assert next(Path(found["cache"]).rglob("angles.wrap_angle-*.nbi"), None) is not None


def test_a_machine_without_gtsam_is_warmed_up_for_the_filter_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with_graph = [name for name, _ in rehearsal.stages(tmp_path)]
    monkeypatch.setattr(rehearsal, "find_spec", lambda name: None)
    monkeypatch.setattr(warm_up, "find_spec", lambda name: None)
    without = [name for name, _ in rehearsal.stages(tmp_path)]
    assert without == [name for name in with_graph if "graph" not in name]
    assert "localising" in without
    assert warm_up._fleet() == []


def test_a_fleet_is_warmed_up_where_there_is_the_graph() -> None:
    pytest.importorskip("gtsam", reason="needs the extra 'graph'")
    assert [name for name, _ in warm_up._fleet()] == ["a fleet's robots and server"]
