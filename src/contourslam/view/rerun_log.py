"""What a recording being mapped gives, scan by scan, as entities of a Rerun file: docs/rerun.md names them."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from contourslam.contour.contours import Floats
from contourslam.detectors import Detector
from contourslam.geometry.poses import compose_one, transform
from contourslam.slam.look import Look
from contourslam.slam.result import Loop
from contourslam.view.keeper import LARGE, is_told, shift_of
from contourslam.view.lane import Lane
from contourslam.view.moment import LaneMoment, Moment
from contourslam.view.rerun_file import RerunFile
from contourslam.view.rerun_rows import ellipses, flat, nis_bounds, quaternions, segment, turned
from contourslam.view.rerun_style import CONTOURS, SHADES, lay_out, set_style

NO_KNOTS: NDArray[np.int64] = np.empty(0, dtype=np.int64)
GUESS = 10.0  # m; half of what the map view shows where nobody knows better
HIGH = 3.0  # times the threshold; a response beyond is drawn there
SHARE = 0.2  # bytes of maps per byte of scans, at most
INFO, DEBUG = "INFO", "DEBUG"  # levels of the log
SCAN_BYTES = 1500  # of a scan beside its points


class RerunLog:
    """Writes moments, maps and what is known at the end; changed in place by each.

    A lane's map is drawn up once the scans since the last one weigh five times as much as that map did, so that maps
    are a small part of the file however large the building is; after a loop that moved the robot at once. As for the
    page, only where drawing changes nothing in what the mapper does next.

    Parameters
    ----------
    file : RerunFile
    detectors : mapping of str to Detector
        Of each lane, by its name.
    """

    def __init__(self, file: RerunFile, detectors: Mapping[str, Detector]) -> None:
        self.file, self._detectors = file, detectors
        self._names = list(detectors)
        self._weights = dict.fromkeys(self._names, 0.0)  # bytes of scans since the last map, less what that map took
        self._told = dict.fromkeys(self._names, 0)  # loops
        self._places: dict[str, dict[int, Floats]] = {name: {} for name in self._names}
        self._before: dict[str, Floats] = {}  # end of each way
        self._stages: dict[str, int] = {}
        self._index, self._stamp = -1, 0.0
        self._stamps: list[float] = []
        self._low, self._high = np.full(2, np.inf), np.full(2, -np.inf)
        set_style(file, self._names)

    def add(self, moment: Moment, lanes: Sequence[Lane]) -> None:
        """Add what a scan gave; in the thread that maps."""
        index, stamp = moment.index, moment.lanes[0].update.stamp
        if index == 0:
            lay_out(self.file, self._names, moment.lanes[0].update.pose[:2], GUESS, truth=moment.truth is not None)
            for name, lane in zip(self._names, lanes, strict=True):
                self._set_mount(name, lane.mount)
        self._index, self._stamp = index, stamp
        self._stamps.append(stamp)
        self._way("world/odometry", index, moment.odometry)
        for name, lane, done in zip(self._names, lanes, moment.lanes, strict=True):
            self._pose(name, done)
            self._scan(name, moment)
            self._look(name, lane.look, lane.mount, done)
            if moment.truth is not None:
                self._error(name, index, done.update.pose, moment.truth)
            self._loops(name, lane)
            if lane.at_rest and self._weights[name] >= 0.0:
                self._map(name, lane)
            self._weights[name] += SHARE * (SCAN_BYTES + moment.trace.points.nbytes)
        if moment.truth is not None:
            self._way("world/truth", index, moment.truth)
        self.file.scan_done(index)

    def tell(self, text: str, level: str = INFO, *, entity: str = "log/recording") -> None:
        """Add a line to the log, at the scan that was last."""
        if self._index < 0:
            return
        self.file.add(entity, rr.TextLog.columns, self._index, self._stamp, text=[text], level=[level])

    def finish(self, lanes: Sequence[Lane], truth: Floats | None = None, poses: Floats | None = None) -> None:
        """Add what is known once the last scan is in, and lay the map view out around it.

        Parameters
        ----------
        lanes : sequence of Lane
        truth : ndarray, shape (t, 3), optional
            True poses at the scans, where they were not known while these came.
        poses : ndarray, shape (t, 3), optional
            Those of the only lane as known at the time, to hold against them.
        """
        for name, lane in zip(self._names, lanes, strict=True):
            self._map(name, lane, final=True)
        if truth is not None and poses is not None:
            self._truths(truth, poses)
        if np.isfinite(self._low).all():
            middle, half = 0.5 * (self._low + self._high), 0.5 * float((self._high - self._low).max())
            known = truth is not None or "world/truth" in self._before
            lay_out(self.file, self._names, middle, max(1.05 * half, 1.0), truth=known)

    def _truths(self, truth: Floats, poses: Floats) -> None:
        for index, stamp in enumerate(self._stamps):
            self._stamp = stamp
            self._way("world/truth", index, truth[index])
            self._error(self._names[0], index, poses[index], truth[index])

    def _row(self, entity: str, columns: Any, **components: Any) -> None:
        self.file.add(entity, columns, self._index, self._stamp, **components)

    def _way(self, entity: str, index: int, pose: Floats) -> None:
        """Add the step since the last scan."""
        at = np.array(pose[:2], dtype=np.float64)
        strips = segment(self._before.get(entity, at), at)
        self.file.add(entity, rr.LineStrips3D.columns, index, self._stamp, strips=strips)
        self._before[entity] = at

    def _pose(self, name: str, done: LaneMoment) -> None:
        update = done.update
        x, y, theta = update.pose
        self._way(f"world/{name}/trajectory", self._index, update.pose)
        self._row(
            f"world/{name}/robot",
            rr.Transform3D.columns,
            translation=np.array([[x, y, 0.0]]),
            quaternion=quaternions(np.array([theta])),
        )
        axes = ellipses(update.pose[None, :2], update.covariance[None, :2, :2])
        self._row(f"world/{name}/uncertainty", rr.Ellipsoids3D.columns, **axes)
        for quantity, value in (("x", x), ("y", y), ("heading", theta)):
            self._plot(f"pose/{quantity}/{name}", [value])
        sigma = math.sqrt(max(update.covariance[0, 0] + update.covariance[1, 1], 0.0))
        self._plot(f"sigma/{name}", [sigma])
        if update.nis_dof:
            self._plot(f"nis/{name}", [update.nis / update.nis_dof])
            self._plot(f"nis/{name}/bounds", list(nis_bounds(update.nis_dof)))
        if done.stages:
            self._plot(f"stages/{name}", [milliseconds for _, milliseconds in done.stages])
        if self._stages.get(name) != len(done.stages):
            self._stages[name] = len(done.stages)
            self.file.fix(f"plots/stages/{name}", rr.SeriesLines(names=[stage for stage, _ in done.stages]))

    def _plot(self, what: str, values: Sequence[float], index: int | None = None) -> None:
        at = self._index if index is None else index
        self.file.add(f"plots/{what}", rr.Scalars.columns, at, self._stamp, scalars=np.array(values, dtype=np.float64))

    def _error(self, name: str, index: int, pose: Floats, truth: Floats) -> None:
        self._plot(f"error/{name}", [math.hypot(pose[0] - truth[0], pose[1] - truth[1])], index)

    def _scan(self, name: str, moment: Moment) -> None:
        trace = moment.trace
        contour = np.repeat(np.arange(len(trace.closed)), np.diff(trace.starts)) % len(CONTOURS)
        self._row(
            f"world/{name}/robot/lidar/scan",
            rr.Points3D.columns,
            positions=flat(trace.points),
            class_ids=contour.astype(np.uint16),
        )

    def _look(self, name: str, look: Look | None, mount: Floats, done: LaneMoment) -> None:
        """Add what the mapper itself made of the scan, where it looked for landmarks."""
        entity, update = f"world/{name}/look", done.update
        here = compose_one(update.pose, mount)
        if look is None or look.stamp != update.stamp:
            self._row(f"{entity}/associations", rr.LineStrips3D.columns, strips=[], class_ids=np.empty(0, np.uint16))
            return
        found, threshold = look.detection, self._detectors[name].threshold
        share = np.clip(found.response / threshold, 0.0, HIGH)
        curve = np.column_stack([transform(here, found.curve.points), share])
        shade = len(CONTOURS) + np.minimum(share * (len(SHADES) - 1), len(SHADES) - 1).astype(np.uint16)
        self._row(f"{entity}/response", rr.Points3D.columns, positions=curve, class_ids=shade)
        self._row(f"{entity}/candidates", rr.Points3D.columns, positions=curve[found.candidates])
        corners = transform(here, found.corners.positions)
        self._row(f"{entity}/corners", rr.Points3D.columns, positions=flat(corners))
        self._associate(entity, name, here[:2], corners[look.ids[: len(corners)] >= 0], update.missed)
        self._weights[name] += SHARE * 14.0 * len(curve)

    def _associate(self, entity: str, name: str, here: Floats, seen: Floats, missed: Sequence[int]) -> None:
        places = self._places[name]
        lost = [places[number] for number in missed if number in places]
        strips = [flat(np.stack([here, place])) for place in (*seen, *lost)]
        kinds = np.array([turned("seen")] * len(seen) + [turned("missed")] * len(lost), dtype=np.uint16)
        self._row(f"{entity}/associations", rr.LineStrips3D.columns, strips=strips, class_ids=kinds)

    def _loops(self, name: str, lane: Lane) -> None:
        for loop in lane.loops[self._told[name] :]:
            self.tell(_loop_text(loop), INFO if is_told(loop) else DEBUG, entity=f"log/{name}")
            if shift_of(loop) > LARGE:
                self._weights[name] = 0.0
        self._told[name] = len(lane.loops)

    def _map(self, name: str, lane: Lane, *, final: bool = False) -> None:
        drawn = lane.draw(np.arange(len(self._stamps)) if final else NO_KNOTS)
        entity, corners, walls = f"world/{name}/map", drawn["corners"], flat(drawn["walls"].reshape(-1, 2))
        p = drawn["covariances"].astype(np.float64)
        numbers = {key: drawn[source] for key, source in (("id", "corner_ids"), ("o", "observed"), ("f", "failed"))}
        kinds = np.where(drawn["convex"] > 0, turned("convex"), turned("concave")).astype(np.uint16)
        self._row(f"{entity}/corners", rr.Points3D.columns, positions=flat(corners), class_ids=kinds)
        if len(corners):  # values of no length have no type
            self._row(f"{entity}/corners/seen", rr.AnyValues.columns, **numbers)
        axes = ellipses(corners.astype(np.float64), p[:, [0, 1, 1, 2]].reshape(-1, 2, 2))
        self._row(f"{entity}/ellipses", rr.Ellipsoids3D.columns, **axes)
        strips = list(walls.reshape(-1, 2, 3))
        self._row(f"{entity}/walls", rr.LineStrips3D.columns, strips=strips)
        ties = list(flat(drawn["loops"].reshape(-1, 2)).reshape(-1, 2, 3))
        self._row(f"{entity}/loops", rr.LineStrips3D.columns, strips=ties)
        ends = drawn["walls"].reshape(-1, 2, 2).mean(axis=1)
        numbered = zip((*drawn["corner_ids"], *drawn["wall_ids"]), (*corners, *ends), strict=True)
        self._places[name] = {int(number): place for number, place in numbered}
        self._weights[name] = -float(sum(values.nbytes for values in drawn.values()) + 40 * len(corners))
        here = self._before[f"world/{name}/trajectory"][None]
        shown = np.concatenate([here, corners, drawn["walls"].reshape(-1, 2), drawn["path"][:, :2]])
        self._low, self._high = np.minimum(self._low, shown.min(axis=0)), np.maximum(self._high, shown.max(axis=0))
        if final:
            self.file.fix(f"world/{name}/final/walls", rr.LineStrips3D(strips))
            if len(drawn["path"]):
                self.file.fix(f"world/{name}/final/trajectory", rr.LineStrips3D([flat(drawn["path"][:, :2])]))

    def _set_mount(self, name: str, mount: Floats) -> None:
        x, y, theta = mount
        turn = rr.Quaternion(xyzw=quaternions(np.array([theta]))[0])
        self.file.fix(f"world/{name}/robot/lidar", rr.Transform3D(translation=[x, y, 0.0], quaternion=turn))


def _loop_text(loop: Loop) -> str:
    angle = math.degrees(abs(float(loop.shift[2])))
    return (
        f"{shift_of(loop):.2f} m and {angle:.1f}° off, by {loop.method}, {loop.pairs} pairs, "
        f"residual {100.0 * loop.residual:.1f} cm, to {loop.earlier_stamp:.3f} s"
    )
