"""Potentials on large weighted graphs some of whose nodes are held: direct where that fits, multigrid beyond.

The equations of a graph's Laplacian are symmetric, positive definite, and nothing beside their diagonal is positive. Up
to some ten thousand unknowns, and for many right sides, one factorisation is fastest. Beyond, conjugate gradients with
the classical algebraic multigrid of Ruge and Stuben (pyamg) need work and memory in proportion to the unknowns.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import cg, splu

from circuittex.base.arrays import Floats
from circuittex.base.errors import CircuitError
from circuittex.base.frozen import frozen

METHODS = ("auto", "direct", "multigrid")
TOLERANCE = 1e-10
"""Largest relative residual of a column that is taken for a solution."""
_AIM = 1e-12
"""What conjugate gradients are asked for, and where corrections end."""
_ITERATIONS = 500
_ROUNDS = 6
"""Corrections at most; one is usual."""
_FEW, _SMALL = 2, 100_000
"""Up to this many columns multigrid is faster from this many unknowns on (benchmarks/panel.py)."""
LARGEST_DIRECT = 3_000_000
"""Unknowns of a factorisation at most: for 64 columns it takes some 6 GB and 80 s, multigrid 8 s each."""
_BLOCK = 8
"""Columns that are solved at once, for memory's sake."""
_COARSE = 2000
"""Unknowns of the coarsest level, which is factorised."""
_DENSE = 20
"""Entries of a row up to which levels are coarsened as Ruge and Stuben do, beyond by aggregation: chains that hang
together weakly get ever denser levels, which took half an hour for a panel of 1e7 resistors and had not ended."""

Ends = NDArray[np.int32]
Solve = Callable[[Floats], Floats]


@frozen
class Responses:
    """Potentials of all nodes while each held node in turn is at one and the other held ones are at zero."""

    values: Floats
    """(K, P) potential of each node for each held one; they add up to one at every node."""
    method: str
    """'direct' or 'multigrid'."""
    residual: float
    """largest of what is left over at the free nodes, over what the held ones feed them, by columns [1]."""


def responses(ends: Ends, weight: Floats, nodes: int, held: int, method: str = "auto") -> Responses:
    """Potentials (K, P) on a graph with edges `ends` (2, R) of `weight` (R,) whose first P = `held` nodes are held.

    At every free node the flows weight (phi_a - phi_b) add up to zero. Between nodes that a large weight joins, the
    difference is far smaller than the potentials: so a potential is kept as a first part, whose differences are exact
    there, and a small rest, found from what the flows along the edges leave over.

    >>> chain = np.array([[0, 2, 3], [2, 3, 1]], dtype=np.int32)
    >>> responses(chain, np.ones(3), 4, 2).values[:, 0].round(12).tolist()
    [1.0, 0.0, 0.666666666667, 0.333333333333]

    Every node must be joined to a held one. Raises `CircuitError` where the system is too large for what is installed,
    or no way leads to a relative residual of 1e-10.
    """
    values = np.zeros((nodes, held))
    values[:held] = np.eye(held)
    free, columns = nodes - held, held - 1
    if free and columns:
        method = _choice(free, columns) if method == "auto" else method
        residual = _solved(ends, weight, values, held, method)
        if not residual <= TOLERANCE and method == "multigrid" and free <= LARGEST_DIRECT:
            method, residual = "direct", _solved(ends, weight, values, held, "direct")
        if not residual <= TOLERANCE:
            raise CircuitError(
                f"the equations of {free} unknowns are solved to a relative residual of {residual:.1e} only, not to "
                f"{TOLERANCE:g}: conductances from {weight.min():.1e} to {weight.max():.1e} S are too far apart"
            )
    else:
        method, residual = "direct", 0.0
    if free:
        values[held:, -1] = 1.0 - values[held:, :-1].sum(axis=1)
    return Responses(values, method, residual)


def _choice(free: int, columns: int) -> str:
    """The method for so many unknowns and right sides."""
    if (columns <= _FEW and free > _SMALL and _has_multigrid()) or free > LARGEST_DIRECT:
        return "multigrid"
    return "direct"


def _has_multigrid() -> bool:
    return find_spec("pyamg") is not None


