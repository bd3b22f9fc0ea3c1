"""The decorator of compiled functions, and how many of them may run at once."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from functools import cache
from typing import Any, TypeVar

from numba import config, njit

from circuittex.base.errors import CircuittexWarning
from circuittex.base.private import private_folder

F = TypeVar("F", bound=Callable[..., object])
T = TypeVar("T")

MOST_THREADS = 256
"""As many as a pool may come to have; it makes no more than are asked for at once."""


def compiled(function: F) -> F:
    """Compile `function` with numba: kept on disk between runs, and free to run beside other threads.

    A division by zero gives what it gives in NumPy. To check every divisor, as Python does, would keep the compiler
    from computing several at once.
    """
    return _compiled(function, nogil=True, error_model="numpy")


def compiled_sums(function: F) -> F:
    """The same for a function whose sums may be formed in another order than it says, several terms at once.

    The compiler chooses the order: it is the same in every call, on any number of threads.
    """
    return _compiled(function, nogil=True, error_model="numpy", fastmath={"reassoc", "nsz"})


def _compiled(function: F, **options: Any) -> F:
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
    pieces = len(edges) - 1
    share_out(lambda k: kernel(edges[k], edges[k + 1], *arguments), pieces, pieces)


def share_out(work: Callable[[int], T], count: int, threads: int) -> list[T]:
    """[work(0), work(1), ..., work(count - 1)], as many at a time as there are `threads`; this one is among them.

    The others are kept from call to call: to start one takes as long as a millionth of an iteration's operations.

    >>> share_out(lambda k: k**2, 5, threads=2)
    [0, 1, 4, 9, 16]
    """
    numbers, done = iter(range(count)), dict[int, T]()

    def take() -> None:
        for k in numbers:
            done[k] = work(k)

    others = [_pool(os.getpid()).submit(take) for _ in range(min(threads, count) - 1)]
    try:
        take()
    finally:
        wait(others)
    for other in others:
        other.result()
    return [done[k] for k in range(count)]


@cache
def _pool(process: int) -> ThreadPoolExecutor:
    """The threads of this process: those of the one that it was forked from are not in it."""
    return ThreadPoolExecutor(MOST_THREADS)
