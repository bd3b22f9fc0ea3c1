"""Cholesky's factorisation of a sparse symmetric matrix by dense fronts.

Each front of `circuittex.solvers.fronts` holds the rows of the factor U, K = U^T U, that belong to its pivots: their
*triangle* (p, p), and their *border* (p, b). They come as rows of the matrix and of what the fronts below add to it.
What the elimination subtracts from the other unknowns of the border, the *update* (b, b), goes to the front above.
LAPACK does the dense work of a front on a single thread, and the updates are added in a fixed order: so the result has
the same bits on any number of threads, which share the fronts.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Lock
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.linalg.blas import dtrsv
from threadpoolctl import ThreadpoolController

from circuittex.base.arrays import Floats
from circuittex.base.compiled import compiled, cores
from circuittex.solvers.blas import cholesky, solve_border, subtract_products
from circuittex.solvers.fronts import Analysis, Blocks, Entries, analyse
from circuittex.solvers.levels import levels

Solve = Callable[[Floats], Floats]

SPARE = 1.25
"""Room for structures that grow a little, before new memory is asked for."""


def factorise(matrix: sp.sparray, position: Floats | None = None) -> Solve | None:
    """A function that solves with a symmetric matrix (n, n), or None if it is not positive definite.

    The upper triangle is read. `position` (n, 3) tells where the unknowns are, for the order of elimination; without it
    distances in the graph stand for places. See `Cholesky` for matrices that share their structure.

    >>> chain = sp.diags_array([[-1.0] * 2, [2.0] * 3, [-1.0] * 2], offsets=[-1, 0, 1])
    >>> factorise(chain)(np.array([1.0, 0.0, 0.0])).round(12)
    array([0.75, 0.5 , 0.25])
    """
    upper = sp.triu(matrix, format="csr")
    upper.sort_indices()
    n = upper.shape[0]
    graph = sp.csr_array(upper + upper.T)
    graph.setdiag(0.0)
    graph.eliminate_zeros()
    graph.data[:] = 1.0
    blocks = Blocks(graph, np.arange(n), np.ones(n, dtype=np.int64), levels(graph) if position is None else position)
    entries = Entries(upper.indptr.astype(np.int64), upper.indices.astype(np.int64), np.arange(upper.nnz))
    return Cholesky(analyse(blocks, entries)).factor(upper.data)


class Cholesky:
    """Cholesky's factorisation of matrices of one structure, whose `Analysis` tells the fronts.

    It takes the memory over from `last`, which is of no use then: fresh pages cost as much as half a factorisation.
    """

    def __init__(self, analysis: Analysis, last: Cholesky | None = None) -> None:
        self.analysis = analysis
        self._libraries: ThreadpoolController = ThreadpoolController() if last is None else last._libraries
        self._room: Floats = np.empty(0) if last is None else last._room
        if len(self._room) < analysis.size:
            self._room = np.empty(int(SPARE * analysis.size))
        self._values = self._room[: analysis.size]
        self._dense = [
            (front, self._view(front.start, p, p), self._view(front.start + p * p, p, len(front.border)))
            for front in analysis.fronts
            for p in [front.pivots]
        ]
        """Each front with the values of its triangle and its border."""

    def factor(self, values: Floats) -> Solve | None:
        """A function that solves with the matrix (until the next call), or None if a pivot is not positive.

        `values` are those of the used entries, in their order.
        """
        self._values[:] = 0.0
        self._values[self.analysis.target] = values
        with self._libraries.limit(limits=1, user_api="blas"):
            return self._solve if self._eliminate() else None

    def _view(self, start: int, rows: int, columns: int) -> Floats:
        return self._values[start : start + rows * columns].reshape(rows, columns)

    def _eliminate(self) -> bool:
        """Turn the rows of the matrix into rows of the factor; False where a pivot is not positive.

        Each thread takes subtrees of fronts. Who is the last to finish below a front goes on with that front.
        """
        subtrees, waiting = deque(self.analysis.subtrees), [len(front.below) for front, _, _ in self._dense]
        updates: dict[int, Floats] = {}
        lock = Lock()
        refused: list[int] = []

        def share() -> None:
            while not refused:
                try:
                    subtree = subtrees.popleft()
                except IndexError:
                    return
                climb(subtree)

        def climb(subtree: range) -> None:
            k = subtree.start
            while not refused:
                if not self._eliminate_front(k, updates):
                    refused.append(k)
                    return
                if k + 1 in subtree:
                    k += 1
                    continue
                k = self._dense[k][0].above
                if k < 0:
                    return
                with lock:
                    waiting[k] -= 1
                    if waiting[k] > 0:
                        return

        threads = min(cores(), len(subtrees))
        if threads == 1:
            share()
        else:
            with ThreadPoolExecutor(threads) as pool:
                for done in [pool.submit(share) for _ in range(threads)]:
                    done.result()
        return not refused

    def _eliminate_front(self, k: int, updates: dict[int, Floats]) -> bool:
        """Eliminate the pivots of a front, with the updates of those below it; False where one is not positive.

        What it subtracts from its border joins the updates.
        """
        front, triangle, border = self._dense[k]
        update = np.zeros((border.shape[1], border.shape[1]))
        for child in front.below:
            under = self._dense[child][0]
            _add(updates.pop(child), under.places, under.runs, triangle, border, update)
        if not cholesky(triangle):
            return False
        if front.above >= 0:
            solve_border(triangle, border)
            subtract_products(border, update)
            updates[k] = update
        return True

    def _solve(self, b: Floats) -> Floats:
        """The solution of U^T U x = b: forwards with U^T, backwards with U."""
        x = b[self.analysis.permutation]
        with self._libraries.limit(limits=1, user_api="blas"):
            for front, triangle, border in self._dense:
                own = x[front.first : front.first + front.pivots]
                own[:] = dtrsv(triangle.T, own, lower=1)
                x[front.border] -= own @ border
            for front, triangle, border in reversed(self._dense):
                own = x[front.first : front.first + front.pivots]
                own[:] = dtrsv(triangle.T, own - border @ x[front.border], lower=1, trans=1)
        solution = np.empty_like(x)
        solution[self.analysis.permutation] = x
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
