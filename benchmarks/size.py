"""What a first relaxation takes: by gradients before Newton's method, by Newton's alone, and from copies of a cell.

    python benchmarks/size.py [--yarns 2 4 8] [--filaments 10] [--per-crossing 5] [--ways with tiled] [--keep FILE]

Each cell of N x N yarns is relaxed from the initial weave in processes of its own, so that its peak memory is its own.
Seconds are the processor's, of all threads, which other work on the machine changes little, and those on the clock,
which say something where there is none. "With" has the descent
whatever the size, "without" never; `relax` chooses by `WORTH_A_DESCENT`. "Tiled" starts from copies of the relaxed
smallest cell, whose seconds count. Yarns of other than 3 or 10 filaments have the section of those of 10, in a
round outline, and Hertz's penalty. The exponents compare a row with the one before it of the same kind, against the
unknowns. With --keep the results are added to those in a file, which are all told, and drawn with --figure. Takes
minutes, with 16 x 16 yarns or 100 filaments more.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from measure import Table, arguments, publish
from scaling import peak_memory, warm_up

from circuittex.base.arrays import Floats
from circuittex.contact import penalty
from circuittex.design import Design, hexagonal_rows, plain_weave
from circuittex.design.contact import HERTZ
from circuittex.geometry.weave import build_mesh
from circuittex.mech.linear import LinearSolver, Solve
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pattern import Pattern
from circuittex.relaxation import relax as relaxation
from circuittex.relaxation.starts import tiled
from circuittex.results.plot.style import COLOURS, new_figure, style

Result = dict[str, Any]
WAYS = ("without", "with", "tiled")
ROWS = {3: (1, 2), 10: (3, 4, 3)}
"""Rows of yarns of so many filaments as thick as the paper's."""
HEAD = ["descent", "yarns", "filaments", "unknowns", "iterations by gradients", "of Newton", "factorisations"]
HEAD += [
    "contact searches",
    "processor s",
    "s on the clock",
    "energy N mm",
    "residual N",
    "peak MB",
    "exponent of s",
    "of memory",
]
KEYS = "way", "yarns", "filaments", "unknowns", "cheap", "newton", "factors", "searches", "seconds", "clock", "energy"
KEYS += ("residual", "memory")


@dataclass
class Counted:
    """A solver that counts its factorisations, those refused included."""

    solver: LinearSolver
    name: str = "counted"
    calls: int = 0

    def factor(self, pattern: Pattern, data: Floats, *, rough: bool = False) -> Solve | None:
        self.calls += 1
        return self.solver.factor(pattern, data, rough=rough)

    def forget(self) -> None:
        self.solver.forget()


def cell(yarns: int, filaments: int, per_crossing: int) -> Design:
    """The design of one size; fibrils of few yarns have as many elements as those of four."""
    if filaments in ROWS:
        base = plain_weave(yarns=yarns, rows=ROWS[filaments])
        return replace(base, numerics=replace(base.numerics, elements=per_crossing * yarns))
    base, rows = plain_weave(yarns=yarns), hexagonal_rows(filaments)
    thick, weave = base.weave.warp[0], base.weave
    R = thick.radius * sqrt(thick.n_fibrils / filaments)
    packed = {"rows": rows, "spacing": 2 * R, "row_spacing": sqrt(3) * R}
    kind = replace(thick, radius=R, materials=thick.materials[:1] * filaments, **packed)
    weave = replace(weave, warp=(kind,) * yarns, weft=(kind,) * yarns)
    numerics = replace(base.numerics, elements=per_crossing * max(4, yarns))
    return replace(base, weave=weave, contact=replace(base.contact, penalty=HERTZ), numerics=numerics)


