"""CARMEN's text logs: one message a line, as the Radish collection and its descendants keep them."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from contourslam.errors import RecordingError, ScanError
from contourslam.geometry.poses import between
from contourslam.recordings.carmen_lines import SCAN_LINES, WRONG_COUNT, laser_pose, parse_odom
from contourslam.recordings.recording import Message, Recording, SkipCount, Topic
from contourslam.recordings.text import text_lines

Floats = NDArray[np.float64]

_KEYWORDS = (*SCAN_LINES, b"ODOM", b"PARAM", b"SYNC", b"RLASER", b"TRUEPOS", b"RAWLASER", b"ROBOTLASER")
_CONTENT = {"FLASER": "laser scan and odometry", "ROBOTLASER1": "laser scan and odometry", "ODOM": "odometry"}
# A log says what it is at its start, after at most some hundred parameters and comments.
_HEAD_LINES = 2000
_SCANS_COMPARED = 20
_OFFSETS = (b"robot_frontlaser_offset", b"robot_frontlaser_side_offset", b"robot_frontlaser_angular_offset")


class CarmenRecording(Recording):
    """A CARMEN log, plain, gzip or xz.

    Each scan line gives the odometry that it carries and then the scan, both at the line's IPC stamp; the beams of a
    scan count as simultaneous. The lidar's place is read from the ``robot_frontlaser_offset`` parameters (m, m, rad).

    Parameters
    ----------
    path : Path
    scan_topic : str or None
        ``FLASER`` or ``ROBOTLASER1``; by default the one that comes first.

    Raises
    ------
    RecordingError
        If the file cannot be read, is no CARMEN log, or holds no scan.
    """

    def __init__(self, path: Path, scan_topic: str | None = None) -> None:
        super().__init__(path)
        if scan_topic is not None and scan_topic.encode() not in SCAN_LINES:
            raise RecordingError(f"{path}: a CARMEN log has scans in FLASER or ROBOTLASER1, not in {scan_topic}")
        self._scan_keyword = scan_topic.encode() if scan_topic is not None else b""
        self._survey: list[Topic] | None = None
        self._read_head()

    def _read_head(self) -> None:
        offsets: dict[bytes, float] = {}
        mounts: list[Floats | None] = []
        recognised = False
        try:
            for number, line in text_lines(self.path):
                words = line.split()
                if not words:
                    continue
                recognised = recognised or _is_carmen(words[0])
                if number > _HEAD_LINES and (not recognised or mounts):
                    break
                if words[0] == b"PARAM" and len(words) > 2 and words[1] in _OFFSETS:
                    offsets[words[1]] = _number(words[2]) or 0.0
                if words[0] in SCAN_LINES and self._scan_keyword in (b"", words[0]):
                    self._scan_keyword = words[0]
                    mounts.append(_stated_mount(words[0], line))
                    if len(mounts) == _SCANS_COMPARED:
                        break
        except RecordingError:
            if not recognised:
                raise
            self._scan_keyword = self._scan_keyword or b"FLASER"  # what comes before the damage is still read
        if not recognised:
            raise RecordingError(f"{self.path}: neither a rosbag (1, 2, mcap) nor a CARMEN log")
        if not self._scan_keyword:
            raise self._no_scans()
        if offsets:
            x, y, yaw = (offsets.get(name, 0.0) for name in _OFFSETS)
            self.lidar_mount = (x, y, yaw)
        self._note_stated_mount([mount for mount in mounts if mount is not None])

    def _note_stated_mount(self, mounts: list[Floats]) -> None:
        if not mounts:
            return
        mean = np.mean(mounts, axis=0)
        if np.abs(mean).max() > 1e-3 and np.abs(np.array(mounts) - mean).max() < 2e-3:
            x, y, yaw = mean
            self.notes.append(
                f"the scan lines state a laser pose that is off the odometry by a constant ({x:.3f} m, {y:.3f} m, "
                f"{yaw:.4f} rad): perhaps the lidar's place on the robot; it is not used"
            )

    def _no_scans(self) -> RecordingError:
        wanted = self._scan_keyword.decode() or "FLASER or ROBOTLASER1"
        found = ", ".join(f"{topic.name}: {topic.count}" for topic in self.topics()) or "none"
        return RecordingError(f"{self.path}: no usable {wanted} line; lines found: {found}")

    def topics(self) -> list[Topic]:
        """Count the lines by keyword; the first call reads through the log."""
        if self._survey is None:
            counts: dict[bytes, int] = {}
            spans: dict[bytes, tuple[float, float]] = {}
            try:
                for _, line in text_lines(self.path):
                    words = line.split(None, 1)
                    if not words or not _is_keyword(words[0]):
                        continue
                    counts[words[0]] = counts.get(words[0], 0) + 1
                    tail = line.rsplit(None, 3)
                    stamp = _number(tail[1]) if len(tail) == 4 else None
                    if stamp is not None:
                        first, last = spans.get(words[0], (stamp, stamp))
                        spans[words[0]] = (min(first, stamp), max(last, stamp))
            except RecordingError:
                pass  # messages() raises it once it gets there
            self._survey = [
                Topic(name := keyword.decode(), _CONTENT.get(name, "not used"), count, *spans.get(keyword, ()))
                for keyword, count in sorted(counts.items())
            ]
        return list(self._survey)

    @property
    def start(self) -> float | None:
        """Earliest stamp of the lines that are used, s; reads through the log once."""
        return min((t.start for t in self.topics() if t.name in _CONTENT and t.start is not None), default=None)

    @property
    def end(self) -> float | None:
        """Latest stamp of the lines that are used, s; reads through the log once."""
        return max((t.end for t in self.topics() if t.name in _CONTENT and t.end is not None), default=None)

    def messages(self) -> Iterator[Message]:
        """Yield odometry and scans in the order of the log; a malformed line is skipped and counted.

        Raises
        ------
        RecordingError
            Where the compressed data is damaged, a line is binary, or the last line is cut; the message names the line.
            Also at the end if no scan could be used.
        """
        skip = SkipCount(self.skipped)
        parsers = {b"ODOM": parse_odom, self._scan_keyword: SCAN_LINES[self._scan_keyword]}
        scans = 0
        for number, line in text_lines(self.path):
            words = line.split(None, 1)
            if not words:
                continue
            keyword = words[0]
            cut = not line.endswith(b"\n")
            parser = parsers.get(keyword)
            if parser is None:
                if b"\x00" in line:
                    raise RecordingError(f"{self.path}: damaged at line {number}: binary data in a text log")
                if cut and any(known.startswith(keyword) for known in parsers):
                    raise RecordingError(f"{self.path}: cut short in line {number}, the last")
                if not (keyword.startswith(b"#") or _is_keyword(keyword)):
                    skip.add("line that is not CARMEN's", f"line {number}")
                continue
            try:
                parsed = parser(line)
            except (ValueError, ScanError) as error:
                if cut:
                    raise RecordingError(f"{self.path}: cut short in line {number}, the last") from error
                if b"\x00" in line:
                    raise RecordingError(f"{self.path}: damaged at line {number}: binary data in a text log") from error
                reason = str(error) if str(error) == WRONG_COUNT else "value that is not a number"
                skip.add(f"{keyword.decode()} line with a {reason}", f"line {number}")
                continue
            scans += len(parsed) - 1
            yield from parsed
        if not scans:
            raise self._no_scans()


def _is_keyword(word: bytes) -> bool:
    return word[:1].isupper() and word.replace(b"_", b"").isalnum()


def _is_carmen(word: bytes) -> bool:
    return any(word.startswith(keyword) for keyword in _KEYWORDS)


def _number(word: bytes) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _stated_mount(keyword: bytes, line: bytes) -> Floats | None:
    """Laser pose seen from the odometry pose of one scan line, or None where the line is malformed."""
    try:
        stated = laser_pose(line)
        return between(SCAN_LINES[keyword](line)[0].pose, stated) if np.abs(stated).max() < 1e9 else None
    except (ValueError, ScanError):
        return None
