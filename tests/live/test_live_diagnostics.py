"""Each line says what is the matter and what to do, and nothing is called a fault that is none."""

import math
from dataclasses import replace

import numpy as np
import pytest

from contourslam.config import LiveConfig
from contourslam.live.diagnostics import Condition, Diagnostic, Level, Sensor, diagnose
from contourslam.live.events import Incident, Reason, Source
from contourslam.live.figures import MappedScans, Rate, Summary
from contourslam.live.tally import MOST, RECENT, Tally
from contourslam.slam.result import ScanUpdate

CONFIG = LiveConfig()
NAMES = ["scans", "odometry", "clock", "latency", "map", "consistency", "saving"]
WELL = Condition(
    scans=Sensor("/scan", True, 100, 0.05, 10.0, 10.0),
    odometry=Sensor("/odom", True, 500, 0.01, 50.0, 50.0),
    incidents={},
    totals={},
    mapped=Summary(100, 0.004, 0.012, 0.93, 1.1, 600),
    paused=False,
    localized=True,
    jump="",
    leap="",
    map_version=7,
    saved=12.0,
    autosave="/maps/home.cmap",
    trouble="",
)


def told(condition: Condition, name: str) -> Diagnostic:
    found = diagnose(condition, CONFIG)
    assert [d.name for d in found] == NAMES
    assert all("\n" not in d.message and d.message for d in found)
    return next(d for d in found if d.name == name)


def incident(
    reason: Reason, *, source: Source = "scan", now: float = 5.0, delay: float = 0.07, detail: str = ""
) -> Incident:
    return Incident(source, reason, 100.0, now, delay, detail)


def with_incidents(*incidents: Incident) -> Condition:
    tally = Tally()
    for one in incidents:
        tally.add(one)
    return replace(WELL, incidents=tally.since(0.0), totals=tally.counts)


def test_when_all_is_well_nothing_is_called_a_fault() -> None:
    assert {d.level for d in diagnose(WELL, CONFIG)} == {Level.OK}
    assert told(WELL, "scans").message == "10.0 scans a second"
    assert told(WELL, "latency").message == "4 ms from scan to pose"
    assert told(WELL, "saving").message == "saved by itself: 12 s ago"


@pytest.mark.parametrize(
    ("sensor", "level", "words"),
    [
        (Sensor("/scan", True, 0, 0.3, 0.0, 0.0), Level.OK, "waiting for the first scan on /scan"),
        (Sensor("/scan", True, 0, 3.0, 0.0, 0.0), Level.ERROR, "no scan has come on /scan for 3.0 s: is the lidar's"),
        (Sensor("/scan", True, 9, 5.2, 0.0, 0.0), Level.ERROR, "no scan for 5.2 s on /scan: is the lidar's driver"),
        (Sensor("/scan", True, 9, 1.2, 10.0, 10.0), Level.ERROR, "no scan for 1.2 s on /scan"),
        (Sensor("/scan", True, 9, 1.2, 0.7, 0.7), Level.OK, "0.7 scans a second"),
    ],
)
def test_scans_that_do_not_come(sensor: Sensor, level: Level, words: str) -> None:
    found = told(replace(WELL, scans=sensor), "scans")
    assert found.level is level
    assert words in found.message


@pytest.mark.parametrize(
    ("sensor", "level", "words"),
    [
        (Sensor("/odom", True, 0, 0.3, 0.0, 0.0), Level.OK, "waiting for the first odometry on /odom"),
        (Sensor("/odom", True, 0, 3.0, 0.0, 0.0), Level.WARN, "no odometry has come on /odom for 3.0 s"),
        (Sensor("/odom", True, 9, 5.2, 0.0, 0.0), Level.ERROR, "no odometry for 5.2 s on /odom"),
        (Sensor("/odom", False, 0, 99.0, 0.0, 0.0), Level.OK, "not used"),
    ],
)
def test_odometry_that_does_not_come(sensor: Sensor, level: Level, words: str) -> None:
    found = told(replace(WELL, odometry=sensor), "odometry")
    assert found.level is level
    assert words in found.message
    assert level is Level.OK or "is the base driver running" in found.message


def test_lost_scans_are_counted_and_the_commonest_reason_is_told_with_what_to_do() -> None:
    slow = [incident(Reason.TOO_SLOW, delay=0.1 * k) for k in range(1, 4)]
    condition = with_incidents(incident(Reason.REPEATED, delay=0.0), *slow)
    found = told(condition, "scans")
    assert found.level is Level.WARN
    assert found.message == (
        "4 scans lost on /scan in the last 10 s: the map is not made as fast as scans come, by up to 300 ms: "
        "use fewer beams, throttle the topic, or a faster computer"
    )
    assert found.values[Reason.TOO_SLOW.value] == "3"
    assert found.values["received"] == "100"
    assert told(condition, "odometry").level is Level.OK


@pytest.mark.parametrize(
    "reason", [r for r in Reason if r.loses and r is not Reason.PAUSED and r is not Reason.REPLACED]
)
def test_every_way_to_lose_a_scan_is_told_with_something_to_do(reason: Reason) -> None:
    found = told(with_incidents(incident(reason, detail="what was wrong")), "scans")
    assert found.level is Level.WARN
    assert reason.value in found.message
    assert not found.message.endswith(": ")


def test_paused_scans_are_no_fault_once_resumed() -> None:
    assert told(with_incidents(incident(Reason.PAUSED)), "scans").level is Level.OK
    assert told(replace(WELL, paused=True), "scans").message.startswith("paused")


