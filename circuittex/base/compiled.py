"""The decorator of compiled functions, and how many of them may run at once."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from typing import Any, TypeVar

from numba import config, njit

from circuittex.base.errors import CircuittexWarning
from circuittex.base.private import private_folder

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """Compile `function` with numba: kept on disk between runs, and free to run beside other threads.

    A division by zero gives what it gives in NumPy. To check every divisor, as Python does, would keep the compiler
    from computing several at once.
    """
    options = {"nogil": True, "error_model": "numpy"}
    try:
        kernel: F = njit(cache=True, **options)(function)
    except RuntimeError:  # numba: no place to keep it, neither beside the file nor in the user's cache
        kernel = njit(cache=_kept_elsewhere(), **options)(function)
    return kernel


@cache
def _kept_elsewhere() -> bool:
    """Have numba keep compiled functions in the private folder; False where there is none."""
    folder = private_folder()
    where = f"kept in {folder}" if folder else "compiled anew in every process"
    warnings.warn(
        f"neither the installation nor the home folder can be written to: compiled functions are {where}",
        CircuittexWarning,
        stacklevel=3,
    )
    if folder is None:
        return False
    config.CACHE_DIR = str(folder)
    os.environ["NUMBA_CACHE_DIR"] = str(folder)  # processes that this one starts need not find out for themselves
    return True


def available_cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def cores() -> int:
    """How many threads may run compiled functions: NUMBA_NUM_THREADS, and no more than this process has cores."""
    return min(available_cores(), int(config.NUMBA_NUM_THREADS))


def side_by_side(kernel: Callable[..., object], edges: Sequence[int], *arguments: Any) -> None:
    """Call kernel(first, last, *arguments) for each range between two edges, all at the same time."""
    if len(edges) == 2:
        kernel(*edges, *arguments)
        return
    with ThreadPoolExecutor(len(edges) - 1) as pool:
        list(pool.map(lambda piece: kernel(*piece, *arguments), pairwise(edges)))
