"""Which topics of a bag are the scan, the odometry and the true pose."""

from pathlib import Path

from contourslam.errors import RecordingError
from contourslam.nearest import perhaps
from contourslam.recordings.recording import Topic
from contourslam.recordings.ros_messages import (
    ODOMETRY,
    OLD_TRANSFORMS,
    POSE,
    POSE_COVARIANCE,
    SCAN,
    TRANSFORM,
    TRANSFORMS,
)

_POSES = (ODOMETRY, POSE, POSE_COVARIANCE, TRANSFORM)
TF_TYPES = (TRANSFORMS, OLD_TRANSFORMS)


def choose_scan(path: Path, topics: list[Topic], wanted: str | None) -> str:
    """Name the topic of the scans.

    Raises
    ------
    RecordingError
        If there is none or the choice is not clear; the message lists what there is. The same holds for the others.
    """
    if wanted is not None:
        return _named(path, topics, wanted, (SCAN,), "scan")
    candidates = [topic.name for topic in topics if topic.message_type == SCAN]
    if not candidates:
        raise RecordingError(f"{path}: holds no scan ({SCAN}); {_listing(topics)}")
    return _clear_choice(path, candidates, "/scan", "scan")


def choose_odometry(path: Path, topics: list[Topic], wanted: str | None) -> str | None:
    """Name the topic of the odometry; None where there is none, though ``/tf`` may hold it."""
    if wanted is not None:
        return _named(path, topics, wanted, (*_POSES, *TF_TYPES), "odometry")
    candidates = [t.name for t in topics if t.message_type == ODOMETRY and "truth" not in t.name.lower()]
    return _clear_choice(path, candidates, "/odom", "odometry") if candidates else None


def choose_truth(path: Path, topics: list[Topic], wanted: str | None) -> str | None:
    """Name the topic of the true pose, if there is one."""
    if wanted is not None:
        return _named(path, topics, wanted, _POSES, "truth")
    candidates = [t.name for t in topics if t.message_type in (ODOMETRY, POSE) and "truth" in t.name.lower()]
    return _clear_choice(path, candidates, "/ground_truth", "truth") if candidates else None


def no_odometry(path: Path, topics: list[Topic]) -> RecordingError:
    """Make the error for a bag whose odometry is neither in a topic of its own nor in ``/tf``."""
    return RecordingError(
        f"{path}: holds no odometry ({ODOMETRY}, or a transform from odom to the base in /tf); {_listing(topics)}"
    )


def _named(path: Path, topics: list[Topic], wanted: str, types: tuple[str, ...], role: str) -> str:
    for topic in topics:
        if topic.name.lstrip("/") == wanted.lstrip("/"):
            if topic.message_type in types:
                return topic.name
            raise RecordingError(
                f"{path}: the {role} topic {wanted} holds {topic.message_type}, not {' or '.join(types)}; "
                + _listing(topics)
            )
    near = perhaps(wanted, [topic.name for topic in topics])
    raise RecordingError(f"{path}: has no topic {wanted} for the {role}{near}; {_listing(topics)}")


def _clear_choice(path: Path, candidates: list[str], preferred: str, role: str) -> str:
    if len(candidates) == 1:
        return candidates[0]
    if preferred in candidates:
        return preferred
    raise RecordingError(f"{path}: several topics could be the {role}, name one of them: {', '.join(candidates)}")


def _listing(topics: list[Topic]) -> str:
    return "its topics: " + (", ".join(f"{topic.name}: {topic.message_type}" for topic in topics) or "none")
