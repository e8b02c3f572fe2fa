import pytest

from contourslam.evaluation.timing import timing


def test_shares_add_up_and_the_slowest_stage_comes_first(make_run):
    found = timing(make_run(steps=100))
    assert list(found.seconds) == ["detection", "contour"]
    assert found.shares == pytest.approx({"detection": 0.75, "contour": 0.25})
    assert found.scans_per_second == pytest.approx(250.0)


def test_a_run_without_times_has_no_rate(make_run):
    found = timing(make_run(seconds={}))
    assert (found.shares, found.total, found.scans_per_second) == ({}, 0, None)