def test_late_odometry_is_told_by_how_much() -> None:
    found = told(with_incidents(*[incident(Reason.ODOMETRY_LATE)] * 12), "odometry")
    assert found.level is Level.WARN
    assert "12 scans mapped without odometry in the last 10 s: the odometry did not come in time, by up to 70 ms" in (
        found.message
    )


def test_readings_that_are_none_are_told() -> None:
    condition = with_incidents(incident(Reason.REFUSED, source="odometry", detail="pose must be three finite numbers"))
    found = told(condition, "odometry")
    assert found.level is Level.WARN
    assert found.message.endswith("not a valid message: pose must be three finite numbers")
    assert told(condition, "scans").level is Level.OK


def test_clocks_that_differ_and_time_that_ran_back_are_told() -> None:
    found = told(with_incidents(incident(Reason.CLOCKS_DIFFER, delay=3600.0)), "clock")
    assert found.level is Level.ERROR
    assert found.message.startswith("scans and odometry are stamped 3600.0 s apart: set the clocks")
    jumped = told(replace(WELL, jump="time ran back by 5.0 s: ..."), "clock")
    assert (jumped.level, jumped.message) == (Level.WARN, "time ran back by 5.0 s: ...")


def test_odometry_that_leapt_is_told() -> None:
    assert told(replace(WELL, leap="the odometry leapt"), "odometry").level is Level.WARN


@pytest.mark.parametrize(
    ("changed", "name", "level", "words"),
    [
        ({"latency_99": 0.25}, "latency", Level.WARN, "poses come up to 250 ms after their scan"),
        ({"scans": 0, "latency_99": math.nan, "latency_median": math.nan}, "latency", Level.OK, "no scan mapped"),
        ({"quality": 0.2}, "map", Level.WARN, "scans fit the map poorly (0.20 of 1)"),
        ({"quality": 0.2, "scans": 3}, "map", Level.OK, "scans fit the map"),
        ({"quality": math.nan}, "map", Level.OK, "scans fit the map"),
        ({"nis": 9.0}, "consistency", Level.WARN, "measurements miss the map by 3.0 times what they should"),
        ({"nis": 9.0, "nis_dof": 3}, "consistency", Level.OK, "agree"),
        ({"nis": math.nan, "nis_dof": 0}, "consistency", Level.OK, "agree"),
    ],
)
def test_what_the_last_scans_were_like(changed: dict[str, float], name: str, level: Level, words: str) -> None:
    found = told(replace(WELL, mapped=replace(WELL.mapped, **changed)), name)
    assert found.level is level
    assert words in found.message


def test_a_robot_not_found_and_a_map_not_saved_are_errors() -> None:
    assert told(replace(WELL, localized=False), "map").level is Level.ERROR
    found = told(replace(WELL, trouble="/maps/home.cmap: cannot be written (No space left on device)"), "saving")
    assert found.level is Level.ERROR
    assert "No space left" in found.message
    assert "the file from before is kept" in found.message
    assert told(replace(WELL, autosave=""), "saving").message == "the map is saved on request only"
    assert told(replace(WELL, saved=math.nan), "saving").message == "saved by itself: not yet"


def test_rates_are_those_of_the_last_seconds_by_either_clock() -> None:
    rate = Rate(10.0)
    assert rate.by_arrival(0.0) == rate.by_stamps(0.0) == 0.0
    for k in range(1000):
        rate.count(0.05 * k, 0.1 * k)  # a recording played at half speed
    assert rate.by_arrival(99.9) == pytest.approx(10.0)
    assert rate.by_stamps(99.9) == pytest.approx(20.0)
    assert rate.by_arrival(200.0) == 0.0
    for _ in range(10):
        rate.count(5.0, 200.0)
    assert rate.by_stamps(200.0) == rate.by_arrival(200.0) == 0.0
    assert rate.number == 1010


def test_a_summary_forgets_what_is_long_ago() -> None:
    mapped = MappedScans(10.0)
    empty = mapped.summary(0.0)
    assert (empty.scans, empty.nis_dof) == (0, 0)
    assert math.isnan(empty.latency_99) and math.isnan(empty.quality) and math.isnan(empty.nis)
    for k in range(300):
        quality = None if k % 2 else 0.5
        update = ScanUpdate(0.1 * k, np.zeros(3), np.eye(3), 0, 0, (), (), (), (), 4.0 if k < 150 else 3.0, 2, quality)
        mapped.add(update, 0.5 if k < 150 else 0.01, 0.1 * k)
    last = mapped.summary(29.9)
    assert last.scans == 101
    assert (last.latency_median, last.latency_99, last.quality) == pytest.approx((0.01, 0.01, 0.5))
    assert (last.nis, last.nis_dof) == (pytest.approx(1.5), 202)


def test_the_tally_stays_small_and_counts_all() -> None:
    tally = Tally()
    for k in range(3 * MOST):
        tally.add(incident(Reason.TOO_SLOW, now=0.1 * k, delay=float(k)))
    assert tally.counts["scan", Reason.TOO_SLOW].number == tally.number("scan") == 3 * MOST
    assert tally.counts["scan", Reason.TOO_SLOW].worst == 3 * MOST - 1
    assert len(tally.new()) == RECENT
    assert tally.new() == ()
    assert tally.since(0.0)["scan", Reason.TOO_SLOW].number == MOST
    assert tally.since(0.1 * (3 * MOST - 5) - 1e-6)["scan", Reason.TOO_SLOW].number == 5
    assert tally.number("odometry") == 0
