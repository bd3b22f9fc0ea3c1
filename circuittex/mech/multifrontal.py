"""Cholesky's factorisation by dense fronts: the solver that needs no extra.

Each front of `circuittex.mech.fronts` holds the rows of the factor U, K = U^T U, that belong to its pivots: their
*triangle* (p, p), and their *border* (p, b). They come as rows of the matrix and of what the fronts below add to it.
What the elimination subtracts from the other unknowns of the border, the *update* (b, b), goes to the front above.
LAPACK does the dense work, on a single thread: so the result has the same bits on any number of threads.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg.blas import dsyrk, dtrsm, dtrsv
from scipy.linalg.lapack import dpotrf
from threadpoolctl import ThreadpoolController

from circuittex.compiled import compiled
from circuittex.geometry.mesh import Floats
from circuittex.mech.coupled import Coupled
from circuittex.mech.fronts import Analysis, Front, analyse
from circuittex.mech.pattern import Pattern


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
        self._libraries = ThreadpoolController()
        self._coupled = Coupled()
        self._analysis: Analysis | None = None
        self._values: Floats
        self._blocks: list[tuple[Front, Floats, Floats]]
        """Each front with the values of its triangle and its border."""

    def factor(self, pattern: Pattern, data: Floats) -> Callable[[Floats], Floats] | None:
        """A function that solves with the matrix (until the next call), or None if a pivot is not positive."""
        if self._coupled.renew(pattern, data):
            self._analysis = analyse(pattern, self._coupled.pairs, self._coupled.entries, self._analysis)
            self._values = np.empty(self._analysis.size)
            self._blocks = [
                (front, self._part(front.start, p, p), self._part(front.start + p * p, p, len(front.border)))
                for front in self._analysis.fronts
                for p in [front.pivots]
            ]
        assert self._analysis is not None, "no pairs were renewed"
        self._values[:] = 0.0
        self._values[self._analysis.target] = data[self._coupled.entries]
        with self._libraries.limit(limits=1, user_api="blas"):
            return self._solve if self._eliminate() else None

    def _part(self, start: int, rows: int, columns: int) -> Floats:
        return self._values[start : start + rows * columns].reshape(rows, columns)

    def _eliminate(self) -> bool:
        """Turn the rows of the matrix into rows of the factor; False where a pivot is not positive."""
        below: list[list[tuple[Front, Floats]]] = [[] for _ in self._blocks]
        for k, (front, triangle, border) in enumerate(self._blocks):
            update = np.zeros((border.shape[1], border.shape[1]))
            for part, values in below[k]:
                _add(values, part.places, part.runs, triangle, border, update)
            below[k].clear()  # gives the memory back
            # What is upper by rows is lower by columns, the order of LAPACK: the transposed views are changed in place.
            _, info = dpotrf(triangle.T, lower=1, clean=0, overwrite_a=1)
            if info != 0 or not triangle[-1, -1] > 0.0:  # what is not a number spreads to the last pivot
                return False
            if front.above >= 0:
                dtrsm(1.0, triangle.T, border.T, side=1, lower=1, trans_a=1, overwrite_b=1)
                dsyrk(-1.0, border.T, beta=1.0, c=update.T, lower=1, overwrite_c=1)
                below[front.above].append((front, update))
        return True

    def _solve(self, b: Floats) -> Floats:
        """The solution of U^T U x = b: forwards with U^T, backwards with U."""
        assert self._analysis is not None, "factor comes first"
        x = b[self._analysis.order]
        with self._libraries.limit(limits=1, user_api="blas"):
            for front, triangle, border in self._blocks:
                own = x[front.first : front.first + front.pivots]
                own[:] = dtrsv(triangle.T, own, lower=1)
                x[front.border] -= own @ border
            for front, triangle, border in reversed(self._blocks):
                own = x[front.first : front.first + front.pivots]
                own[:] = dtrsv(triangle.T, own - border @ x[front.border], lower=1, trans=1)
        solution = np.empty_like(x)
        solution[self._analysis.order] = x
        return solution


@compiled
def _add(values: Any, places: Any, runs: Any, triangle: Any, border: Any, update: Any) -> None:
    """Add the upper triangle of values (b, b) to the rows and columns `places` of a front, run after run."""
    p, first = triangle.shape[0], 0
    for i in range(places.shape[0]):
        if i == runs[first + 1]:
            first += 1
        for run in range(first, runs.shape[0] - 1):
            begin, end = max(i, runs[run]), runs[run + 1]
            at = places[begin]
            if places[i] >= p:
                into = update[places[i] - p, at - p : at - p + end - begin]
            elif at >= p:
                into = border[places[i], at - p : at - p + end - begin]
            else:
                into = triangle[places[i], at : at + end - begin]
            for m in range(end - begin):
                into[m] += values[i, begin + m]
