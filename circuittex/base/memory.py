"""How much memory there is for what is about to be computed."""

from __future__ import annotations

import os
import re
from pathlib import Path

MEMINFO = Path("/proc/meminfo")
LIMITS = tuple(Path("/sys/fs/cgroup", name) for name in ("memory.max", "memory/memory.limit_in_bytes"))
"""Where Linux keeps the limit of the group of processes that this one belongs to, in a container for example; there is
one file or the other."""


def available_memory() -> int | None:
    """Bytes that this process and those that it starts may still take; None where that cannot be told.

    On Linux what the system calls available, and no more than the limit of the process's group: all of that, since what
    its processes have taken includes copies of files that would give way. Elsewhere what is built in, if known.
    """
    try:
        found = re.search(r"MemAvailable:\s*(\d+) kB", MEMINFO.read_text())
    except OSError:
        found = None
    if found is None:
        return _built_in()
    return min([1024 * int(found[1]), *filter(None, map(_limit, LIMITS))])


def _limit(path: Path) -> int | None:
    try:
        text = path.read_text().strip()
    except OSError:
        return None
    return int(text) if text.isdigit() else None


def _built_in() -> int | None:
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # no such call, as on Windows, or no such number
        return None
