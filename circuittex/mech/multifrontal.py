"""Cholesky's factorisation by dense fronts: the solver that needs no extra.

Each front of `circuittex.mech.fronts` has a *panel* (p, m): the rows of the factor U, K = U^T U, that belong to its
pivots. They come as rows of the matrix and of what the fronts below add to it. What the elimination subtracts from the
border, the *update*, goes to the front above. All loops are compiled and none sums in an order of its own choice, so
the result has the same bits on any number of threads.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import sqrt
from typing import Any

import numpy as np

from circuittex.compiled import compiled
from circuittex.geometry.mesh import Floats, Ints
from circuittex.mech.coupled import Coupled
from circuittex.mech.fronts import Analysis, Front, analyse
from circuittex.mech.pattern import Pattern

BLOCK = 64
"""Pivots that are subtracted from everything after them at once: as many rows of a large panel stay in the cache."""


class MultifrontalSolver:
    """Cholesky by dense fronts, which are kept until the pattern changes or node pairs come to be coupled.

    The pattern has room for all fibrils that may touch. Those that do not have zeros there, and the factor of what is
    not zero needs about a quarter of the operations.

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
        self._analysis: Analysis
        self._values: Floats
        self._panels: list[Floats]

    def factor(self, pattern: Pattern, data: Floats) -> Callable[[Floats], Floats] | None:
        """A function that solves with the matrix (until the next call), or None if a pivot is not positive."""
        if self._coupled.renew(pattern, data):
            self._analysis = analyse(pattern, self._coupled.pair, self._coupled.pairs)
            self._values = np.empty(self._analysis.size)
            self._panels = [
                self._values[front.start :][: front.pivots * len(front.rows)].reshape(front.pivots, -1)
                for front in self._analysis.fronts
            ]
        self._values[:] = 0.0
        self._values[self._analysis.target] = data[self._analysis.entries]
        if not _factor(self._analysis.fronts, self._panels):
            return None
        return partial(_solve, self._analysis, self._panels)


def _factor(fronts: Sequence[Front], panels: Sequence[Floats]) -> bool:
    """Turn the panels from rows of the matrix into rows of the factor; False where a pivot is not positive."""
    below: list[list[tuple[Ints, Floats]]] = [[] for _ in fronts]
    for k, (front, panel) in enumerate(zip(fronts, panels, strict=True)):
        update = np.zeros((len(front.places), len(front.places)))
        for places, values in below[k]:
            _add(values, places, panel, update)
        below[k].clear()  # gives the memory back
        if not _eliminate(panel, update):
            return False
        if front.above >= 0:
            below[front.above].append((front.places, update))
    return True


def _solve(analysis: Analysis, panels: Sequence[Floats], b: Floats) -> Floats:
    """The solution of U^T U x = b: forwards with U^T, backwards with U."""
    x = b[analysis.order]
    for front, panel in zip(analysis.fronts, panels, strict=True):
        part = x[front.rows]
        _forwards(panel, part)
        x[front.rows] = part
    for front, panel in zip(reversed(analysis.fronts), reversed(panels), strict=True):
        part = x[front.rows]
        _backwards(panel, part)
        x[front.rows] = part
    solution = np.empty_like(x)
    solution[analysis.order] = x
    return solution


@compiled
def _add(values: Any, places: Any, panel: Any, update: Any) -> None:
    """Add the upper triangle of values (b, b) to the rows and columns `places` of a front."""
    p = panel.shape[0]
    for i in range(places.shape[0]):
        if places[i] < p:
            for j in range(i, places.shape[0]):
                panel[places[i], places[j]] += values[i, j]
        else:
            for j in range(i, places.shape[0]):
                update[places[i] - p, places[j] - p] += values[i, j]


@compiled
def _eliminate(panel: Any, update: Any) -> bool:
    """Cholesky's rows of the pivots in place of the panel, and what they leave of the border in the update."""
    p, m = panel.shape
    for start in range(0, p, BLOCK):
        stop = min(start + BLOCK, p)
        for i in range(start, m):
            row = panel[i, i:] if i < p else update[i - p, i - p :]
            _subtract(panel, start, min(i, stop), i, row)
            if i < stop:
                if not row[0] > 0.0:
                    return False
                scale = 1 / sqrt(row[0])
                for j in range(row.shape[0]):
                    row[j] *= scale
    return True


@compiled
def _subtract(panel: Any, start: int, stop: int, i: int, row: Any) -> None:
    """Take the products of rows start to stop of the panel with their own column i from row i, right of its diagonal.

    Four at a time: each value of the row is loaded and stored once for four products.
    """
    k = start
    while k + 4 <= stop:
        a, b, c, d = panel[k, i:], panel[k + 1, i:], panel[k + 2, i:], panel[k + 3, i:]
        a0, b0, c0, d0 = a[0], b[0], c[0], d[0]
        for j in range(row.shape[0]):
            row[j] -= a0 * a[j] + b0 * b[j] + c0 * c[j] + d0 * d[j]
        k += 4
    while k < stop:
        a = panel[k, i:]
        a0 = a[0]
        for j in range(row.shape[0]):
            row[j] -= a0 * a[j]
        k += 1


@compiled
def _forwards(panel: Any, x: Any) -> None:
    """Solve for the pivots, the first of x (m,), and take their part from the border."""
    for k in range(panel.shape[0]):
        x[k] /= panel[k, k]
        for j in range(k + 1, panel.shape[1]):
            x[j] -= panel[k, j] * x[k]


@compiled
def _backwards(panel: Any, x: Any) -> None:
    """Solve for the pivots, the first of x (m,), with the border known."""
    for k in range(panel.shape[0] - 1, -1, -1):
        rest = x[k]
        for j in range(k + 1, panel.shape[1]):
            rest -= panel[k, j] * x[j]
        x[k] = rest / panel[k, k]
