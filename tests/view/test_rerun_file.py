"""The Rerun file read back by Rerun itself, and held against what the run gave."""

import math
import subprocess
import sys
import time
import warnings
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from contourslam.config import Config, SlamConfig
from contourslam.errors import ConfigError, ResultError
from contourslam.replay import make_mapper, replay
from contourslam.slam.result import Loop

pytest.importorskip("rerun.chunk")

from contourslam.view.lane import Lane
from contourslam.view.rerun_file import RerunFile
from contourslam.view.rerun_log import RerunLog
from contourslam.view.rerun_rows import ellipses, nis_bounds
from contourslam.view.rerun_watch import Logged, LoggedRun, open_log

BACK_ENDS = ["ekf", pytest.param("graph", marks=pytest.mark.skipif(find_spec("gtsam") is None, reason="no GTSAM"))]
LANE = "matched_filter"


def chunks(path: Path) -> list:
    from rerun.chunk import RrdReader

    return list(RrdReader(str(path)).stream())


def rows(path: Path, entity: str, component: str) -> dict[int, np.ndarray]:
    """What a component of an entity is, by number of the scan; -1 where it is that at all times."""
    found = {}
    for chunk in chunks(path):
        batch = chunk.to_record_batch()
        names = [name for name in batch.schema.names if name.endswith(component)]
        if chunk.entity_path != f"/{entity}" or not names:
            continue
        values = batch.column(names[0]).to_pylist()
        scans = [-1] * len(values) if chunk.is_static else batch.column("scan").to_pylist()
        found |= {scan: np.array(value) for scan, value in zip(scans, values, strict=True) if value is not None}
    return dict(sorted(found.items()))


def run(messages, config: Config, path: Path):
    log = open_log(path, "circle", config, [config.detector])
    logging = LoggedRun(log)
    result = replay(messages, config, make=logging.making(make_mapper), on_scan=logging.on_scan)
    return result, logging.finish(result)


@pytest.fixture(scope="module", params=BACK_ENDS)
def logged(request, drive, tmp_path_factory):
    """A run that was logged, the file, and the same run without."""
    config = Config(back_end=request.param, slam=SlamConfig(walls=True, contour_matching=True))
    path = tmp_path_factory.mktemp("rerun") / "circle.rrd"
    result, trouble = run(drive(40), config, path)
    assert trouble == ""
    return path, result, replay(drive(40), config)


def test_a_logged_run_is_that_of_one_that_is_not(logged) -> None:
    _, result, plain = logged
    for name in ("poses", "covariances", "nis", "odometry"):
        np.testing.assert_array_equal(getattr(result, name), getattr(plain, name))
    np.testing.assert_array_equal(result.corner_map.positions, plain.corner_map.positions)
    assert set(result.seconds) == set(plain.seconds)


def test_every_pose_is_in_the_file_to_the_bit_at_its_scan(logged) -> None:
    path, result, _ = logged
    poses = result.poses if result.online_poses is None else result.online_poses
    for column, quantity in enumerate(("x", "y", "heading")):
        found = rows(path, f"plots/pose/{quantity}/{LANE}", "Scalars:scalars")
        assert list(found) == list(range(40))
        np.testing.assert_array_equal(np.concatenate(list(found.values())), poses[:, column])
    places = rows(path, f"world/{LANE}/robot", "Transform3D:translation")
    np.testing.assert_allclose(np.concatenate(list(places.values()))[:, :2], poses[:, :2], atol=1e-6)


