"""The decorator of compiled functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """Compile `function` with numba: kept on disk between runs, and free to run beside other threads.

    A division by zero gives what it gives in NumPy. To check every divisor, as Python does, would keep the compiler
    from computing several at once.
    """
    kernel: F = njit(cache=True, nogil=True, error_model="numpy")(function)
    return kernel
