"""The fronts of a sparse matrix: in what order its unknowns are eliminated, and which of them together.

The multifrontal method (Duff & Reid, ACM TOMS 9, 1983; Liu, SIAM Review 34, 1992) makes some hundred dense matrices
of one sparse matrix. A *front* is a dense symmetric matrix of m unknowns. The first p of them, its *pivots*, are
eliminated there; what that adds to the others, its *border*, goes to the front *above*, the one that has the
border's first unknown among its pivots.

Ordering and elimination are followed in *parts* of nodes, the unknowns of which have the same neighbours: part 2 a is
the position of node a, part 2 a + 1 its directors.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from circuittex.frozen import frozen
from circuittex.geometry.mesh import Ints
from circuittex.mech.pattern import Pattern
from circuittex.mech.space import DOFS

POSITION = 3
"""Unknowns of a node's position; the others are its directors'."""
FRONT = 1e6
"""What a front costs besides its elimination, in floating-point operations: two become one where that adds fewer. A
tenth of it makes the factor an eighth smaller and the factorisation a tenth slower."""


@frozen
class Front:
    """The place of a front in the factor and in the front above."""

    rows: Ints
    """(m,) its unknowns, numbered in the order of elimination and sorted: first the pivots, then the border."""
    pivots: int
    """p."""
    start: int
    """where in the factor its (p, m) values begin, those of one pivot after another's."""
    above: int
    """number of the front above; -1 where there is no border."""
    places: Ints
    """(m - p,) where in the rows of the front above those of the border are."""


@frozen
class Analysis:
    """What a factorisation needs to know besides the values."""

    order: Ints
    """(n_dofs,) unknowns in the order of elimination."""
    fronts: tuple[Front, ...]
    """in the order of elimination: each comes after those below it."""
    entries: Ints
    """the pattern's entries that belong to the fronts; the others are zero."""
    target: Ints
    """where in the factor each of them belongs."""
    size: int
    """values in the factor."""


def analyse(pattern: Pattern, pair: Ints, coupled: NDArray[np.bool_]) -> Analysis:
    """The order of elimination and the fronts of a matrix in which some node pairs are coupled, the others not.

    `pair` (nnz,) is what `circuittex.mech.coupled.pair_of_entry` gives, `coupled` tells of each pair whether it counts.
    """
    graph = _graph(pattern, coupled)
    order = _minimum_degree(graph)
    offset = np.arange(DOFS)
    first = DOFS * (order // 2) + POSITION * (order % 2)
    width = np.where(order % 2, DOFS - POSITION, POSITION)
    members = _merge(_borders(graph, order), width.tolist())

    def unknowns(parts: list[int]) -> Ints:
        inside = offset < width[parts, None]
        return (first[parts, None] + offset)[inside]

    eliminated = [unknowns(pivots) for pivots, _ in members]
    order = np.concatenate(eliminated)
    place = np.argsort(order)
    rows = [np.sort(place[unknowns(pivots + border)]) for pivots, border in members]
    p, m = (np.array([len(part) for part in parts]) for parts in (eliminated, rows))
    front_of, start = np.repeat(np.arange(len(p)), p), np.cumsum(p * m) - p * m
    above = [int(front_of[r[q]]) if len(r) > q else -1 for r, q in zip(rows, p, strict=True)]
    fronts = tuple(
        Front(rows=r, pivots=int(q), start=int(at), above=up, places=np.searchsorted(rows[up], r[q:]))
        for r, q, at, up in zip(rows, p, start, above, strict=True)
    )

    entries = np.flatnonzero(np.append(coupled, True)[pair])  # pair -1 takes the last: True
    owner = np.repeat(np.arange(pattern.n_dofs), np.diff(pattern.indptr))
    i, j = place[owner[entries]], place[pattern.indices[entries]]
    row, column = np.maximum(i, j), np.minimum(i, j)
    front = front_of[column]
    labelled = np.concatenate([k * pattern.n_dofs + r for k, r in enumerate(rows)])  # rising, so one search finds all
    local = np.searchsorted(labelled, front * pattern.n_dofs + row) - (np.cumsum(m) - m)[front]
    target = start[front] + (column - (np.cumsum(p) - p)[front]) * m[front] + local
    return Analysis(order=order, fronts=fronts, entries=entries, target=target, size=int((p * m).sum()))


def _graph(pattern: Pattern, coupled: NDArray[np.bool_]) -> sp.csc_array:
    """Ones where two different parts are coupled."""
    n = pattern.n_dofs // DOFS
    node = np.arange(n)
    a, b = np.repeat(node, np.diff(pattern.neighbour_start))[coupled], pattern.neighbour[coupled]
    full = pattern.full_offset[coupled] >= 0
    c, d = a[full], b[full]
    i = np.concatenate([2 * node, 2 * a, 2 * c, 2 * c + 1, 2 * c + 1])
    j = np.concatenate([2 * node + 1, 2 * b, 2 * d + 1, 2 * d, 2 * d + 1])
    ends = np.concatenate([i, j]), np.concatenate([j, i])
    return sp.csc_array((np.ones(2 * len(i)), ends), shape=(2 * n, 2 * n))


def _minimum_degree(graph: sp.csc_array) -> Ints:
    """The parts in SuperLU's order of minimum degree, which SciPy gives away with a factorisation only."""
    laplacian = sp.diags_array(graph.sum(axis=0) + 1.0) - graph
    options = {"SymmetricMode": True, "Equil": False}
    lu = splu(laplacian.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return np.argsort(lu.perm_c)


def _borders(graph: sp.csc_array, order: Ints) -> list[set[int]]:
    """For each part the later ones to which it is coupled when its turn comes; parts are numbered by their turns."""
    turn = np.argsort(order)
    of, neighbour = turn[np.repeat(np.arange(len(order)), np.diff(graph.indptr))], turn[graph.indices]
    later = neighbour > of
    of, neighbour = of[later], neighbour[later]
    by_turn = np.argsort(of, kind="stable")
    cuts = np.searchsorted(of[by_turn], np.arange(1, len(order)))
    borders = [set(part.tolist()) for part in np.split(neighbour[by_turn], cuts)]
    for border in borders:
        if border:
            above = min(border)
            borders[above] |= border - {above}
    return borders


def _merge(borders: list[set[int]], width: list[int]) -> list[tuple[list[int], list[int]]]:
    """Pivots and borders of the fronts, in parts.

    At first every part is a front. Each takes in those below it while that saves time, the largest first, and those
    below a front come just before it, which keeps few of them waiting.
    """
    pivots = [[part] for part in range(len(borders))]
    below: list[list[int]] = [[] for _ in borders]
    p, b = width.copy(), [sum(map(width.__getitem__, border)) for border in borders]
    for k, border in enumerate(borders):
        kept = []
        for c in sorted(below[k], key=lambda c: -b[c]):
            if _work(p[k] + p[c], b[k]) < _work(p[k], b[k]) + _work(p[c], b[c]) + FRONT:
                p[k] += p[c]
                pivots[k] += pivots[c]
                kept += below[c]
            else:
                kept.append(c)
        below[k] = kept
        if border:
            below[min(border)].append(k)
    backwards: list[int] = []
    waiting = [k for k, border in enumerate(borders) if not border]
    while waiting:
        k = waiting.pop()
        backwards.append(k)
        waiting += below[k]
    return [(pivots[k], list(borders[k])) for k in reversed(backwards)]


def _work(p: int, b: int) -> float:
    """Operations that eliminate p unknowns of p + b: one multiplication and addition for each entry and pivot."""
    return ((p + b) ** 3 - b**3) / 3
