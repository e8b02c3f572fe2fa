"""Opening a recording of any format that is known."""

from pathlib import Path

from contourslam.errors import RecordingError
from contourslam.recordings.recording import Recording
from contourslam.recordings.text import first_bytes, open_text

_BAG_STARTS = (b"#ROSBAG V", b"\x89MCAP0", b"SQLite format 3\x00")


def open_recording(
    path: str | Path,
    *,
    scan_topic: str | None = None,
    odometry_topic: str | None = None,
    truth_topic: str | None = None,
) -> Recording:
    """Open a rosbag1, a rosbag2 (folder or lone mcap or sqlite3 file) or a CARMEN log (plain, gzip, xz).

    The content tells the format, not the suffix. Nothing is written beside the file.

    Parameters
    ----------
    path : str or Path
    scan_topic, odometry_topic, truth_topic : str, optional
        Topics to use where a bag has several that could serve; in a CARMEN log, the kind of scan line.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        If it is missing, empty, of another format, damaged before its first message, or lacks scans or odometry; then
        the message lists the topics there are.
    """
    path = Path(path)
    if not path.is_dir():
        head = first_bytes(path, 512)
        if not head.startswith(_BAG_STARTS):
            return _open_log(path, head, scan_topic, odometry_topic, truth_topic)
    from contourslam.recordings.rosbag import BagRecording  # here, since a log does without rosbags' 0.2 s

    return BagRecording(path, scan_topic, odometry_topic, truth_topic)


def _open_log(path: Path, head: bytes, scan: str | None, odometry: str | None, truth: str | None) -> Recording:
    from contourslam.recordings.carmen import CarmenRecording

    if head.startswith((b"\x1f\x8b", b"\xfd7zXZ\x00")):
        with open_text(path) as file:
            try:
                inner = file.read(512)
            except Exception:  # CarmenRecording finds the damage again and names its place
                inner = b""
        if inner.startswith(_BAG_STARTS):
            raise RecordingError(f"{path}: a compressed rosbag; decompress it first")
    elif b"\x00" in head.partition(b"\n")[0]:
        raise RecordingError(f"{path}: neither a rosbag (1, 2, mcap) nor a CARMEN log")
    if truth is not None or odometry not in (None, "ODOM"):
        raise RecordingError(f"{path}: a CARMEN log has no topics of odometry or true pose to choose from")
    return CarmenRecording(path, scan)