def test_the_last_map_is_that_of_the_result(logged) -> None:
    path, result, _ = logged
    corners = list(rows(path, f"world/{LANE}/map/corners", "Points3D:positions").values())[-1]
    np.testing.assert_allclose(corners[:, :2], result.corner_map.positions, atol=1e-5)
    walls = list(rows(path, f"world/{LANE}/map/walls", "LineStrips3D:strips").values())[-1]
    np.testing.assert_allclose(walls[:, :, :2], result.wall_map.end_points, atol=1e-5)
    assert len(corners) >= 4
    for name, values in (("id", "ids"), ("o", "observed"), ("f", "failed")):
        told = list(rows(path, f"world/{LANE}/map/corners/seen", name).values())[-1]
        assert told.tolist() == getattr(result.corner_map, values).tolist()
    (final,) = rows(path, f"world/{LANE}/final/walls", "LineStrips3D:strips").values()
    np.testing.assert_array_equal(final, walls)


def test_the_refined_way_is_there_beside_the_one_known_at_the_time(logged) -> None:
    path, result, _ = logged
    found = rows(path, f"world/{LANE}/final/trajectory", "LineStrips3D:strips")
    if result.online_poses is None:
        assert not found
    else:
        np.testing.assert_allclose(found[-1][0][:, :2], result.poses[:, :2], atol=1e-5)


def test_errors_and_nis_are_those_of_the_run(logged) -> None:
    path, result, _ = logged
    poses = result.poses if result.online_poses is None else result.online_poses
    errors = rows(path, f"plots/error/{LANE}", "Scalars:scalars")
    np.testing.assert_allclose(
        np.concatenate(list(errors.values())), np.hypot(*(poses - result.truth)[:, :2].T), atol=1e-12
    )
    corrected = result.nis_dof > 0
    found = rows(path, f"plots/nis/{LANE}", "Scalars:scalars")
    assert list(found) == np.flatnonzero(corrected).tolist()
    np.testing.assert_allclose(np.concatenate(list(found.values())), result.nis[corrected] / result.nis_dof[corrected])


def test_scans_responses_and_times_are_there(logged) -> None:
    path, result, _ = logged
    scans = rows(path, f"world/{LANE}/robot/lidar/scan", "Points3D:positions")
    assert list(scans) == list(range(40))
    assert len(scans[0]) > 200
    responses = rows(path, f"world/{LANE}/look/response", "Points3D:positions")
    assert max(float(points[:, 2].max()) for points in responses.values()) > 1.0  # some reach the threshold
    times = rows(path, f"plots/stages/{LANE}", "Scalars:scalars")
    assert all((values >= 0.0).all() for values in times.values())
    stamps = np.concatenate([
        chunk.to_record_batch().column("stamp").cast("int64").to_numpy()
        for chunk in chunks(path) if chunk.entity_path == f"/plots/sigma/{LANE}" and not chunk.is_static
    ])  # fmt: skip
    np.testing.assert_allclose(np.sort(stamps) * 1e-9, result.stamps, atol=1e-9)


def test_the_file_carries_its_layout(logged) -> None:
    from rerun.chunk import RrdReader

    assert len(RrdReader(str(logged[0])).blueprints()) >= 1


def test_loops_and_what_was_skipped_are_told_at_their_scans(drive, tmp_path) -> None:
    path = tmp_path / "loops.rrd"
    log = open_log(path, "circle", Config(), [LANE])
    logging = LoggedRun(log)
    loop = Loop(100.2, 101.0, np.zeros(3), np.eye(3), np.array([0.3, 0.4, 0.0]), "search", 34, 0.02, 0.9, 0.1)

    def on_scan(scan, update) -> None:
        if len(logging._lane.loops) == 0 and scan.stamp > 101.1:
            logging._lane.loops.append(loop)
        logging.on_scan(scan, update)

    messages = list(drive(8))[1:]  # the first odometry is missing
    result = replay(messages, Config(), make=logging.making(make_mapper), on_scan=on_scan)
    assert logging.finish(result) == ""
    told = rows(path, f"log/{LANE}", "TextLog:text")
    assert list(told) == [6]
    assert "0.50 m and 0.0° off, by search, 34 pairs" in str(told[6])
    assert "before any odometry" in str(rows(path, "log/recording", "TextLog:text")[7])


