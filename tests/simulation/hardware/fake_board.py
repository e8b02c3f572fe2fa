"""A board without a firmware: its motors get a constant duty, and what it hears it sends back."""

from dataclasses import dataclass
from typing import Any, Self

from contourslam.errors import ContourslamError


@dataclass(frozen=True)
class Done:
    duty: tuple[int, int]
    sent: bytes


class FakeBoard:
    def __init__(self, duty: tuple[int, int], *, fails: bool = False) -> None:
        self._duty, self._fails = duty, fails

    def __enter__(self) -> Self:
        if self._fails:
            raise ContourslamError("the board is not there")
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing to close."""

    def step(self, seconds: float, *, received: bytes, **_: Any) -> Done:
        return Done(self._duty, received)