def measured(way: str, yarns: int, filaments: int, per_crossing: int) -> Result:
    """What one relaxation in this process takes."""
    design, solver, searches = cell(yarns, filaments, per_crossing), Counted(MultifrontalSolver()), [0]
    mesh, search = build_mesh(design), penalty.find_candidates

    def counted(*of: Any) -> Any:
        searches[0] += 1
        return search(*of)

    before = relaxation.WORTH_A_DESCENT
    vars(penalty)["find_candidates"] = counted
    if way != "tiled":
        vars(relaxation)["WORTH_A_DESCENT"] = 0 if way == "with" else sys.maxsize
    clock, began = time.process_time(), time.perf_counter()
    try:
        start = tiled(mesh, design, solver=solver) if way == "tiled" else None
        found = relaxation.relax(mesh, design, start, solver=solver)
    finally:
        vars(penalty)["find_candidates"] = search
        vars(relaxation)["WORTH_A_DESCENT"] = before
    seconds, passed, newton = time.process_time() - clock, time.perf_counter() - began, len(found.history) - 1
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
        "clock": passed,
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
        rows.append([*(result.get(key, "") for key in KEYS), *powers])
    return Table("First relaxations from the initial weave; exponents of cost against unknowns:", HEAD, rows)


def growth(results: Sequence[Result]) -> Figure:
    """Seconds and memory against unknowns, of cells of more yarns and of yarns of more filaments."""
    with style():
        figure = new_figure(7.0, 3.2)
        for axes, cost, words in zip(figure.subplots(1, 2), ("seconds", "memory"), ("processor s", "MB"), strict=True):
            for colour, way in zip(COLOURS, WAYS, strict=False):
                for line, marker, more in (("-", "o", "yarns"), ("--", "s", "filaments")):
                    of = sorted(
                        (result["unknowns"], result[cost])
                        for result in results
                        if result["way"] == way
                        and (result["filaments"] == 10) == (more == "yarns")
                        and result["yarns"] > 1
                    )
                    if of:
                        axes.plot(
                            *zip(*of, strict=True), color=colour, ls=line, marker=marker, ms=4, label=f"{way}, {more}"
                        )
            axes.set(xscale="log", yscale="log", xlabel="unknowns", ylabel=words)
        axes.legend()
    return figure


def exponent(small: Result, large: Result, cost: str) -> float:
    """p where the cost grows like unknowns^p."""
    return float(np.log(large[cost] / small[cost]) / np.log(large["unknowns"] / small["unknowns"]))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument(
        "--yarns", type=int, nargs="*", default=[2, 4, 8], help="yarns each way; none: tell what is kept"
    )
    parser.add_argument("--filaments", type=int, nargs="+", default=[10], help="of a yarn")
    parser.add_argument("--per-crossing", type=int, default=5, help="elements of a fibril from crossing to crossing")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS[:2], help="what to compare")
    parser.add_argument("--keep", type=Path, metavar="FILE", help="file of results, read and added to")
    parser.add_argument("--figure", type=Path, metavar="FILE", help="draw what is kept")
    parser.add_argument("--one", nargs=4, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        warm_up()
        print(json.dumps(measured(options.one[0], *map(int, options.one[1:]))))
        return
    sizes = [(n, m) for m in options.filaments for n in options.yarns]
    found: dict[str, Result] = {}
    for way in options.ways:
        for yarns, filaments in sizes:
            result = in_own_process(way, yarns, filaments, options.per_crossing)
            if options.keep is not None and options.keep.exists():
                found |= json.loads(options.keep.read_text())
            found[f"{way} {yarns} x {filaments}"] = result
            if options.keep is not None:
                options.keep.parent.mkdir(parents=True, exist_ok=True)
                options.keep.write_text(json.dumps(found, indent=1) + "\n")
    if options.keep is not None and options.keep.exists():
        found |= json.loads(options.keep.read_text())
    several = sorted(
        found.values(), key=lambda result: (WAYS.index(result["way"]), result["filaments"], result["yarns"])
    )
    publish(options, [table(several)])
    if options.figure is not None:
        growth(several).savefig(options.figure)


if __name__ == "__main__":
    main()