def test_the_viewer_finds_nothing_wrong_with_the_file(logged) -> None:
    path, _, _ = logged
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "verify", str(path)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_a_page_and_a_file_show_the_same_lanes(replayed, tmp_path) -> None:
    names = ("matched_filter", "wu")
    path = tmp_path / "both.rrd"
    log = open_log(path, "circle", Config(), names)
    logged = Logged(log)
    one = replayed(20, names)
    one.player.on_moment = logged.take
    one.player.run()
    assert one.player.error is None
    assert logged.finish({}) == ""
    for name, lane in zip(names, one.player.lanes, strict=True):
        found = rows(path, f"plots/pose/x/{name}", "Scalars:scalars")
        assert list(found) == list(range(20))
        corners = list(rows(path, f"world/{name}/map/corners", "Points3D:positions").values())[-1]
        np.testing.assert_allclose(corners[:, :2], lane.mapper.corner_map().positions, atol=1e-5)
    assert len(rows(path, "plots/error/wu", "Scalars:scalars")) == 20


def test_a_file_that_is_never_ended_holds_what_was_written(drive, tmp_path) -> None:
    """As after `kill -9`."""
    path = tmp_path / "cut.rrd"
    log = open_log(path, "circle", Config(), [LANE])
    logging = LoggedRun(log)
    log.file.scan_done = lambda index: log.file.write()  # as if a batch were one scan
    replay(drive(5), Config(), make=logging.making(make_mapper), on_scan=logging.on_scan)
    copy = tmp_path / "copy.rrd"
    copy.write_bytes(path.read_bytes())
    warnings.simplefilter("ignore")  # that it has no end
    assert list(rows(copy, f"plots/sigma/{LANE}", "Scalars:scalars")) == list(range(5))
    log.file.close()


def test_a_disk_that_is_full_ends_the_file_and_not_the_run(drive, tmp_path, monkeypatch) -> None:
    path = tmp_path / "full.rrd"
    log = open_log(path, "circle", Config(), [LANE])
    logging = LoggedRun(log)
    log.file.scan_done = lambda index: log.file.write()

    class Full:
        def __getattr__(self, name):
            return getattr(stream, name)

        def flush(self, timeout_sec):
            raise RuntimeError("File-writer thread shut down prematurely")

    stream, log.file.stream = log.file.stream, Full()
    result = replay(drive(5), Config(), make=logging.making(make_mapper), on_scan=logging.on_scan)
    assert len(result.stamps) == 5
    assert "could not be written on" in logging.finish(result)


@pytest.mark.parametrize("what", ["send_columns", "send_blueprint", "log", "disconnect"])
def test_whatever_fails_in_the_sdk_ends_the_file_and_not_the_run(drive, tmp_path, what: str) -> None:
    log = open_log(tmp_path / "x.rrd", "circle", Config(), [LANE])
    logging = LoggedRun(log)
    log.file.scan_done = lambda index: log.file.write()

    class Broken:
        def __getattr__(self, name):
            return refuse if name == what else getattr(stream, name)

    def refuse(*values, **named):
        raise ValueError("nobody foresaw this")

    stream, log.file.stream = log.file.stream, Broken()
    result = replay(drive(5), Config(), make=logging.making(make_mapper), on_scan=logging.on_scan)
    assert len(result.stamps) == 5
    assert "nobody foresaw this" in logging.finish(result)
    stream.disconnect()


def test_a_page_goes_on_where_its_file_cannot(replayed, tmp_path, monkeypatch) -> None:
    logged = Logged(open_log(tmp_path / "x.rrd", "circle", Config(), [LANE]))
    one = replayed(5)
    one.player.on_moment = logged.take
    monkeypatch.setattr(RerunLog, "add", lambda self, moment, lanes: {}["unforeseen"])
    one.player.run()
    assert (one.player.error, one.player.state) == (None, "finished")
    assert "unforeseen" in logged.finish({})


