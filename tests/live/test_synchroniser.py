"""A scan comes out once its odometry is there or the wait is over, in order, and none is lost without being counted."""

import math
from collections.abc import Callable, Iterable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from contourslam.config import LiveConfig
from contourslam.live.events import Reason, Released, TimeJump
from contourslam.live.synchroniser import KEPT, Synchroniser
from contourslam.scan import LaserScan, Odometry

ScanAt = Callable[..., LaserScan]
ReadingAt = Callable[..., Odometry]
CONFIG = LiveConfig()


def take_all(sync: Synchroniser, now: float) -> list[Released | TimeJump]:
    out: list[Released | TimeJump] = []
    while (item := sync.take(now)) is not None:
        out.append(item)
    return out


def scans(items: Iterable[Released | TimeJump]) -> list[Released]:
    return [item for item in items if isinstance(item, Released)]


def why(item: Released) -> Reason | None:
    return None if item.without is None else item.without.reason


def fed(sync: Synchroniser, messages: Iterable[LaserScan | Odometry], start: float = 0.0) -> list[Released | TimeJump]:
    """Push messages 10 ms apart on the caller's clock and take what comes."""
    out, now = [], start
    for message in messages:
        now += 0.01
        if isinstance(message, LaserScan):
            sync.push_scan(message, now)
        else:
            sync.push_odometry(message, now)
        out += take_all(sync, now)
    return out


