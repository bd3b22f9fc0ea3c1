"""The solver of the tangent that needs no extra: Cholesky by dense fronts, of the node pairs that are coupled."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from circuittex.base.arrays import Floats
from circuittex.mech.coupled import Coupled
from circuittex.mech.pattern import DOFS, Pattern
from circuittex.solvers.cholesky import Cholesky, Solve
from circuittex.solvers.fronts import Analysis, Blocks, Entries, analyse

POSITION = 3
"""Unknowns of a node's position; the others are its directors'."""


class MultifrontalSolver:
    """Cholesky by dense fronts, which are kept until the pattern changes or node pairs come to be coupled.

    The pattern has room for all fibrils that may touch. Those that do not have zeros there, which are left out.

    >>> from circuittex.mech.pattern import build_pattern, diagonal
    >>> pattern = build_pattern(2, np.array([[0, 1]]), np.empty((0, 2), dtype=int))
    >>> twice = np.zeros(pattern.nnz)
    >>> twice[diagonal(pattern)] = 2.0
    >>> MultifrontalSolver().factor(pattern, twice)(np.ones(18))[:3].round(15)
    array([0.5, 0.5, 0.5])
    """

    name = "multifrontal"

    def __init__(self) -> None:
        self._coupled = Coupled()
        self._analysis: Analysis | None = None
        self._cholesky: Cholesky | None = None

    def factor(self, pattern: Pattern, data: Floats, *, rough: bool = False) -> Solve | None:
        """A function that solves with the matrix (until the next call), or None if a pivot is not positive.

        In single precision where `rough` solutions will do.
        """
        if self._coupled.renew(pattern, data):
            self._analysis = analysed(pattern, self._coupled, self._analysis)
        last = self._cholesky
        assert self._analysis is not None, "no pairs were renewed"
        if last is None or last.analysis is not self._analysis or last.single != rough:
            self._cholesky = Cholesky(self._analysis, last, single=rough)
        assert self._cholesky is not None
        values = [data[self._coupled.entries]]
        del data  # a tenth of the memory at its peak, where the caller does not keep it
        return self._cholesky.factor(values.pop())

    def forget(self) -> None:
        """The next matrix is analysed as by a new solver; the memory of the factor stays."""
        self._coupled, self._analysis = Coupled(), None


def analysed(pattern: Pattern, coupled: Coupled, last: Analysis | None = None) -> Analysis:
    """The fronts of a matrix with this pattern and these couplings; see `analyse`."""
    entries = Entries(pattern.indptr, pattern.indices, coupled.entries)
    return analyse(blocks(pattern, coupled.pairs), entries, last)


def blocks(pattern: Pattern, coupled: NDArray[np.bool_]) -> Blocks:
    """The blocks of a pattern of nodes: block 2 a is the position of node a, block 2 a + 1 its directors.

    `coupled` tells of each pair of the pattern whether it counts.
    """
    n = pattern.n_dofs // DOFS
    node = np.arange(n)
    a, b = np.repeat(node, np.diff(pattern.neighbour_start))[coupled], pattern.neighbour[coupled]
    full = pattern.full_offset[coupled] >= 0
    c, d = a[full], b[full]
    i = np.concatenate([2 * node, 2 * a, 2 * c, 2 * c + 1, 2 * c + 1])
    j = np.concatenate([2 * node + 1, 2 * b, 2 * d + 1, 2 * d, 2 * d + 1])
    ends = np.concatenate([i, j]), np.concatenate([j, i])
    return Blocks(
        graph=sp.csr_array((np.ones(2 * len(i)), ends), shape=(2 * n, 2 * n)),
        first=(DOFS * node[:, None] + np.array([0, POSITION])).ravel(),
        width=np.tile([POSITION, DOFS - POSITION], n),
        position=pattern.position.repeat(2, axis=0),
    )
