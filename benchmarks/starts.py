"""What a first relaxation takes from each start, and where it ends.

    python benchmarks/starts.py [--weave plain|twill] [--yarns 4 8] [--filaments 10] [--per-crossing 5]
    python benchmarks/starts.py --similar [--yarns 2]

The first compares the initial weave with copies of the relaxed smallest cell (`circuittex.relaxation.starts`), whose
own relaxation counts. The second relaxes cells with a modulus, a penalty and a radius a tenth larger or twice as large
from the initial weave and from the state of the cell without the change. Every relaxation has a process of its own;
seconds are the processor's, of all threads. Takes a minute or two, with 16 x 16 yarns half an hour.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from measure import Table, arguments, publish
from scaling import peak_memory, warm_up
from size import cell

from circuittex.design import Design
from circuittex.geometry.weave import build_mesh
from circuittex.relaxation.relax import relax
from circuittex.relaxation.starts import from_state, repeat, tiled

Result = dict[str, Any]
WEAVES = ("plain", "twill")
STARTS = ("initial", "tiled")
CHANGES = {"modulus": (1.1, 2.0), "penalty": (1.1, 2.0, 10.0), "radius": (1.05, 1.1)}
"""Factors of what is changed; fibrils keep their places."""
KEYS = ("start", "yarns", "filaments", "unknowns", "cheap", "newton", "seconds", "energy", "residual", "memory")
HEAD = ["start", "yarns", "filaments", "unknowns", "iterations by gradients", "of Newton", "processor s"]
HEAD += ["energy N mm", "residual N", "peak MB"]


def woven(weave: str, yarns: int, filaments: int, per_crossing: int) -> Design:
    """The plain weave of that size, or a 2/2 twill of the same yarns."""
    design = cell(yarns, filaments, per_crossing)
    if weave == "plain":
        return design
    draft = tuple(tuple(int((i + j) % 4 < 2) for j in range(yarns)) for i in range(yarns))
    return replace(design, weave=replace(design.weave, draft=draft))


def measured(weave: str, start: str, yarns: int, filaments: int, per_crossing: int) -> Result:
    """What one relaxation in this process takes, with what its start took."""
    design = woven(weave, yarns, filaments, per_crossing)
    mesh = build_mesh(design)
    name, clock = start, time.process_time()
    begin = None
    if start == "tiled":
        begin = tiled(mesh, design)
        name = "tiled, from {} x {}".format(*repeat(design.weave))
    return {"start": name, "yarns": yarns, "filaments": filaments} | taken(design, mesh, begin, clock)


def taken(design: Design, mesh: Any, begin: Any, clock: float) -> Result:
    """What the relaxation from a configuration takes, since `clock`."""
    found = relax(mesh, design, begin)
    newton = len(found.history) - 1
    return {
        "unknowns": found.configuration.x.size,
        "cheap": found.iterations - newton,
        "newton": newton,
        "seconds": time.process_time() - clock,
        "energy": f"{found.energy:.5g}",
        "residual": found.residual,
        "memory": peak_memory(),
    }


def changed(design: Design, what: str, factor: float) -> Design:
    """The design with one of its properties larger."""
    if what == "penalty":
        return replace(design, contact=replace(design.contact, penalty=factor * float(design.contact.penalty)))
    kind = design.weave.warp[0]
    if what == "radius":
        other = replace(kind, radius=factor * kind.radius, spacing=factor * kind.spacing)
        other = replace(other, row_spacing=factor * kind.row_spacing)
    else:
        fibrils = tuple(replace(each, youngs_modulus=factor * each.youngs_modulus) for each in kind.materials)
        other = replace(kind, materials=fibrils)
    weave = design.weave
    return replace(design, weave=replace(weave, warp=(other,) * len(weave.warp), weft=(other,) * len(weave.weft)))


def similar(yarns: int, filaments: int, per_crossing: int) -> Table:
    """Relaxations of changed cells from the initial weave and from the state of the cell without the change."""
    design = cell(yarns, filaments, per_crossing)
    mesh = build_mesh(design)
    state = relax(mesh, design).configuration
    rows: list[list[object]] = []
    for what, factors in CHANGES.items():
        for factor in factors:
            other = changed(design, what, factor)
            there = build_mesh(other)
            for start in ("initial", "state"):
                clock = time.process_time()
                begin = from_state(there, other, state, mesh) if start == "state" else None
                found = taken(other, there, begin, clock)
                rows.append([f"{factor:g} x {what}", start, *(found[key] for key in KEYS[4:9])])
    return Table(
        f"Cells of {yarns} x {yarns} yarns, something of which is changed, from the initial weave and from the state "
        "without the change:",
        ["change", "start", *HEAD[4:9]],
        rows,
    )


def in_own_process(*words: object) -> Result:
    """`measured` in a process of its own."""
    command = [sys.executable, __file__, "--one", *map(str, words)]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    result: Result = json.loads(done.stdout)
    return result


def table(weave: str, results: Sequence[Result]) -> Table:
    """One row for each relaxation."""
    rows = [[result[key] for key in KEYS] for result in results]
    return Table(
        f"First relaxations of a {weave} weave from different starts, that of a smaller cell counted:", HEAD, rows
    )


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--weave", choices=WEAVES, default="plain", help="1/1 or a 2/2 twill")
    parser.add_argument("--yarns", type=int, nargs="+", help="yarns each way (default: 4 8, with --similar 2)")
    parser.add_argument("--filaments", type=int, default=10, choices=(3, 10), help="of a yarn")
    parser.add_argument("--per-crossing", type=int, default=5, help="elements of a fibril from crossing to crossing")
    parser.add_argument("--only", choices=STARTS, help="one of the two")
    parser.add_argument("--similar", action="store_true", help="states of similar designs instead")
    parser.add_argument("--one", nargs=5, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        warm_up()
        print(json.dumps(measured(*options.one[:2], *map(int, options.one[2:]))))
        return
    size = options.filaments, options.per_crossing
    if options.similar:
        warm_up()
        publish(options, [similar(yarns, *size) for yarns in options.yarns or [2]])
        return
    starts = [options.only] if options.only else STARTS
    results = [in_own_process(options.weave, start, n, *size) for n in options.yarns or [4, 8] for start in starts]
    publish(options, [table(options.weave, results)])


if __name__ == "__main__":
    main()
