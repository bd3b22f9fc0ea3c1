"""Time and memory of one relaxation against the size of the weave, with the share of each part.

    python benchmarks/scaling.py [--sizes 2 4 8 16] [--iterations 0] [--per-crossing 5] [--keep FILE]

Each weave of N x N yarns of ten fibrils is relaxed in a process of its own, so that its peak memory is its own. Every
weave has the paper's number of elements a crossing, so a fibril of the 16 x 16 weave has four times as many elements as
one of the paper's cell: 320 fibrils with the length of 1,280 of that cell, and the work is best counted in elements.
The exponents compare a size with the one before it in the table. With --iterations a relaxation is cut short; what is
comparable then is the time of an iteration, and the first ones are short. With --keep the sizes measured are added to a
file, whose other sizes complete the tables; that lets a large size run alone and later.
"""

from __future__ import annotations

import argparse
import json
import re
import resource
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from measure import Table, arguments, publish, seconds_of
from watch import PARTS, descend

from circuittex.design import Design, plain_weave
from circuittex.geometry.weave import build_mesh
from circuittex.mech.configuration import initial_configuration
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.relaxation.relax import force_terms, relax

Result = dict[str, Any]
TOLERANCE = 1e-6
"""Largest free force of a relaxed weave, N."""
HEAD = ["yarns", "fibrils", "elements", "unknowns", "contact points", "entries, millions", "iterations", "residual N"]
HEAD += ["s", "s an iteration", "peak MB", "exponent of s", "of s an iteration", "of memory"]


def weave(yarns: int, per_crossing: int) -> Design:
    """The design of one size."""
    base = plain_weave(yarns=yarns)
    return replace(base, numerics=replace(base.numerics, elements=per_crossing * yarns))


def measured(yarns: int, per_crossing: int, iterations: int) -> Result:
    """What one relaxation in this process takes."""
    warm_up()
    design = weave(yarns, per_crossing)
    mesh = build_mesh(design)
    terms = force_terms(mesh, design)
    start, solver = terms[0].vector(initial_configuration(mesh)), MultifrontalSolver()
    found: list[Any] = []
    limit = iterations or 10 * design.numerics.max_iterations
    seconds = seconds_of(lambda: found.extend(descend(terms, start, solver, limit, TOLERANCE)))
    q, watch, (pattern, _) = found
    total = float(watch.per_iteration(*PARTS).sum())
    return {
        "yarns": yarns,
        "fibrils": mesh.n_fibrils,
        "elements": len(mesh.elements),
        "unknowns": len(q),
        "contacts": len(terms[2].touching(q).overlap),
        "entries": pattern.nnz / 1e6,
        "iterations": len(watch.iterations),
        "residual": watch.residual,
        "seconds": seconds,
        "each": seconds / len(watch.iterations),
        "memory": peak_memory(),
        "solver": solver.name,
        "shares": {part: 100 * float(watch.per_iteration(part).sum()) / total for part in PARTS},
    }


def warm_up() -> None:
    """Load what is compiled."""
    design = plain_weave(yarns=1, rows=(1,))
    design = replace(design, numerics=replace(design.numerics, elements=4, tolerance=1e-3))
    relax(build_mesh(design), design)


def peak_memory() -> float:
    """Largest resident memory of this process so far, MB."""
    status = Path("/proc/self/status")  # getrusage would count the process that started this one
    found = re.search(r"VmHWM:\s*(\d+) kB", status.read_text()) if status.exists() else None
    if found:
        return int(found[1]) / 1e3
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)


def in_own_process(yarns: int, options: argparse.Namespace) -> Result:
    """`measured` in a process of its own."""
    words = ["--one", yarns, "--per-crossing", options.per_crossing, "--iterations", options.iterations]
    command = [sys.executable, __file__, *map(str, words)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    result: Result = json.loads(done.stdout)
    return result


def tables(results: Sequence[Result]) -> list[Table]:
    """Sizes and costs, and the shares of the parts."""
    keys = "yarns", "fibrils", "elements", "unknowns", "contacts", "entries", "iterations", "residual"
    rows: list[list[object]] = []
    for k, result in enumerate(results):
        costs = "seconds", "each", "memory"
        powers: list[object] = [exponent(results[k - 1], result, cost) if k else "" for cost in costs]
        if result["residual"] > TOLERANCE:  # cut short
            powers[0] = ""
        rows.append([*(result[key] for key in keys), *(result[cost] for cost in costs), *powers])
    shares = [[part, *(result["shares"][part] for result in results)] for part in PARTS]
    shares = [row for row in shares if any(row[1:])]
    names = [f"{result['yarns']} x {result['yarns']}" for result in results]
    solver = ", ".join(sorted({result["solver"] for result in results}))
    return [
        Table(f"One relaxation from the initial weave with {solver}; exponents of cost against elements:", HEAD, rows),
        Table("Share of each part, % of the time of all iterations:", ["part", *names], shares),
    ]


def exponent(small: Result, large: Result, cost: str) -> float:
    """p where the cost grows like elements^p."""
    return float(np.log(large[cost] / small[cost]) / np.log(large["elements"] / small["elements"]))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[2, 4, 8, 16], help="yarns each way")
    parser.add_argument("--iterations", type=int, default=0, help="stop after so many; 0 to go on to equilibrium")
    parser.add_argument("--per-crossing", type=int, default=5, help="elements of a fibril from crossing to crossing")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="file of results by size, read and added to")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(measured(options.one, options.per_crossing, options.iterations)))
        return
    kept: dict[str, Result] = {}
    for yarns in options.sizes:
        result = in_own_process(yarns, options)
        if options.keep is not None and options.keep.exists():
            kept |= json.loads(options.keep.read_text())
        kept[str(yarns)] = result
        if options.keep is not None:
            options.keep.parent.mkdir(parents=True, exist_ok=True)
            options.keep.write_text(json.dumps(kept, indent=1) + "\n")
    publish(options, tables([kept[key] for key in sorted(kept, key=int)]))


if __name__ == "__main__":
    main()
