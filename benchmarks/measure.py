"""Timing that stands other work on the machine: pieces run in turn, and only ratios of neighbours are compared."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Seconds = NDArray[np.float64]


def paired(pieces: Mapping[str, Callable[[], object]], repeats: int, *, warm_up: bool = True) -> dict[str, Seconds]:
    """Seconds (repeats,) that each piece takes, by default after one call that is not counted.

    The pieces run in turn, so that what else the machine does meets all alike.
    """
    if warm_up:
        for piece in pieces.values():
            piece()
    seconds = {name: np.empty(repeats) for name in pieces}
    for k in range(repeats):
        for name, piece in pieces.items():
            clock = time.perf_counter()
            piece()
            seconds[name][k] = time.perf_counter() - clock
    return seconds


def ratio(of: Seconds, to: Seconds) -> float:
    """Median of the quotients of neighbouring measurements."""
    return float(np.median(of / to))


def markdown(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A Markdown table; floats with three digits."""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for row in rows:
        cells = (digits(cell) if isinstance(cell, float) else str(cell) for cell in row)
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def digits(value: float) -> str:
    """Three digits, without an exponent where a person would not use one.

    >>> digits(1234.5), digits(1.23456), digits(0.012345), digits(1.2345e-12)
    ('1234', '1.23', '0.0123', '1.23e-12')
    """
    return f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"


def machine() -> str:
    """What the numbers were measured on, for the line above a table."""
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return f"{os.cpu_count()} cores ({platform.machine()}){load}, Python {platform.python_version()}"
