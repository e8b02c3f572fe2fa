import pytest
from mega_bench import Bench

from contourslam.robot.base.messages import BATTERY_LOW


@pytest.mark.parametrize("millivolts", [12600, 8400, 7400, 6000, 300])
def test_the_battery_is_told_within_half_a_percent_and_a_step(shared: Bench, millivolts: int) -> None:
    shared.battery_mv = millivolts
    shared.run(0.6)
    assert shared.state().battery_mv == pytest.approx(millivolts, rel=0.005, abs=15)


def test_a_low_battery_is_flagged_but_not_a_dip(shared: Bench) -> None:
    shared.battery_mv = 7400
    shared.run(1.0)
    assert not shared.state().flags & BATTERY_LOW
    shared.battery_mv = 5500  # motors start
    shared.run(0.5)
    assert not shared.state().flags & BATTERY_LOW
    shared.battery_mv = 7400
    shared.run(1.0)
    assert not shared.state().flags & BATTERY_LOW
    shared.battery_mv = 6400
    shared.run(1.5)
    assert shared.state().flags & BATTERY_LOW
    shared.battery_mv = 7000
    shared.run(0.5)
    assert not shared.state().flags & BATTERY_LOW