def test_a_scan_waits_for_the_odometry_that_covers_its_last_beam(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    sync.push_odometry(reading_at(10.0), 0.0)
    sync.push_scan(scan_at(10.0, 0.1), 0.01)
    sync.push_odometry(reading_at(10.09), 0.02)
    assert sync.take(0.02) is None
    assert sync.due(0.02) == pytest.approx(0.14)
    sync.push_odometry(reading_at(10.1), 0.03)
    (item,) = scans(take_all(sync, 0.03))
    assert item.without is None
    assert (item.scan.stamp, item.arrived, item.now) == (10.0, 0.01, 0.03)
    assert [r.stamp for r in item.readings] == [10.0, 10.09, 10.1]
    assert sync.due(0.03) is None
    assert sync.tally.counts == {}


def test_odometry_that_came_first_lets_the_scan_through_at_once(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    for stamp in (10.0, 10.2):
        sync.push_odometry(reading_at(stamp), 0.0)
    sync.push_scan(scan_at(10.05), 0.0)
    assert why(scans(take_all(sync, 0.0))[0]) is None


@pytest.mark.parametrize(("lag", "slack"), [(0.03, 0.0), (0.0, 0.03)])
def test_a_lag_or_slack_of_the_odometry_is_allowed_for(
    scan_at: ScanAt, reading_at: ReadingAt, lag: float, slack: float
) -> None:
    sync = Synchroniser(LiveConfig(odometry_slack=slack), odometry_lag=lag)
    sync.push_scan(scan_at(10.0, 0.1), 0.0)
    sync.push_odometry(reading_at(10.06), 0.0)
    assert sync.take(0.0) is None
    sync.push_odometry(reading_at(10.0701), 0.0)
    assert scans(take_all(sync, 0.0))[0].without is None


def test_after_the_wait_the_scan_goes_and_says_by_how_much_the_odometry_is_late(
    scan_at: ScanAt, reading_at: ReadingAt
) -> None:
    sync = Synchroniser(CONFIG)
    sync.push_odometry(reading_at(10.0), 0.0)
    sync.push_scan(scan_at(10.0, 0.1), 0.0)
    sync.push_odometry(reading_at(10.03), 0.1)
    assert take_all(sync, 0.149) == []
    (item,) = scans(take_all(sync, 0.15))
    assert item.without is not None
    assert item.without.reason is Reason.ODOMETRY_LATE
    assert item.without.delay == pytest.approx(0.07)
    assert [r.stamp for r in item.readings] == [10.0, 10.03]
    assert item.without.message == (
        "scan at 10.000 s mapped without odometry: the odometry did not come in time by 70 ms"
    )
    assert sync.tally.number("scan", Reason.ODOMETRY_LATE) == 1
    assert sync.tally.number("scan") == 0  # none is lost


def test_without_any_odometry_only_the_first_scans_wait(scan_at: ScanAt) -> None:
    sync = Synchroniser(CONFIG)
    sync.push_scan(scan_at(1.0), 0.0)
    sync.push_scan(scan_at(1.1), 0.1)
    assert take_all(sync, 0.14) == []
    assert [why(i) for i in scans(take_all(sync, 0.15))] == [Reason.ODOMETRY_MISSING] * 2
    sync.push_scan(scan_at(1.2), 0.2)
    (item,) = scans(take_all(sync, 0.2))
    assert item.without is not None
    assert item.without.delay == pytest.approx(0.2)


def test_once_odometry_has_stopped_scans_wait_no_longer_until_it_returns(
    scan_at: ScanAt, reading_at: ReadingAt
) -> None:
    sync = Synchroniser(CONFIG)
    sync.push_odometry(reading_at(10.2), 0.0)
    sync.push_scan(scan_at(10.0), 0.0)
    assert len(take_all(sync, 0.0)) == 1
    reasons, waits = [], []
    for k in range(1, 31):
        sync.push_scan(scan_at(10.0 + 0.1 * k), 0.1 * k)
        for j in range(10):
            for item in scans(take_all(sync, 0.1 * k + 0.01 * j)):
                reasons.append(why(item))
                waits.append(item.now - item.arrived)
    assert reasons[:1] == [None]
    assert set(reasons[1:8]) == {Reason.ODOMETRY_LATE}
    assert set(reasons[11:]) == {Reason.ODOMETRY_STOPPED}
    assert max(waits[11:]) < 0.005
    count = sync.tally.counts["scan", Reason.ODOMETRY_STOPPED]
    assert count.worst == pytest.approx(3.0, abs=0.01)
    sync.push_scan(scan_at(13.1), 3.1)  # in the meantime no reading
    sync.push_odometry(reading_at(13.3), 3.11)
    sync.push_scan(scan_at(13.2), 3.2)
    assert [why(i) for i in scans(take_all(sync, 3.2))][-1] is None


def test_where_both_fall_silent_the_first_scan_after_waits_as_usual(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    fed(sync, [reading_at(10.2), scan_at(10.0)])
    sync.push_scan(scan_at(20.0), 10.0)  # a recording was paused
    assert take_all(sync, 10.0) == []
    sync.push_odometry(reading_at(20.1), 10.02)
    assert why(scans(take_all(sync, 10.02))[0]) is None


def test_a_mapper_too_slow_loses_the_oldest_scans_and_each_is_counted(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(LiveConfig(max_waiting=3))
    sync.push_odometry(reading_at(100.0), 0.0)
    for k in range(10):
        sync.push_scan(scan_at(99.0 + 0.01 * k), 0.1 * k)
    items = scans(take_all(sync, 1.0))
    assert [round(i.scan.stamp, 2) for i in items] == [99.04, 99.05, 99.06, 99.07, 99.08, 99.09]
    assert sync.tally.number("scan", Reason.TOO_SLOW) == sync.tally.number("scan") == 4
    assert sync.tally.counts["scan", Reason.TOO_SLOW].worst == pytest.approx(0.6)
    assert "dropped: the map is not made as fast as scans come by 600 ms" in sync.tally.new()[-1].message


def test_a_fast_lidar_loses_no_scan_to_late_odometry(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(LiveConfig(max_waiting=3))
    sync.push_odometry(reading_at(1.0), 0.0)
    out = fed(sync, [scan_at(1.0 + 0.01 * k) for k in range(20)])
    assert [why(i) for i in scans(out)] == [Reason.ODOMETRY_LATE] * 17  # the last three still wait
    assert sync.tally.number("scan") == 0


def test_a_scan_of_the_same_or_an_earlier_stamp_is_dropped_with_its_reason(
    scan_at: ScanAt, reading_at: ReadingAt
) -> None:
    sync = Synchroniser(CONFIG)
    out = fed(sync, [reading_at(20.0), scan_at(10.0), scan_at(10.0), scan_at(9.8), scan_at(10.1)])
    assert [i.scan.stamp for i in scans(out)] == [10.0, 10.1]
    assert sync.tally.number("scan", Reason.REPEATED) == 1
    assert sync.tally.counts["scan", Reason.OUT_OF_ORDER].worst == pytest.approx(0.2)


def test_of_readings_of_one_stamp_the_last_counts(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    (item,) = scans(fed(sync, [reading_at(9.9), reading_at(10.1, 1.0), reading_at(10.1, 2.0), scan_at(10.0)]))
    assert [r.pose[0] for r in item.readings] == [0.0, 2.0]
    assert sync.tally.number("odometry", Reason.REPLACED) == 1
    sync.push_odometry(reading_at(10.0), 1.0)
    sync.push_odometry(reading_at(10.1, 3.0), 1.0)  # its predecessor has gone out already
    sync.push_odometry(reading_at(10.2), 1.0)
    assert sync.tally.number("odometry", Reason.OUT_OF_ORDER) == 1
    sync.push_scan(scan_at(10.05), 1.0)
    assert [r.pose[0] for r in scans(take_all(sync, 1.0))[0].readings] == [3.0, 0.0]


def drive(scan_at: ScanAt, reading_at: ReadingAt, start: float, count: int) -> list[LaserScan | Odometry]:
    """Scans of 0.1 s back to back, each after the reading that covers it."""
    messages: list[LaserScan | Odometry] = [reading_at(start)]
    for k in range(count):
        messages += [reading_at(start + 0.1 * (k + 1)), scan_at(start + 0.1 * k, 0.1)]
    return messages


def test_a_recording_that_begins_again_is_one_jump_and_costs_one_scan(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    out = fed(sync, [*drive(scan_at, reading_at, 100.0, 20), *drive(scan_at, reading_at, 50.0, 20)])
    jumps = [i for i in out if isinstance(i, TimeJump)]
    assert [(j.source, j.before, round(j.after, 6)) for j in jumps] == [("odometry", 102.0, 50.1)]
    place = out.index(jumps[0])
    assert all(i.scan.stamp >= 100.0 for i in scans(out[:place]))
    assert all(i.scan.stamp < 60.0 for i in scans(out[place:]))
    assert len(scans(out)) == 40
    assert all(r.stamp < 60.0 for i in scans(out[place:]) for r in i.readings)
    assert sync.tally.number("odometry") == 1


def test_without_odometry_the_scans_show_the_jump(scan_at: ScanAt) -> None:
    sync = Synchroniser(CONFIG)
    times = [100.0 + 0.1 * k for k in range(20)] + [50.0 + 0.1 * k for k in range(20)]
    out = fed(sync, [scan_at(t) for t in times])
    assert sum(isinstance(i, TimeJump) for i in out) == 1
    assert len(scans(out)) == 39
    assert sync.tally.number("scan") == 1


def test_scans_of_the_old_time_that_come_after_the_jump_are_dropped(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    fed(sync, drive(scan_at, reading_at, 100.0, 20))
    sync.push_scan(scan_at(102.0, 0.1), 1.0)  # waits
    for stamp in (50.0, 50.1, 50.2):
        sync.push_odometry(reading_at(stamp), 1.01)
    sync.push_scan(scan_at(102.1, 0.1), 1.02)
    sync.push_scan(scan_at(50.1, 0.1), 1.03)
    out = take_all(sync, 1.03)
    assert isinstance(out[0], TimeJump)
    assert [(i.scan.stamp, why(i)) for i in scans(out)] == [(50.1, None)]
    assert sync.tally.number("scan", Reason.BEFORE_JUMP) == 2


def test_readings_of_the_old_time_do_not_cover_scans_of_the_new(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    fed(sync, drive(scan_at, reading_at, 100.0, 20))
    for stamp in (50.0, 50.1):
        sync.push_scan(scan_at(stamp, 0.1), 1.0)
    sync.push_odometry(reading_at(102.1), 1.01)
    assert scans(take_all(sync, 1.01)) == []
    sync.push_odometry(reading_at(50.3), 1.02)
    assert [(i.scan.stamp, [r.stamp for r in i.readings]) for i in scans(take_all(sync, 1.02))] == [(50.1, [50.3])]


def test_two_senders_on_one_topic_are_no_jump(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    first, second = drive(scan_at, reading_at, 100.0, 20), drive(scan_at, reading_at, 50.0, 20)
    out = fed(sync, [m for pair in zip(first, second, strict=True) for m in pair])
    assert len(out) == len(scans(out)) == 20
    assert sync.tally.number("scan", Reason.OUT_OF_ORDER) == 20


@pytest.mark.parametrize("wild", [1e9, -1e9, 0.0])
def test_a_single_wild_stamp_ends_neither_stream(scan_at: ScanAt, reading_at: ReadingAt, wild: float) -> None:
    for kind in (scan_at, reading_at):
        messages = drive(scan_at, reading_at, 100.0, 20)
        messages.insert(20, kind(wild))
        sync = Synchroniser(CONFIG)
        out = fed(sync, messages)
        last = scans(out)[-1]
        assert last.scan.stamp == pytest.approx(101.9)
        assert last.without is None
        assert len(scans(out)) >= 18
        assert len(scans(out)) + sync.tally.number("scan") == 20 + (kind is scan_at)


@pytest.mark.parametrize("apart", [-3600.0, 3600.0])
def test_clocks_that_differ_are_named(scan_at: ScanAt, reading_at: ReadingAt, apart: float) -> None:
    sync = Synchroniser(CONFIG)
    now, reasons = 0.0, []
    for k in range(50):
        now += 0.1
        sync.push_odometry(reading_at(5000.0 + apart + 0.1 * k), now)
        sync.push_scan(scan_at(5000.0 + 0.1 * k), now)
        reasons += [why(i) for i in scans(take_all(sync, now + 0.09))]
    assert set(reasons) == {Reason.CLOCKS_DIFFER}
    assert len(reasons) >= 48
    assert sync.tally.counts["scan", Reason.CLOCKS_DIFFER].worst == pytest.approx(3600.0, abs=10.0)


def test_an_odometry_clock_set_forward_is_noticed_in_mid_drive(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    fed(sync, drive(scan_at, reading_at, 100.0, 20))
    out = fed(sync, [reading_at(3700.0), scan_at(102.0), reading_at(3700.1), scan_at(102.1)], start=1.0)
    assert [why(i) for i in scans(out)] == [Reason.CLOCKS_DIFFER] * 2


def test_a_gap_in_the_odometry_is_no_clock_set_forward(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    fed(sync, drive(scan_at, reading_at, 100.0, 20))
    sync.push_odometry(reading_at(107.0), 5.4)
    sync.push_scan(scan_at(106.5), 5.4)
    assert why(scans(take_all(sync, 5.4))[0]) is None


def test_scans_that_stop_while_odometry_goes_on_take_no_memory(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    for k in range(3 * KEPT):
        sync.push_odometry(reading_at(0.01 * k), 0.01 * k)
    sync.push_scan(scan_at(0.01 * (3 * KEPT - 20)), 0.03 * KEPT)
    (item,) = scans(take_all(sync, 0.03 * KEPT))
    assert item.without is None
    assert len(item.readings) == KEPT
    assert item.readings[0].stamp < item.scan.stamp


def test_a_clock_of_the_caller_that_runs_back_stands_still(scan_at: ScanAt, reading_at: ReadingAt) -> None:
    sync = Synchroniser(CONFIG)
    sync.push_odometry(reading_at(10.0), 100.0)
    sync.push_scan(scan_at(10.0), 50.0)
    assert sync.due(0.0) == pytest.approx(0.15)
    assert scans(take_all(sync, 100.15))[0].arrived == 100.0


def test_what_is_no_message_is_counted_with_what_is_wrong() -> None:
    sync = Synchroniser(CONFIG)
    sync.drop("scan", Reason.REFUSED, math.nan, 1.0, "a stamp is not finite")
    (incident,) = sync.tally.new()
    assert incident.message == "scan at nan s dropped: not a valid message (a stamp is not finite)"
    assert sync.tally.number("scan") == 1
    assert sync.tally.new() == ()


STAMPS = st.one_of(
    st.integers(0, 80).map(lambda k: 100.0 + 0.05 * k),
    st.integers(0, 80).map(lambda k: 20.0 + 0.05 * k),
    st.sampled_from([-1e300, 1e300, 0.0, 100.0, 100.0, 103.0]),
)
STEPS = st.lists(
    st.tuples(
        st.sampled_from(["scan", "odometry", "odometry", "take", "pause"]),
        STAMPS,
        st.sampled_from([0.0, 0.01, 0.05, 0.2, -0.5, 1.5]),
    ),
    max_size=150,
)


@given(steps=STEPS, max_waiting=st.integers(1, 4), sweep=st.booleans())
def test_whatever_comes_no_scan_is_lost_without_a_count(
    scan_at: ScanAt,
    reading_at: ReadingAt,
    steps: list[tuple[str, float, float]],
    max_waiting: int,
    sweep: bool,
) -> None:
    sync = Synchroniser(LiveConfig(max_waiting=max_waiting))
    now, pushed, out = 0.0, 0, []
    for i, (what, stamp, step) in enumerate(steps):
        now += step
        if sweep:  # mostly in order, so that the common way is tried as well
            stamp = 0.5 * stamp + 0.05 * i
        if what == "scan":
            pushed += 1
            sync.push_scan(scan_at(stamp, 0.1), now)
        elif what == "odometry":
            sync.push_odometry(reading_at(stamp), now)
        elif what == "take":
            out += take_all(sync, now)
        held = pushed - len(scans(out)) - sync.tally.number("scan")
        assert 0 <= held <= 2 * max_waiting
    now = max(now, 0.0) + 1000.0
    out += take_all(sync, now)
    assert sync.due(now) is None
    assert pushed == len(scans(out)) + sync.tally.number("scan")
    assert sum(1 for i in scans(out) if i.without) == sum(
        c.number for (_, reason), c in sync.tally.counts.items() if not reason.loses
    )
    for kind in ("scan", "reading"):
        last = -math.inf
        for item in out:
            if isinstance(item, TimeJump):
                last = -math.inf
                continue
            for stamp in [item.scan.stamp] if kind == "scan" else [r.stamp for r in item.readings]:
                assert stamp > last if kind == "scan" else stamp >= last
                last = stamp
    assert all(i.now >= i.arrived for i in scans(out))
    assert all(np.isfinite(c.worst) for c in sync.tally.counts.values())
