"""Sparse symmetric systems of resistor networks: circuittex's own Cholesky against SciPy's SuperLU with COLAMD.

    python benchmarks/cholesky.py [--panels 50 180 400 707]

Detailed circuits of the paper's cell, merged and at full resolution, and panels of n x n crossings: a node on the warp
and one on the weft yarn, arms of 0.28 ohm to the neighbours, 300 ohm between the two. Either solves the same matrix,
the analysis of its structure included, to the residuals in the table.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import scipy.sparse as sp
from measure import Table, arguments, publish
from scipy.sparse.linalg import splu
from woven import woven_circuit

from circuittex.base.arrays import Floats
from circuittex.electrical.network.circuit import Circuit
from circuittex.solvers.cholesky import factorise

HEAD = ["network", "unknowns", "resistors", "own, s", "SuperLU, s", "own / SuperLU", "own residual", "SuperLU residual"]
ARM, CROSSING = 0.28, 300.0
"""ohm"""


def laplacian(n: int, i: Any, j: Any, conductance: Any, grounded: Any) -> sp.csr_array:
    """The nodal matrix, with 1 S from each grounded node to ground."""
    ends = np.concatenate([i, j]), np.concatenate([j, i])
    off = sp.coo_array((np.tile(-np.asarray(conductance), 2), ends), shape=(n, n)).tocsr()
    diagonal = -off.sum(axis=1)
    diagonal[grounded] += 1.0
    return sp.csr_array(off + sp.diags_array(diagonal))


def of_circuit(circuit: Circuit) -> sp.csr_array:
    i, j = circuit.resistor_nodes.T
    return laplacian(circuit.n_nodes, i, j, 1.0 / circuit.resistance, circuit.port_node)


def of_panel(n: int) -> sp.csr_array:
    warp = np.arange(n * n).reshape(n, n)
    weft = warp + n * n
    i = np.concatenate([warp[:, :-1].ravel(), weft[:-1].ravel(), warp.ravel()])
    j = np.concatenate([warp[:, 1:].ravel(), weft[1:].ravel(), weft.ravel()])
    conductance = np.repeat([1.0 / ARM, 1.0 / CROSSING], [2 * n * (n - 1), n * n])
    return laplacian(2 * n * n, i, j, conductance, [0])


def timed(function: Callable[[], Callable[[Floats], Floats] | None], b: Floats) -> tuple[float, Floats]:
    clock = time.perf_counter()
    solve = function()
    assert solve is not None
    x = solve(b)
    return time.perf_counter() - clock, x


def compare(name: str, matrix: sp.csr_array) -> list[object]:
    """One row of the table."""
    b = np.random.default_rng(0).normal(size=matrix.shape[0])
    own, x = timed(lambda: factorise(matrix), b)
    superlu, y = timed(lambda: splu(matrix.tocsc()).solve, b)
    residuals = [float(np.abs(matrix @ each - b).max()) for each in (x, y)]
    resistors = (matrix.nnz - matrix.shape[0]) // 2
    return [name, matrix.shape[0], resistors, own, superlu, own / superlu, *residuals]


def rows(panels: list[int]) -> Iterator[list[object]]:
    factorise(of_panel(4))  # compiled before anything is timed
    for yarns, merge in ((4, 1.0), (4, 0.0)):
        circuit = woven_circuit(yarns, merge)
        yield compare(f"cell of {yarns} x {yarns} yarns, merged within {merge:g} mm", of_circuit(circuit))
    for n in panels:
        yield compare(f"panel of {n} x {n} crossings", of_panel(n))


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--panels", type=int, nargs="+", default=[50, 180, 400, 707])
    options = parser.parse_args()
    publish(options, [Table("Analysis, factorisation and one solution:", HEAD, list(rows(options.panels)))])


if __name__ == "__main__":
    main()
