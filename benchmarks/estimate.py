"""What is said before a study begins against what it takes then.

    python benchmarks/estimate.py [DESIGN.toml ...] [--sizes 2 4 8] [--steps 4] [--workers 2]

Weaves of N x N yarns of ten fibrils, stretched and sheared in so many steps each, and whole designs, each in a process
of its own: the words before the first state, the seconds from there until the last state is recorded, and the largest
memory that the process and those it started had together, looked at five times a second. The last column is what it
takes to find these words, in parts of the whole run.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from measure import Table, arguments, publish

from circuittex.design import Design, load_design, plain_weave, shear, uniaxial
from circuittex.geometry.weave import build_mesh
from circuittex.results.records import Study
from circuittex.study import run
from circuittex.study.forecast import Forecast

HEAD = ["design", "unknowns", "states", "workers", "said", "took s", "took GB", "estimate s", "of the run %"]


def weave(yarns: int, steps: int) -> Design:
    """The design of one size."""
    strains = tuple(np.round(0.025 * np.arange(1, steps + 1), 6).tolist())
    loading = (uniaxial("stretch", strains), shear("shear", strains)) if steps else ()
    base = plain_weave(yarns=yarns, loading=loading)
    return replace(base, name=f"{yarns} x {yarns} yarns", numerics=replace(base.numerics, elements=max(10, 5 * yarns)))


def measured(design: Design, workers: int) -> dict[str, Any]:
    """What one study in this process is said to take, and takes."""
    said: list[tuple[float, str]] = []
    peak, over = [0.0], threading.Event()

    def look() -> None:
        while not over.wait(0.2):
            peak[0] = max(peak[0], tree_memory())

    begin = time.monotonic()
    spent: list[float] = []
    real = run.foresee

    def timed(study: Study, workers: int) -> Forecast | None:
        clock = time.monotonic()
        try:
            return real(study, workers)
        finally:
            spent.append(time.monotonic() - clock)

    run.foresee = timed
    watcher = threading.Thread(target=look)
    watcher.start()
    try:
        with tempfile.TemporaryDirectory() as folder:
            run.run_study(
                design, folder, workers=workers, progress=lambda text: said.append((time.monotonic() - begin, text))
            )
    finally:
        run.foresee = real
        over.set()
        watcher.join()
    opening, words = next((at, text.strip()) for at, text in said if "; " in text and text.endswith("\n"))
    end = next(at for at, text in said if text == "figures and report")
    states = int(words.partition("; ")[2].partition(" ")[0])
    found = {"words": words.partition(";")[0], "states": states, "seconds": end - opening, "memory": peak[0] / 1e9}
    unknowns = 9 * build_mesh(design).n_nodes
    return {"name": design.name, "unknowns": unknowns, "workers": workers, "before": sum(spent), "all": end, **found}


def tree_memory() -> float:
    """Resident memory of this process and all below it, bytes; 0 where /proc does not tell."""
    parents: dict[int, int] = {}
    resident: dict[int, float] = {}
    for status in Path("/proc").glob("[0-9]*/status"):
        try:
            text = status.read_text()
        except OSError:  # it has just ended
            continue
        parent, held = re.search(r"PPid:\s*(\d+)", text), re.search(r"VmRSS:\s*(\d+) kB", text)
        if parent and held:
            parents[int(status.parent.name)], resident[int(status.parent.name)] = int(parent[1]), 1024.0 * int(held[1])
    tree = {os.getpid()}
    while more := {child for child, parent in parents.items() if parent in tree} - tree:
        tree |= more
    return sum(resident.get(process, 0.0) for process in tree)


def in_own_process(words: Sequence[object]) -> dict[str, Any]:
    """`measured` in a process of its own."""
    command = [sys.executable, __file__, "--one", *map(str, words)]
    result: dict[str, Any] = json.loads(subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True).stdout)
    return result


def table(results: Sequence[dict[str, Any]]) -> Table:
    """A row for each study."""
    keys = "name", "unknowns", "states", "workers", "words", "seconds", "memory", "before"
    rows = [[*(result[key] for key in keys), 100 * result["before"] / result["all"]] for result in results]
    return Table("From the line before the first state to the last state, and the time before that line:", HEAD, rows)


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("designs", nargs="*", metavar="DESIGN", help="files of designs, measured after the weaves")
    parser.add_argument("--sizes", type=int, nargs="*", default=[2, 4, 8], help="yarns each way")
    parser.add_argument("--steps", type=int, default=4, help="states of each of the two loading paths")
    parser.add_argument("--workers", type=int, default=2, help="loading paths beside one another")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    weaves = [weave(yarns, options.steps) for yarns in options.sizes] if options.one else []
    if options.one:
        (design,) = [*weaves, *map(load_design, options.designs)]
        print(json.dumps(measured(design, options.workers)))
        return
    common = ["--steps", options.steps, "--workers", options.workers]
    jobs = [[*common, "--sizes", yarns] for yarns in options.sizes]
    jobs += [[*common, design, "--sizes"] for design in options.designs]
    publish(options, [table([in_own_process(job) for job in jobs])])


if __name__ == "__main__":
    main()
