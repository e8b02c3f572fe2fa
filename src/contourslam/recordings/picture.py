"""A picture as a camera gives it: compressed, with the time of its exposure."""

import math
from dataclasses import dataclass
from typing import Literal

from contourslam.errors import RecordingError

Encoding = Literal["jpeg", "png"]

_STARTS: dict[str, bytes] = {"jpeg": b"\xff\xd8\xff", "png": b"\x89PNG\r\n\x1a\n"}
_ENDS: dict[str, bytes] = {"jpeg": b"\xff\xd9", "png": b"IEND\xaeB`\x82"}
_TAIL = 64  # bytes after its end that some cameras pad a JPEG with


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture of a camera.

    Parameters
    ----------
    stamp : float
        Time of the exposure, s.
    data : bytes
        A whole JPEG or PNG.
    encoding : {"jpeg", "png"}

    Raises
    ------
    RecordingError
        If the stamp is not finite, or the data is not a whole file of that encoding.
    """

    stamp: float
    data: bytes
    encoding: Encoding

    def __post_init__(self) -> None:
        if not math.isfinite(self.stamp):
            raise RecordingError(f"a picture: its stamp {self.stamp} is not finite")
        if self.encoding not in _STARTS:
            raise RecordingError(f"a picture: encoding {self.encoding!r} is neither jpeg nor png")
        if not self.data.startswith(_STARTS[self.encoding]):
            raise RecordingError(f"a picture: its data does not start as {self.encoding} does")
        if _ENDS[self.encoding] not in self.data[-_TAIL:]:
            raise RecordingError(f"a picture: its {self.encoding} data is cut short")


def encoding_of(data: bytes) -> Encoding | None:
    """Tell how a picture is encoded by its first bytes; None where it is neither JPEG nor PNG."""
    if data.startswith(_STARTS["jpeg"]):
        return "jpeg"
    return "png" if data.startswith(_STARTS["png"]) else None
