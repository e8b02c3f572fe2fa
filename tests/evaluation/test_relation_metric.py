import lzma
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contourslam.evaluation.relations import judge, relation_errors
from contourslam.geometry.poses import between, compose, interpolate
from contourslam.slam.result import OdometryReadings

SHARED = Path(__file__).resolve().parents[3] / "shared"


def _drive(seed: int = 0, steps: int = 200) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    poses = [np.zeros(3)]
    for step in rng.normal([0.05, 0.0, 0.02], [0.01, 0.01, 0.1], (steps - 1, 3)):
        poses.append(compose(poses[-1], step))
    return np.cumsum(rng.uniform(0.1, 0.3, steps)), np.array(poses)


def _true_relations(stamps: np.ndarray, poses: np.ndarray, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    pairs = np.random.default_rng(seed).integers(0, len(stamps), (60, 2))
    return stamps[pairs], between(poses[pairs[:, 0]], poses[pairs[:, 1]])


@given(x=st.floats(-50, 50), y=st.floats(-50, 50), theta=st.floats(-10, 10))
@settings(max_examples=30, deadline=None)
def test_the_metric_needs_no_common_frame(x, y, theta):
    stamps, poses = _drive()
    moved = compose(np.array([x, y, theta]), poses)
    errors = relation_errors(stamps, moved, *_true_relations(stamps, poses))
    np.testing.assert_allclose(errors.translation, 0.0, atol=1e-9)
    np.testing.assert_allclose(errors.rotation, 0.0, atol=1e-9)


def test_a_known_difference_is_the_error():
    stamps, poses = _drive()
    pairs, relations = _true_relations(stamps, poses)
    errors = relation_errors(stamps, poses, pairs, compose(relations, np.array([0.3, 0.4, -0.1])))
    np.testing.assert_allclose(errors.translation, 0.5)
    np.testing.assert_allclose(errors.rotation, 0.1)
    summary = errors.translation_summary
    assert (summary.mean, summary.sd, summary.median, summary.max) == pytest.approx((0.5, 0.0, 0.5, 0.5))
    assert errors.outside == 0


def test_a_far_stamp_is_reached_along_the_odometry():
    stamps, poses = _drive()
    odometry = compose(np.array([5.0, 1.0, 2.0]), poses)
    pairs, relations = _true_relations(stamps, poses)
    sparse = slice(None, None, 20)
    carried = relation_errors(stamps[sparse], poses[sparse], pairs, relations, stamps, odometry)
    guessed = relation_errors(stamps[sparse], poses[sparse], pairs, relations)
    np.testing.assert_allclose(carried.translation[carried.translation < 0.02], 0.0, atol=0.02)
    assert carried.translation.mean() < 0.3 * guessed.translation.mean()


def test_without_odometry_a_far_stamp_is_interpolated():
    stamps, poses = np.array([0.0, 1.0]), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    errors = relation_errors(stamps, poses, np.array([[0.0, 0.5]]), np.array([[0.5, 0.0, 0.0]]))
    assert errors.translation[0] == pytest.approx(0.0, abs=1e-12)


def test_stamps_that_run_backwards_are_sorted():
    stamps, poses = _drive()
    pairs, relations = _true_relations(stamps, poses)
    order = np.random.default_rng(5).permutation(len(stamps))
    errors = relation_errors(stamps[order], poses[order], pairs, relations)
    np.testing.assert_allclose(errors.translation, 0.0, atol=1e-9)


def test_relations_beyond_the_trajectory_are_counted():
    stamps, poses = _drive()
    pairs, relations = _true_relations(stamps, poses)
    half = len(stamps) // 2
    errors = relation_errors(stamps[:half], poses[:half], pairs, relations)
    assert errors.outside == int((pairs > stamps[half - 1] + 0.1).any(axis=1).sum()) > 0


@pytest.mark.parametrize("shapes", [((1,), (1, 3)), ((5,), (4, 3)), ((5,), (5, 2))])
def test_a_trajectory_of_wrong_shape_is_refused(shapes):
    with pytest.raises(ValueError, match="trajectory"):
        relation_errors(np.zeros(shapes[0]), np.zeros(shapes[1]), np.zeros((2, 2)), np.zeros((2, 3)))


def test_half_an_odometry_and_misshapen_relations_are_refused():
    stamps, poses = _drive()
    with pytest.raises(ValueError, match="odometry"):
        relation_errors(stamps, poses, np.zeros((2, 2)), np.zeros((2, 3)), odometry_stamps=stamps)
    with pytest.raises(ValueError, match="relation"):
        relation_errors(stamps, poses, np.zeros((2, 2)), np.zeros((3, 3)))


def _odometry(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """ODOM lines of a CARMEN log, or those of its scans where it has none, in the file's order."""
    with lzma.open(path, "rt") as file:
        lines = [line.split() for line in file if line.startswith(("ODOM ", "FLASER "))]
    rows = [[float(w[-3]), *map(float, w[1:4])] for w in lines if w[0] == "ODOM"]
    rows = rows or [[float(w[-3]), *map(float, w[-6:-3])] for w in lines]
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def _by_script(tmp_path: Path, *tables: np.ndarray) -> list[float]:
    paths = []
    for i, table in enumerate(tables):
        paths.append(str(tmp_path / f"{i}.txt"))
        np.savetxt(paths[-1], table, fmt="%.17g")
    script = str(SHARED / "tools" / "relations.py")
    done = subprocess.run([sys.executable, script, *paths], capture_output=True, text=True, check=True, timeout=60)
    return [float(number) for number in re.findall(r"\d+\.\d+", done.stdout)]


@pytest.mark.parametrize(
    ("log", "relations", "mean", "count"),
    [
        ("intel/intel.log.xz", "intel/intel.relations.xz", 7.37, 2984),
        ("mit_csail/mit-csail.clf.xz", "mit_csail/mit-csail.relations.xz", 1.80, 1189),
    ],
)
def test_raw_odometry_of_real_logs_scores_as_the_independent_script_says(tmp_path, log, relations, mean, count):
    if not (SHARED / "data" / log).exists() or not (SHARED / "tools" / "relations.py").exists():
        pytest.skip(f"the recording {log} or the independent script is not here")
    stamps, poses = _odometry(SHARED / "data" / log)
    with lzma.open(SHARED / "data" / relations, "rt") as file:
        known = np.loadtxt(file)
    trajectory = np.column_stack([stamps, poses])
    for every, extra in ((1, ()), (40, (trajectory,))):  # as it is, and thinned out and carried along the odometry
        odometry = (stamps, poses) if extra else (None, None)
        errors = relation_errors(stamps[::every], poses[::every], known[:, :2], known[:, [2, 3, 7]], *odometry)
        d, r = errors.translation_summary, errors.rotation_summary
        printed = _by_script(tmp_path, trajectory[::every], known, *extra)
        ours = [d.mean, d.sd, d.median, d.max, *np.degrees([r.mean, r.sd, r.median, r.max])]
        half_a_digit = 0.51 * np.array([1e-4, 1e-4, 1e-4, 1e-2, 1e-3, 1e-3, 1e-3, 1e-1])
        assert (np.abs(np.array(ours) - printed) <= half_a_digit).all()
    full = relation_errors(stamps, poses, known[:, :2], known[:, [2, 3, 7]])
    assert full.translation_summary.mean == pytest.approx(mean, abs=0.005)
    assert len(full.translation) == count


def test_each_relation_agrees_with_the_independent_script_to_a_micrometre(tmp_path):
    """Real stamps are hard (they repeat and run backwards); here every single error is compared, not their summary."""
    script = SHARED / "tools" / "relations.py"
    log = SHARED / "data" / "intel" / "intel.log.xz"
    if not script.exists() or not log.exists():
        pytest.skip("the recording intel or the independent script is not here")
    stamps, poses = _odometry(log)
    with lzma.open(SHARED / "data" / "intel" / "intel.relations.xz", "rt") as file:
        known = np.loadtxt(file)
    noise = np.random.default_rng(6).normal(0.0, 0.02, poses[::9].shape)
    np.savez(tmp_path / "in.npz", t=np.column_stack([stamps[::9], poses[::9] + noise]), r=known, o=np.c_[stamps, poses])
    code = (
        "import runpy, sys, numpy as np\n"
        "m = runpy.run_path(sys.argv[1]); d = np.load('in.npz')\n"
        "s = lambda a: a[np.argsort(a[:, 0], kind='stable')]\n"
        "p = [m['poses_at'](d['r'][:, k], s(d['t']), s(d['o'])) for k in (0, 1)]\n"
        "e = m['between'](d['r'][:, [2, 3, 7]], m['between'](*p))\n"
        "np.savetxt('out.txt', np.c_[np.hypot(e[:, 0], e[:, 1]), np.abs(e[:, 2])], fmt='%.17g')\n"
    )
    subprocess.run([sys.executable, "-c", code, str(script)], cwd=tmp_path, check=True, timeout=60)
    theirs = np.loadtxt(tmp_path / "out.txt")
    errors = relation_errors(stamps[::9], poses[::9] + noise, known[:, :2], known[:, [2, 3, 7]], stamps, poses)
    np.testing.assert_allclose(errors.translation, theirs[:, 0], atol=1e-6)
    np.testing.assert_allclose(errors.rotation, theirs[:, 1], atol=1e-6)


def test_interpolation_agrees_with_the_common_one_where_stamps_do_not_repeat():
    stamps, poses = _drive()
    wanted = np.random.default_rng(7).uniform(stamps[0], stamps[-1], (40, 2))
    found = between(interpolate(stamps, poses, wanted[:, 0]), interpolate(stamps, poses, wanted[:, 1]))
    errors = relation_errors(stamps * 100, poses, wanted * 100, found)  # so far apart that few are near
    near = np.abs(stamps[:, None, None] - wanted).min(axis=0) <= 0.001
    assert (~near).all(axis=1).sum() > 20
    np.testing.assert_allclose(errors.translation[~near.any(axis=1)], 0.0, atol=1e-9)


def test_a_run_is_judged_with_its_online_poses_and_its_wheels(make_run):
    run = make_run()
    stamps = np.stack([run.stamps[:-10], run.stamps[10:]], axis=-1)
    poses = between(run.truth[:-10], run.truth[10:])
    plain = judge(run, stamps, poses)
    assert plain.online is None
    assert 0.01 < plain.estimate.translation.mean() < 0.05
    assert plain.odometry.translation.max() < 1e-9  # this run's wheels are perfect
    worse = run.poses + np.array([0.5, 0.0, 0.0]) * (np.arange(len(run.stamps)) % 20 < 10)[:, None]
    judged = judge(replace(run, online_poses=worse), stamps, poses)
    assert judged.online is not None
    np.testing.assert_array_equal(judged.estimate.translation, plain.estimate.translation)
    assert judged.online.translation.mean() == pytest.approx(0.5, rel=0.2)
    readings = OdometryReadings(run.stamps, 1.1 * run.truth, np.arange(len(run.stamps)))
    finer = judge(replace(run, readings=readings), stamps, poses)
    assert finer.odometry.translation.mean() > 0.05


def test_a_relation_at_a_readings_stamp_is_judged_by_the_order_of_the_recording(make_run):
    # A reading every 0.1 s, every tenth with a scan; every other of these is stamped 0.63 s late.
    run = make_run()
    count = len(run.stamps)
    scans = np.arange(0, count, 10)
    sparse = replace(
        run,
        stamps=run.stamps[scans] + 0.63 * (np.arange(len(scans)) % 2),
        poses=run.truth[scans],
        odometry=run.truth[scans],
        readings=OdometryReadings(run.stamps, run.truth, np.searchsorted(scans, np.arange(count))),
    )
    asked = np.arange(5, count - 10, 10)
    first, second = asked[:-1], asked[1:]
    stamps = run.stamps[np.stack([first, second], axis=-1)]
    known = between(run.truth[first], run.truth[second])
    judged = judge(sparse, stamps, known)
    at_scans = relation_errors(sparse.stamps, sparse.poses, stamps, known, run.stamps, run.truth)
    assert at_scans.translation.mean() > 0.01
    assert judged.estimate.translation.max() < 1e-9