def _solved(ends: Ends, weight: Floats, values: Floats, held: int, method: str) -> float:
    """Fill in the potentials of the free nodes, all columns but the last; returns the relative residual."""
    matrix = _matrix(ends, weight, len(values), held)
    solve = _direct(matrix) if method == "direct" else _multigrid(matrix)
    worst = 0.0
    for start in range(0, values.shape[1] - 1, _BLOCK):
        stop = min(start + _BLOCK, values.shape[1] - 1)
        block = values[:, start:stop].copy()
        block[held:] = 0.0
        block, residual = _refined(ends, weight, block, held, solve)
        values[held:, start:stop] = block[held:]
        worst = max(worst, residual)
    return worst


def _refined(ends: Ends, weight: Floats, first: Floats, held: int, solve: Solve) -> tuple[Floats, float]:
    """Potentials (K, c) from those of the held nodes, and the largest relative residual of a column."""
    left = _left_over(ends, weight, first, held)
    size = np.linalg.norm(left, axis=0)
    size[size == 0.0] = 1.0
    first[held:] = -solve(left)
    rest, best, found = np.zeros_like(first), np.inf, first
    base = _left_over(ends, weight, first, held)
    for _ in range(_ROUNDS):
        left = base + _left_over(ends, weight, rest, held)
        worst = float((np.linalg.norm(left, axis=0) / size).max())
        if not worst < best:
            break
        best, found = worst, first + rest
        if best <= _AIM:
            break
        rest[held:] -= solve(left)
    return found, best


def _left_over(ends: Ends, weight: Floats, potential: Floats, held: int) -> Floats:
    """(K - P, c) what flows out of each free node."""
    found = np.empty((len(potential) - held, potential.shape[1]))
    for k, column in enumerate(potential.T):
        flow = weight * (column[ends[0]] - column[ends[1]])
        out = np.bincount(ends[0], flow, len(potential)) - np.bincount(ends[1], flow, len(potential))
        found[:, k] = out[held:]
    return found


def _matrix(ends: Ends, weight: Floats, nodes: int, held: int) -> sp.csr_array:
    """(K - P, K - P) Laplacian of the free nodes."""
    free = nodes - held
    diagonal = (np.bincount(ends[0], weight, nodes) + np.bincount(ends[1], weight, nodes))[held:]
    inner = (ends >= held).all(axis=0)
    a, b = ends[:, inner] - np.int32(held)
    own = np.arange(free, dtype=np.int32)
    entries = np.concatenate([-weight[inner], -weight[inner], diagonal])
    where = np.concatenate([a, b, own]), np.concatenate([b, a, own])
    return sp.coo_array((entries, where), shape=(free, free)).tocsr()


def _direct(matrix: sp.csr_array) -> Solve:
    # Minimum degree, and no pivots off the diagonal: right for such a matrix. What they lose the corrections find.
    try:
        factor = splu(
            matrix.tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except (RuntimeError, MemoryError) as error:
        raise CircuitError(f"the equations of {matrix.shape[0]} unknowns cannot be factorised: {error}") from None

    def solve(right: Floats) -> Floats:
        return np.asarray(factor.solve(np.ascontiguousarray(right)))

    return solve


def _multigrid(matrix: sp.csr_array) -> Solve:
    if not _has_multigrid():
        raise CircuitError(
            f"multigrid for {matrix.shape[0]} unknowns needs the extra: pip install 'circuittex[panel]'; without it "
            f"there may be {LARGEST_DIRECT} at most"
        )
    from pyamg import ruge_stuben_solver, smoothed_aggregation_solver
    from pyamg.multilevel import MultilevelSolver
    from pyamg.relaxation.smoothing import change_smoothers

    plain = sp.csr_matrix((matrix.data, matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32)), matrix.shape)
    levels, coarse = [], plain
    while coarse.shape[0] > _COARSE and coarse.nnz < _DENSE * coarse.shape[0]:
        two = ruge_stuben_solver(coarse, max_levels=2, max_coarse=1, coarse_solver="splu").levels
        if len(two) < 2:
            break
        levels.append(two[0])
        coarse = sp.csr_matrix(two[1].A)
    levels += smoothed_aggregation_solver(coarse, max_coarse=_COARSE, coarse_solver="splu").levels
    cycle = MultilevelSolver(levels, coarse_solver="splu")
    smoother = ("gauss_seidel", {"sweep": "symmetric"})
    change_smoothers(cycle, smoother, smoother)
    preconditioner = cycle.aspreconditioner(cycle="V")

    def solve(right: Floats) -> Floats:
        found = np.empty_like(right)
        for k in range(right.shape[1]):
            found[:, k], _ = cg(plain, right[:, k], rtol=_AIM, atol=0.0, maxiter=_ITERATIONS, M=preconditioner)
        return found

    return solve