def test_the_times_of_the_stages_are_those_of_the_run(drive, tmp_path, monkeypatch) -> None:
    """What is done between two scans, here reading as slowly as anything, is in none."""
    summed: dict[str, float] = {}
    take = Lane.take

    def counting(self, update, seconds, elapsed, **more):
        for stage, spent in seconds.items():
            summed[stage] = summed.get(stage, 0.0) + spent
        return take(self, update, seconds, elapsed, **more)

    def slowly():
        for message in drive(12):
            until = time.thread_time() + 0.01
            while time.thread_time() < until:
                pass
            yield message

    monkeypatch.setattr(Lane, "take", counting)
    result, _ = run(slowly(), Config(back_end="ekf"), tmp_path / "x.rrd")
    assert summed == pytest.approx({stage: result.seconds[stage] for stage in summed}, abs=1e-9)
    assert set(result.seconds) - set(summed) == {"map", "map refinement"}


def test_what_cannot_be_written_is_said_at_once(tmp_path) -> None:
    there = tmp_path / "there.rrd"
    there.write_bytes(b"mine")
    with pytest.raises(ResultError, match="there already"):
        RerunFile(there, "x")
    assert there.read_bytes() == b"mine"
    with pytest.raises(ConfigError, match=r"\.rrd"):
        RerunFile(tmp_path / "x.txt", "x")
    with pytest.raises(ResultError, match="cannot be written"):
        RerunFile(there / "below" / "x.rrd", "x")
    folder = tmp_path / "folder.rrd"
    folder.mkdir()
    with pytest.raises(ResultError, match="cannot be written"):
        RerunFile(folder, "x", overwrite=True)


def test_rerun_switched_off_is_said_at_once_and_takes_nothing_away(tmp_path) -> None:
    there = tmp_path / "x.rrd"
    there.write_bytes(b"mine")
    code = (
        "import sys; from pathlib import Path; from contourslam.view.rerun_file import RerunFile\n"
        "RerunFile(Path(sys.argv[1]), 'x', overwrite=True)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(there)], capture_output=True, text=True, env={"RERUN": "off"},
        check=False,
    )  # fmt: skip
    assert "switched off by RERUN='off'" in done.stderr
    assert there.read_bytes() == b"mine"


def test_maps_stay_a_small_part_of_the_file(drive, tmp_path, monkeypatch) -> None:
    """Here maps are tiny; what they may take is made tiny too."""
    monkeypatch.setattr("contourslam.view.rerun_log.SHARE", 0.02)
    drawn = []
    draw = RerunLog._map
    monkeypatch.setattr(RerunLog, "_map", lambda self, *a, **k: (drawn.append(self._index), draw(self, *a, **k))[1])
    run(drive(60), Config(back_end="ekf"), tmp_path / "x.rrd")
    assert drawn[0] == 0
    assert drawn[-1] == 59
    assert 3 < len(drawn) < 40


@pytest.mark.parametrize("dof", [1, 2, 3, 8, 24, 60])
def test_the_bounds_of_the_nis_are_those_of_chi_square(dof) -> None:
    chi2 = pytest.importorskip("scipy.stats").chi2
    low, high = nis_bounds(dof)
    assert low == pytest.approx(chi2.ppf(0.025, dof) / dof, abs=0.02)
    assert high == pytest.approx(chi2.ppf(0.975, dof) / dof, rel=0.02)


def test_an_ellipse_has_the_axes_of_its_covariance() -> None:
    turn = 0.4
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    covariance = rotation @ np.diag([0.04, 0.01]) @ rotation.T
    made = ellipses(np.array([[1.0, 2.0]]), covariance[None])
    np.testing.assert_allclose(made["half_sizes"][0], [0.6, 0.3, 0.0], atol=1e-9)
    np.testing.assert_allclose(made["quaternions"][0], [0.0, 0.0, math.sin(turn / 2), math.cos(turn / 2)], atol=1e-9)
