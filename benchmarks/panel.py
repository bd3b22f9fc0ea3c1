"""Panels of many cells: direct and multigrid solution beside the time of writing the same resistors as a netlist.

    python benchmarks/panel.py [--sizes 60 183 577] [--electrodes 2 16] [--Rc 300 3] [--most 1200000]

Panels of n x n crossings, Ry = 0.28 ohm, fed from their left to their right edge, with a slanting cut that sends the
current through the crossings; and the same fed through 16 electrodes. Each case runs in a process of its own, which
tells its peak memory. 'own' is circuittex's Cholesky, 'CHOLMOD' that of scikit-sparse where it is installed, 'SuperLU'
SciPy's by minimum degree as panels use it, 'multigrid' pyamg's as panels use it. Seconds are those of
the processor, for assembly, factorisation or set-up, and all solutions, all with a relative residual below 1e-10;
writing is that of the panel's sub-circuit as text.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from measure import Table, arguments, fail, publish

from circuittex.netlist import subcircuit
from circuittex.solvers import laplacian
from circuittex.solvers.cholesky import factorise
from circuittex.study.panel.cells import CellResistances
from circuittex.study.panel.circuit import panel_circuit
from circuittex.study.panel.statement import Cut, Electrode, Panel
from circuittex.study.panel.wiring import wire

HEAD = ["Rc, ohm", "resistors", "electrodes", "method", "seconds", "writing, s", "solving / writing", "residual", "MB"]
METHODS = ("own", *["CHOLMOD"] * (find_spec("sksparse") is not None), "SuperLU", "multigrid")
WRITTEN = 2_000_000
"""Resistors beyond which the time of writing is extrapolated in proportion: text and names of 10 million take 8 GB."""


def panel(n: int, electrodes: int, Rc: float) -> Panel:
    """n x n crossings between edges, or between equal groups of yarn ends on all four sides."""
    if electrodes == 2:
        ends = (Electrode("left", edge="left"), Electrode("right", edge="right"))
    else:
        side, group = electrodes // 4, n // (electrodes // 4)
        ends = tuple(
            Electrode(f"e{way}{'mp'[sign == '+']}{k}", ends=(f"{way}{k * group + 1}..{(k + 1) * group}{sign}",))
            for way in ("warp", "weft")
            for sign in "-+"
            for k in range(side)
        )
    cut = Cut(line=((0.3 * n, 0.1 * n), (0.6 * n, 0.9 * n)))
    return Panel((n, n), CellResistances(0.28, 0.28, Rc), ends, cuts=(cut,))


def own(matrix: Any) -> Callable[[Any], Any]:
    """circuittex's Cholesky as a solver of several right sides."""
    solve = factorise(matrix)
    assert solve is not None
    return lambda right: np.stack([solve(column) for column in right.T], axis=1)


def cholmod(matrix: Any) -> Callable[[Any], Any]:
    """CHOLMOD with its own choice of order and of fronts."""
    from sksparse.cholmod import cholesky

    factor = cholesky(matrix.tocsc())
    return lambda right: factor(right)


def case(n: int, electrodes: int, Rc: float, method: str) -> dict[str, float]:
    """Seconds, residual and peak memory of one solution."""
    wiring = wire(panel(n, electrodes, Rc))
    if method == "own":
        factorise(laplacian._matrix(*_chain()))  # compiled before the clock starts
    laplacian._direct = {"own": own, "CHOLMOD": cholmod}.get(method, laplacian._direct)
    how = "multigrid" if method == "multigrid" else "direct"
    clock = time.process_time()
    found = laplacian.responses(wiring.ends, 1.0 / wiring.resistance, wiring.n_nodes, electrodes, how)
    seconds = time.process_time() - clock
    if found.method != how:
        fail(f"{method} did not converge at {n} x {n}")
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {"resistors": len(wiring.resistance), "seconds": seconds, "residual": found.residual, "memory": memory}


def _chain() -> tuple[Any, Any, int, int]:
    ends = np.array([[0, 2, 3], [2, 3, 1]], dtype=np.int32)
    return ends, np.ones(3), 4, 2


def apart(n: int, electrodes: int, Rc: float, method: str) -> dict[str, float]:
    """`case` in a process of its own."""
    code = f"import json, panel; print(json.dumps(panel.case({n}, {electrodes}, {Rc!r}, {method!r})))"
    folder = str(__file__).rpartition("/")[0] or "."
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)
    if done.returncode:
        fail(done.stderr.strip().splitlines()[-1])
    found: dict[str, float] = json.loads(done.stdout)
    return found


def writing(n: int, Rc: float) -> tuple[float, bool]:
    """Seconds per resistor of writing a panel's sub-circuit, and whether a smaller panel stands for it."""
    smaller = 3 * n * n > WRITTEN
    wiring = wire(panel(577 if smaller else n, 2, Rc))
    clock = time.process_time()
    subcircuit(panel_circuit(wiring), "panel")
    return (time.process_time() - clock) / len(wiring.resistance), smaller


def rows(n: int, electrodes: int, Rc: float, most: int) -> list[list[object]]:
    """Rows of the table for one panel; factorisations up to `most` unknowns."""
    each, smaller = writing(n, Rc)
    found = []
    for method in METHODS:
        if method != "multigrid" and 2 * n * n > most:
            continue
        result = apart(n, electrodes, Rc, method)
        written = each * result["resistors"]
        number = f"{'~ ' * smaller}{written:.3g}"
        found.append(
            [
                *[f"{Rc:g}", int(result["resistors"]), electrodes, method, result["seconds"], number],
                *[result["seconds"] / written, result["residual"], result["memory"]],
            ]
        )
    return found


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[60, 183, 577])
    parser.add_argument("--electrodes", type=int, nargs="+", default=[2, 16])
    parser.add_argument("--Rc", type=float, nargs="+", default=[300.0, 3.0])
    parser.add_argument("--most", type=int, default=1_200_000, help="unknowns of a factorisation at most")
    options = parser.parse_args()
    table = [
        row
        for n in options.sizes
        for electrodes in options.electrodes
        for Rc in options.Rc
        for row in rows(n, electrodes, Rc, options.most)
    ]
    publish(options, [Table("Assembly, set-up and all solutions of a panel:", HEAD, table)])


if __name__ == "__main__":
    main()
