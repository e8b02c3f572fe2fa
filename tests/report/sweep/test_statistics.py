import math

import pytest

from contourslam.errors import ResultError
from contourslam.report.sweep.figures import curves
from contourslam.report.sweep.findings import Comparison, in_short, sentence
from contourslam.report.sweep.measures import MEASURES
from contourslam.report.sweep.reading import sweep_of
from contourslam.report.sweep.statistics import pairs, summary, wheels

pytest.importorskip("scipy")
POSITION = MEASURES["position"]


def better(found) -> set[tuple[str, str]]:
    return {(pair.better, pair.place) for pair in found if pair.better is not None}


def test_a_detector_that_is_better_is_shown_to_be_and_by_how_much(sweep_rows) -> None:
    sweep = sweep_of(sweep_rows((0.8, 1.0, 1.0, 1.0)))
    found = pairs(sweep, POSITION, [("", sweep.rooms)], sweep.conditions("corners"))
    assert better(found) == {("matched_filter", "")}
    won = [pair for pair in found if pair.better]
    assert len(won) == 3
    assert all(pair.effect == pytest.approx(-0.2, abs=0.02) and pair.test.seeds == 12 for pair in won)


def test_the_seeds_count_and_neither_cells_nor_rooms(sweep_rows) -> None:
    sweep = sweep_of(sweep_rows(seeds=12))
    for places in (sweep.rooms, sweep.rooms[:1]):
        found = pairs(sweep, POSITION, [("", places)], sweep.conditions("corners"))
        assert {pair.test.seeds for pair in found} == {12}


def test_rooms_whose_seeds_share_their_chance_are_no_further_evidence(sweep_rows) -> None:
    rows = sweep_rows(seeds=20, rooms=("furnished_room",), conditions=[(0.01, 500)])
    copies = [row | {"room": room} for row in rows for room in ("furnished_room", "office_corridor", "large_hall")]
    one, three = (
        pairs(sweep, POSITION, [("", sweep.rooms)], sweep.conditions("corners"))
        for sweep in (sweep_of(rows), sweep_of(copies))
    )
    assert [pair.test.p for pair in three] == pytest.approx([pair.test.p for pair in one])


def test_equal_detectors_are_not_told_apart(sweep_rows) -> None:
    sweep = sweep_of(sweep_rows())
    assert not better(pairs(sweep, POSITION, [(room, [room]) for room in sweep.rooms], sweep.conditions("corners")))


def test_failed_runs_are_counted_and_lose(sweep_rows) -> None:
    lost = [("wu", seed) for seed in range(11)]
    sweep = sweep_of(sweep_rows((1.0, 0.5, 1.0, 1.0), failed=lost))
    cell = summary(sweep, POSITION, "furnished_room", sweep.conditions("corners")[0], "wu")
    assert (cell.runs, cell.failed, cell.interval.count) == (12, 11, 1)
    found = pairs(sweep, POSITION, [("", sweep.rooms)], sweep.conditions("corners"))
    assert ("wu", "") not in better(found) and ("matched_filter", "") in better(found)
    assert {pair.lost for pair in found if "wu" in (pair.first, pair.second)} == {110}


def test_all_pairs_of_a_table_are_corrected_together(sweep_rows) -> None:
    sweep = sweep_of(sweep_rows((0.98, 1.0, 1.0, 1.0)))
    one = pairs(sweep, POSITION, [(sweep.rooms[0], sweep.rooms[:1])], sweep.conditions("corners"))
    both = pairs(sweep, POSITION, [(room, [room]) for room in sweep.rooms], sweep.conditions("corners"))
    assert both[0].test.p == one[0].test.p
    assert both[0].test.corrected > one[0].test.corrected > one[0].test.p


def test_the_middle_of_a_star_is_where_its_arms_cross(sweep_rows) -> None:
    sweep = sweep_of(sweep_rows(seeds=1))
    centre = sweep.centre("corners")
    assert centre is not None and (centre.noise, centre.beams) == (0.01, 500)
    assert sweep.centre("walls") is None


def test_rooms_count_together_by_what_all_of_them_have(sweep_rows) -> None:
    rows = sweep_rows(seeds=1)
    only = [row for row in rows if row["room"] == "furnished_room" or (row["noise"], row["beams"]) == (0.01, 500)]
    sweep = sweep_of(only)
    assert len(sweep.conditions("corners")) == len(sweep.conditions("corners", "furnished_room")) == 5
    assert [(one.noise, one.beams) for one in sweep.common("corners")] == [(0.01, 500)]
    assert curves(sweep, POSITION, "furnished_room", "corners", "noise") is not None
    assert curves(sweep, POSITION, "office_corridor", "corners", "noise") is None


