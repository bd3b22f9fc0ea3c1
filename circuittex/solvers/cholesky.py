"""Cholesky's factorisation of a sparse symmetric matrix by dense fronts.

Each front of `circuittex.solvers.fronts` holds the rows of the factor U, K = U^T U, that belong to its pivots: their
*triangle* (p, p), and their *border* (p, b). They come as rows of the matrix and of what the fronts below add to it.
What the elimination subtracts from the other unknowns of the border, the *update* (b, b), goes to the front above.
LAPACK does the dense work of a front on a single thread, and the updates are added in a fixed order: so the result has
the same bits on any number of threads, which share the fronts.

In single precision a factor takes half of the memory and half of the time, and so does each solution. These are good to
some digits, fewer the worse the matrix is conditioned, and a positive definite matrix may be refused: enough for what
only precedes an iteration.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from threading import Lock
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled, cores, share_out
from circuittex.solvers.blas import Reals, cholesky, solve_border, subtract_products
from circuittex.solvers.fronts import Analysis, Blocks, Entries, analyse
from circuittex.solvers.levels import levels
from circuittex.solvers.substitution import backwards, forwards

Solve = Callable[[Floats], Floats]

SPARE = 1.25
"""Room for structures that grow a little, before new memory is asked for."""
WORTH_SHARING = 1_000_000
"""Values of a factor from which on a solution is shared among threads."""


def factorise(matrix: sp.sparray, position: Floats | None = None) -> Solve | None:
    """A function that solves with a symmetric matrix (n, n), or None if it is not positive definite.

    The upper triangle is read. `position` (n, 3) tells where the unknowns are, for the order of elimination; without it
    distances in the graph stand for places. See `Cholesky` for matrices that share their structure.

    >>> chain = sp.diags_array([[-1.0] * 2, [2.0] * 3, [-1.0] * 2], offsets=[-1, 0, 1])
    >>> factorise(chain)(np.array([1.0, 0.0, 0.0])).round(12)
    array([0.75, 0.5 , 0.25])
    """
    analysis, values = analysed(matrix, position)
    return Cholesky(analysis).factor(values)


def analysed(matrix: sp.sparray, position: Floats | None = None) -> tuple[Analysis, Floats]:
    """The analysis of such a matrix, and the values that `Cholesky.factor` takes of it."""
    upper = sp.triu(matrix, format="csr")
    upper.sort_indices()
    n = upper.shape[0]
    graph = sp.csr_array(upper + upper.T)
    graph.setdiag(0.0)
    graph.eliminate_zeros()
    graph.data[:] = 1.0
    blocks = Blocks(graph, np.arange(n), np.ones(n, dtype=np.int64), levels(graph) if position is None else position)
    entries = Entries(
        upper.indptr.astype(np.int64), upper.indices.astype(np.int32), np.arange(upper.nnz, dtype=np.int32)
    )
    return analyse(blocks, entries), upper.data


class Cholesky:
    """Cholesky's factorisation of matrices of one structure, whose `Analysis` tells the fronts; in double or `single`
    precision.

    It takes the memory over from `last`, which is of no use then: fresh pages cost as much as half a factorisation.
    """

    def __init__(self, analysis: Analysis, last: Cholesky | None = None, *, single: bool = False) -> None:
        self.analysis, self.single = analysis, single
        self._libraries: ThreadpoolController = ThreadpoolController() if last is None else last._libraries
        self._room: NDArray[np.uint8] = np.empty(0, dtype=np.uint8) if last is None else last._hand_on()
        dtype = np.dtype(np.float32 if single else np.float64)
        size = dtype.itemsize * analysis.size
        if len(self._room) < size:
            self._room = np.empty(0, dtype=np.uint8)  # the old one goes first
            self._room = np.empty(int(SPARE * analysis.size) * dtype.itemsize, dtype=np.uint8)
        self._values: Reals = self._room[:size].view(dtype)
        self._dense = [
            (front, self._view(front.start, p, p), self._view(front.start + p * p, p, len(front.border)))
            for front in analysis.fronts
            for p in [front.pivots]
        ]
        """Each front with the values of its triangle and its border."""
        self._subtrees = [np.arange(each.start, each.stop) for each in analysis.subtrees]

    def _hand_on(self) -> NDArray[np.uint8]:
        """The memory, with nothing here that refers to it any more."""
        room, self._room, self._values, self._dense = self._room, np.empty(0, dtype=np.uint8), np.empty(0), []
        return room

    def factor(self, values: Floats) -> Solve | None:
        """A function that solves with the matrix (until the next call), or None if a pivot is not positive.

        `values` are those of the used entries, in their order.
        """
        self._values[:] = 0.0
        self._values[self.analysis.target] = values
        del values
        with self._libraries.limit(limits=1, user_api="blas"):
            return self._solve if self._eliminate() else None

    def _view(self, start: int, rows: int, columns: int) -> Reals:
        return self._values[start : start + rows * columns].reshape(rows, columns)

    def _eliminate(self) -> bool:
        """Turn the rows of the matrix into rows of the factor; False where a pivot is not positive.

        Each thread takes subtrees of fronts. Who is the last to finish below a front goes on with that front.
        """
        subtrees, waiting = deque(self.analysis.subtrees), [len(front.below) for front, _, _ in self._dense]
        updates: dict[int, Reals] = {}
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
        share_out(lambda _: share(), threads, threads)
        return not refused

    def _eliminate_front(self, k: int, updates: dict[int, Reals]) -> bool:
        """Eliminate the pivots of a front, with the updates of those below it; False where one is not positive.

        What it subtracts from its border joins the updates.
        """
        front, triangle, border = self._dense[k]
        update = np.zeros((border.shape[1], border.shape[1]), dtype=border.dtype)
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
        largest = float(np.abs(b).max(initial=0.0)) if self.single else 1.0  # single precision ends at 1e-38
        if largest == 0.0:
            return np.zeros_like(b)
        analysis, table, values = self.analysis, self.analysis.tables, self._values
        x = (b[analysis.permutation] / largest).astype(values.dtype)
        passed = np.empty(len(table.border), dtype=values.dtype)

        def down(fronts: Ints) -> None:
            forwards(fronts, table, values, x, passed)

        def up(fronts: Ints) -> None:
            backwards(fronts, table, values, x)

        subtrees, threads = self._subtrees, cores() if analysis.size >= WORTH_SHARING else 1
        share_out(lambda k: down(subtrees[k]), len(subtrees), threads)
        down(analysis.top)
        up(analysis.top)
        share_out(lambda k: up(subtrees[k]), len(subtrees), threads)
        solution = np.empty_like(b)
        solution[analysis.permutation] = x
        solution *= largest
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
