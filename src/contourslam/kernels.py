"""The one place where Numba is set up, so that every kernel is compiled with the same options."""

from collections.abc import Callable
from typing import TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., object])


def kernel(function: F) -> F:
    """Compile a hot loop with Numba, cached on disk; its plain-Python twin stays at ``.py_func``.

    No fast-math: scans carry NaN and inf on purpose, and the compiler must not assume them away.
    """
    return cast(F, numba.njit(cache=True, nogil=True, error_model="numpy")(function))