def test_the_wheels_are_those_of_each_drive_once(sweep_rows) -> None:
    sweep = sweep_of(sweep_rows(failed=[("matched_filter", 0)]))
    found = wheels(sweep, POSITION, "furnished_room", sweep.conditions("corners")[0])
    assert found.runs == 12 and found.interval.mean == pytest.approx(0.5)


def test_other_lidars_and_lengths_are_other_places(sweep_rows) -> None:
    rows = sweep_rows(seeds=1, rooms=("large_hall",), conditions=[(0.01, 500)])
    longer = [row | {"duration": None, "lidar": "ydlidar_x4", "noise": None, "beams": None} for row in rows]
    sweep = sweep_of([*rows, *longer])
    assert sweep.rooms == ["large_hall, paper, 60 s", "large_hall, ydlidar_x4, whole duration"]
    assert sweep_of(rows).rooms == ["large_hall"]


def test_of_two_rows_of_a_run_the_later_one_is_taken(sweep_rows) -> None:
    rows = sweep_rows(seeds=1)
    sweep = sweep_of([*rows, rows[0] | {"rmse.x": 1.0, "rmse.y": 0.0}])
    assert len(sweep.runs) == len(rows)
    assert max(POSITION.of(run.row) for run in sweep.runs) == 1.0


def test_runs_of_one_name_and_two_configurations_are_refused(sweep_rows) -> None:
    (row, *_), other = sweep_rows(seeds=1), {"key": "f" * 32, "config": "another", "results": "out/b"}
    with pytest.raises(ResultError, match=r"^out/a and out/b: setting 'corners' with .* two different configurations;"):
        sweep_of([row | {"config": "one", "results": "out/a"}, row | other])


def test_a_measure_that_is_not_there_is_not_known() -> None:
    assert math.isnan(POSITION.of({"rmse.x": 0.1})) and math.isnan(POSITION.of({"rmse.x": 0.1, "rmse.y": None}))
    assert MEASURES["time"].of({"scans_per_second": 500.0}) == 0.002
    assert math.isnan(MEASURES["time"].of({"scans_per_second": 0.0}))
    assert POSITION.of({"rmse.x": 0.03, "rmse.y": 0.04}) == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("factors", "said"),
    [
        ((0.8, 1.0, 1.0, 1.0), "Matched filter is better than Wu, Teh-Chin and CSS (by "),
        ((1.0, 1.0, 1.3, 1.0), "Matched filter, Wu and CSS are better than Teh-Chin (by "),
        ((1.0, 1.0, 1.0, 1.0), "No difference shown (each pair's own 95 % interval, uncorrected: within "),
    ],
)
def test_findings_name_those_that_differ_and_how_far(sweep_rows, factors: tuple[float, ...], said: str) -> None:
    sweep = sweep_of(sweep_rows(factors))
    found = pairs(sweep, POSITION, [("", sweep.rooms)], sweep.conditions("corners"))
    told = sentence(Comparison("corners", "2 rooms and 5 conditions together", found), POSITION)
    assert told.startswith(f"corners, 2 rooms and 5 conditions together, 12 seeds. {said}")
    others = " No other difference is shown."
    assert told.endswith(others) == ("better" in told) and told.removesuffix(others).endswith(" %).")
    assert told.count("better") <= 1


def test_differences_that_failures_made_infinite_are_said_to_be_left_out(sweep_rows) -> None:
    for failed in ([], [("wu", 0)]):
        sweep = sweep_of(sweep_rows(failed=failed))
        found = pairs(sweep, POSITION, [("", sweep.rooms)], sweep.conditions("corners"))
        assert ("without the seeds" in sentence(Comparison("corners", "all", found), POSITION)) == bool(failed)


@pytest.mark.parametrize(
    ("factors", "said"),
    [
        ((0.8, 1.0, 1.0, 1.0), "Better than every other: matched filter (corners: both)."),
        ((1.0, 1.0, 1.3, 1.0), "Worse than every other: Teh-Chin (corners: both)."),
        ((1.0, 1.0, 1.0, 1.0), "No detector is shown to be better than another in 1 comparison "),
    ],
)
def test_the_short_answer_names_the_best_the_worst_and_the_largest_difference(sweep_rows, factors, said: str) -> None:
    sweep = sweep_of(sweep_rows(factors))
    found = pairs(sweep, POSITION, [("", sweep.rooms)], sweep.conditions("corners"))
    told = in_short([Comparison("corners", "both", found)], POSITION)
    assert any(line.startswith(said) for line in told)
    sizes = [line for line in told if line.startswith("The largest difference shown: ")]
    assert len(sizes) == (factors != (1.0, 1.0, 1.0, 1.0))
    assert all("Teh-Chin has 3" in line for line in sizes if factors[2] == 1.3)
