"""What just-in-time compilation costs the first run: a small relaxation with an empty cache and with a full one.

    python benchmarks/compile.py [--repeats 2]

Each run is a process of its own. The first of a pair has an empty NUMBA_CACHE_DIR and compiles every kernel that a
study needs; the second finds them there. Their difference is paid once for an installation.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from measure import Table, arguments, publish

HEAD = ["run", "s", "cached kernels"]
SMALL_STUDY = """
from dataclasses import replace
from circuittex.contact.extract import contact_state
from circuittex.design import plain_weave
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation.relax import relax

design = plain_weave(yarns=1)
design = replace(design, numerics=replace(design.numerics, elements=4, tolerance=1e-3))
mesh = build_mesh(design)
contact_state(mesh, relax(mesh, design).configuration, design.contact, per_element=4)
"""
"""Every kernel that `circuittex run` calls, with arrays of the same kinds, on 20 fibrils of four elements."""


def first_and_second(code: str) -> tuple[float, float, int]:
    """Seconds of two processes that run `code`, the first with an empty cache, and how many kernels it left there."""
    with tempfile.TemporaryDirectory(prefix="circuittex-kernels-") as cache:
        first, kept = run(code, cache), kernels(cache)
        second = run(code, cache)
        if kernels(cache) != kept:
            raise RuntimeError(f"the second run compiled again: {kernels(cache)} kernels after {kept}")
    return first, second, kept


def run(code: str, cache: str) -> float:
    """Seconds of a process that runs `code` with its compiled kernels in the folder `cache`."""
    clock = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, env={**os.environ, "NUMBA_CACHE_DIR": cache})
    return time.perf_counter() - clock


def kernels(cache: str) -> int:
    """How many compiled kernels, one for each kind of arguments, a cache holds."""
    return len(list(Path(cache).rglob("*.nbc")))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--repeats", type=int, default=2)
    options = parser.parse_args()
    pairs = np.array([first_and_second(SMALL_STUDY) for _ in range(options.repeats)])
    first, second, kept = (float(x) for x in np.median(pairs, axis=0))
    cost = float(np.median(pairs[:, 0] - pairs[:, 1]))
    rows = [["cache empty", first, int(kept)], ["cache full", second, int(kept)], ["difference", cost, ""]]
    publish(options, [Table("A small relaxation in a fresh process, s (median):", HEAD, rows)])


if __name__ == "__main__":
    main()
