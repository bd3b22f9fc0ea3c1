"""Cholesky's factorisation by dense fronts: the solver that needs no extra.

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
from scipy.linalg.blas import dtrsv
from threadpoolctl import ThreadpoolController

from circuittex.base.arrays import Floats
from circuittex.base.compiled import compiled, cores
from circuittex.solvers.blas import cholesky, solve_border, subtract_products
from circuittex.solvers.coupled import Coupled
from circuittex.solvers.fronts import Analysis, Front, analyse
from circuittex.solvers.pattern import Pattern


class MultifrontalSolver:
    """Cholesky by dense fronts, which are kept until the pattern changes or node pairs come to be coupled.

    The pattern has room for all fibrils that may touch. Those that do not have zeros there, which are left out.

    >>> from circuittex.solvers.pattern import build_pattern, diagonal
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
        """Turn the rows of the matrix into rows of the factor; False where a pivot is not positive.

        Each thread takes subtrees of fronts. Who is the last to finish below a front goes on with that front.
        """
        assert self._analysis is not None, "factor comes first"
        subtrees, waiting = deque(self._analysis.subtrees), [len(front.below) for front, _, _ in self._blocks]
        updates: dict[int, Floats] = {}
        lock = Lock()
        refused: list[int] = []

        def work() -> None:
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
                k = self._blocks[k][0].above
                if k < 0:
                    return
                with lock:
                    waiting[k] -= 1
                    if waiting[k] > 0:
                        return

        threads = min(cores(), len(subtrees))
        if threads == 1:
            work()
        else:
            with ThreadPoolExecutor(threads) as pool:
                for done in [pool.submit(work) for _ in range(threads)]:
                    done.result()
        return not refused

    def _eliminate_front(self, k: int, updates: dict[int, Floats]) -> bool:
        """Eliminate the pivots of a front, with the updates of those below it; False where one is not positive.

        What it subtracts from its border joins the updates.
        """
        front, triangle, border = self._blocks[k]
        update = np.zeros((border.shape[1], border.shape[1]))
        for child in front.below:
            part = self._blocks[child][0]
            _add(updates.pop(child), part.places, part.runs, triangle, border, update)
        if not cholesky(triangle):
            return False
        if front.above >= 0:
            solve_border(triangle, border)
            subtract_products(border, update)
            updates[k] = update
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
