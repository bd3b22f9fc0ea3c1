"""What a first relaxation takes with the descent by gradients before Newton's method, and with Newton's alone.

    python benchmarks/size.py [--yarns 2 4 8] [--filaments 10] [--per-crossing 5] [--only with|without]

Each cell of N x N yarns is relaxed from the initial weave in processes of its own, so that its peak memory is its own.
Seconds are the processor's, of all threads: other work on the machine changes them little. "With" has the descent
whatever the size, "without" never; `relax` chooses by `WORTH_A_DESCENT`. The exponents compare a row with the one
before it of the same kind, against the unknowns. Takes minutes, with 16 x 16 yarns an hour.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from measure import Table, arguments, publish
from scaling import peak_memory, warm_up

from circuittex.base.arrays import Floats
from circuittex.contact import penalty
from circuittex.design import Design, plain_weave
from circuittex.geometry.weave import build_mesh
from circuittex.mech.linear import LinearSolver, Solve
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pattern import Pattern
from circuittex.relaxation import relax as relaxation

Result = dict[str, Any]
WAYS = ("without", "with")
ROWS = {3: (1, 2), 10: (3, 4, 3), 19: (3, 4, 5, 4, 3), 37: (4, 5, 6, 7, 6, 5, 4)}
"""Rows of yarns of so many filaments."""
HEAD = ["descent", "yarns", "filaments", "unknowns", "iterations by gradients", "of Newton", "factorisations"]
HEAD += ["contact searches", "processor s", "energy N mm", "residual N", "peak MB", "exponent of s", "of memory"]
KEYS = "way", "yarns", "filaments", "unknowns", "cheap", "newton", "factors", "searches", "seconds", "energy"
KEYS += ("residual", "memory")


@dataclass
class Counted:
    """A solver that counts its factorisations, those refused included."""

    solver: LinearSolver
    name: str = "counted"
    calls: int = 0

    def factor(self, pattern: Pattern, data: Floats) -> Solve | None:
        self.calls += 1
        return self.solver.factor(pattern, data)


def cell(yarns: int, filaments: int, per_crossing: int) -> Design:
    """The design of one size."""
    base = plain_weave(yarns=yarns, rows=ROWS[filaments])
    return replace(base, numerics=replace(base.numerics, elements=per_crossing * yarns))


def measured(way: str, yarns: int, filaments: int, per_crossing: int) -> Result:
    """What one relaxation in this process takes."""
    design, solver, searches = cell(yarns, filaments, per_crossing), Counted(MultifrontalSolver()), [0]
    mesh, search = build_mesh(design), penalty.find_candidates

    def counted(*of: Any) -> Any:
        searches[0] += 1
        return search(*of)

    before = relaxation.WORTH_A_DESCENT
    vars(penalty)["find_candidates"] = counted
    vars(relaxation)["WORTH_A_DESCENT"] = 0 if way == "with" else sys.maxsize
    clock = time.process_time()
    try:
        found = relaxation.relax(mesh, design, solver=solver)
    finally:
        vars(penalty)["find_candidates"] = search
        vars(relaxation)["WORTH_A_DESCENT"] = before
    seconds, newton = time.process_time() - clock, len(found.history) - 1
    return {
        "way": way,
        "yarns": yarns,
        "filaments": filaments,
        "unknowns": found.configuration.x.size,
        "cheap": found.iterations - newton,
        "newton": newton,
        "factors": solver.calls,
        "searches": searches[0],
        "seconds": seconds,
        "energy": found.energy,
        "residual": found.residual,
        "memory": peak_memory(),
    }


def in_own_process(way: str, yarns: int, filaments: int, per_crossing: int) -> Result:
    """`measured` in a process of its own."""
    words = [way, yarns, filaments, per_crossing]
    command = [sys.executable, __file__, "--one", *map(str, words)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    result: Result = json.loads(done.stdout)
    return result


def table(results: Sequence[Result]) -> Table:
    """Sizes and costs, with the exponents from one size to the next."""
    rows: list[list[object]] = []
    for k, result in enumerate(results):
        last = results[k - 1] if k and results[k - 1]["way"] == result["way"] else None
        powers = [exponent(last, result, cost) if last else "" for cost in ("seconds", "memory")]
        rows.append([*(result[key] for key in KEYS), *powers])
    return Table("First relaxations from the initial weave; exponents of cost against unknowns:", HEAD, rows)


def exponent(small: Result, large: Result, cost: str) -> float:
    """p where the cost grows like unknowns^p."""
    return float(np.log(large[cost] / small[cost]) / np.log(large["unknowns"] / small["unknowns"]))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--yarns", type=int, nargs="+", default=[2, 4, 8], help="yarns each way")
    parser.add_argument("--filaments", type=int, nargs="+", default=[10], choices=sorted(ROWS), help="of a yarn")
    parser.add_argument("--per-crossing", type=int, default=5, help="elements of a fibril from crossing to crossing")
    parser.add_argument("--only", choices=WAYS, help="one of the two")
    parser.add_argument("--one", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        warm_up()
        print(json.dumps(measured(options.one[0], *map(int, options.one[1:]))))
        return
    ways = [options.only] if options.only else WAYS
    sizes = [(n, m) for m in options.filaments for n in options.yarns]
    publish(options, [table([in_own_process(way, n, m, options.per_crossing) for way in ways for n, m in sizes])])


if __name__ == "__main__":
    main()
