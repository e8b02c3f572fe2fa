"""What a page may ask for; anything else is no request."""

import json
import math
from dataclasses import dataclass
from typing import Any

from contourslam.errors import ContourslamError

PLAIN = ("pause", "play", "follow")
MOST = 1e15  # no time, speed or number is larger


class RequestError(ContourslamError):
    """A page, or what claims to be one, asked for something that there is not."""


@dataclass(frozen=True, slots=True)
class Request:
    """One request.

    Attributes
    ----------
    do : str
        "pause", "play", "follow", "speed", "seek", "step", "drawn" or "story".
    value : float
        Speed (infinite for as fast as possible); time to look at, s; steps; number of the frame that was drawn;
        landmark.
    lane : int
        Of "story".
    """

    do: str
    value: float = 0.0
    lane: int = 0


def parse(text: str | bytes) -> Request:
    """Read a request.

    Raises
    ------
    RequestError
        If it is none.
    """
    try:
        raw: Any = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RequestError("a request is no JSON") from error
    if not isinstance(raw, dict):
        raise RequestError("a request is no object")
    do, value, lane = raw.get("do"), raw.get("value"), raw.get("lane", 0)
    if do in PLAIN:
        return Request(do)
    if do == "speed" and value is None:
        return Request(do, math.inf)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < MOST:
        raise RequestError("a request has no finite value")
    if do == "speed" and value > 0.0:
        return Request(do, float(value))
    if do in ("seek", "drawn"):
        return Request(do, float(value))
    if do == "step" and value in (-10, -1, 1, 10):
        return Request(do, float(value))
    if do == "story" and isinstance(lane, int) and 0 <= lane < 64 and abs(value) < 2**31:
        return Request(do, float(int(value)), lane)
    raise RequestError("there is no such request")
