"""Fewer resistors between the pins, within a stated error, and passive still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.electrical.network.ports import PortMatrix, resistances


def thinned(matrices: Sequence[PortMatrix], error: float) -> tuple[PortMatrix, ...]:
    """The matrices without those resistors that matter least: no pair's resistance rises by more than `error`.

    What goes is the same in all states. A resistor that goes raises R between its own ends by g R / (1 - g R), and
    no other by more: they go in the order of g R, its largest over the states. Taking conductors away never lowers a
    resistance (Rayleigh), so that the longest beginning of that order that keeps the bound is found by halving, and
    checked exactly. G stays symmetric with rows that add up to zero and nothing positive beside the diagonal: passive.

    >>> star = PortMatrix(("a", "b", "c"), np.array([[1.001, -1, -0.001], [-1, 2, -1], [-0.001, -1, 1.001]]))
    >>> [int((m.conductance < 0).sum()) // 2 for m in thinned([star], 0.01)]
    [2]
    """
    i, j = np.triu_indices(len(matrices[0].ports), 1)
    exact = [resistances(matrix) for matrix in matrices]
    share = np.array(
        [
            -m.conductance[i, j] * np.where(np.isfinite(r[i, j]), r[i, j], 0.0)
            for m, r in zip(matrices, exact, strict=True)
        ]
    ).max(axis=0)
    there = np.flatnonzero(share > 0.0)
    order = there[np.argsort(share[there], kind="stable")]

    def kept(count: int) -> tuple[PortMatrix, ...]:
        return tuple(_without(matrix, i[order[:count]], j[order[:count]]) for matrix in matrices)

    good, bad = 0, len(order) + 1
    while bad - good > 1:
        middle = (good + bad) // 2
        off = max(_rise(r, resistances(m)) for r, m in zip(exact, kept(middle), strict=True))
        good, bad = (middle, bad) if off <= error else (good, middle)
    return kept(good)


def _without(matrix: PortMatrix, i: Ints, j: Ints) -> PortMatrix:
    """A port matrix without the resistors between pins i and j."""
    G = matrix.conductance.copy()
    G[i, j] = G[j, i] = 0.0
    np.fill_diagonal(G, 0.0)
    np.fill_diagonal(G, -G.sum(axis=1))
    return replace(matrix, conductance=G)


def _rise(exact: Floats, found: Floats) -> float:
    """Largest relative rise of the resistances that were finite."""
    there = np.isfinite(exact) & (exact > 0.0)
    return float((found[there] / exact[there] - 1.0).max(initial=0.0))
