"""The one place where Numba is set up, so that every kernel is compiled with the same options."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar, cast

import numba
from numba.core import event

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile a hot loop with Numba, cached on disk; its plain-Python twin stays at ``.py_func``.

    No fast-math: scans carry NaN and inf on purpose, and the compiler must not assume them away.
    """
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


@contextmanager
def watch_compilation(begun: Callable[[str], None]) -> Iterator[None]:
    """Learn of each kernel that is compiled because Numba's cache does not hold it for the types it is called with.

    Parameters
    ----------
    begun : callable
        Called with the kernel's full name before it is compiled. An error that it raises comes out where the kernel
        was called, which then is not compiled.
    """
    with event.install_listener("numba:compile", _Listener(begun)):
        yield


class _Listener(event.Listener):
    def __init__(self, begun: Callable[[str], None]) -> None:
        self._begun = begun

    def on_start(self, event: event.Event) -> None:
        function = event.data["dispatcher"].py_func
        if function.__module__.startswith("contourslam."):  # Numba's own functions are compiled on the way
            self._begun(f"{function.__module__}.{function.__qualname__}")

    def on_end(self, event: event.Event) -> None:
        """Nothing is to be done then."""
