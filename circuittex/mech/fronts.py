"""The fronts of a sparse matrix: in what order its unknowns are eliminated, and which of them together.

The multifrontal method (Duff & Reid, ACM TOMS 9, 1983; Liu, SIAM Review 34, 1992) makes some hundred dense matrices
of one sparse matrix. A *front* is a dense symmetric matrix of m unknowns. The first p of them, its *pivots*, are
eliminated there; what that adds to the others, its *border*, goes to the front *above*, the one that has the
border's first unknown among its pivots.

Ordering and elimination are followed in *parts* of nodes, the unknowns of which have the same neighbours: part 2 a is
the position of node a, part 2 a + 1 its directors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from circuittex.compiled import compiled
from circuittex.frozen import frozen
from circuittex.geometry.mesh import Ints
from circuittex.mech.dissection import dissect
from circuittex.mech.pattern import Pattern, ranges
from circuittex.mech.space import DOFS

POSITION = 3
"""Unknowns of a node's position; the others are its directors'."""
FRONT = 1e6
"""What a front costs besides its elimination, in floating-point operations: two become one where that adds fewer. A
tenth of it makes the factor an eighth smaller and the factorisation a tenth slower."""


@frozen
class Front:
    """The place of a front in the factor and in the front above; unknowns are numbered in the order of elimination."""

    first: int
    """its first pivot; the others follow."""
    pivots: int
    """p."""
    border: Ints
    """(b,) the unknowns of its border, rising."""
    start: int
    """where in the factor its values begin: (p, p) of the pivots, then (p, b) of the border, row after row."""
    above: int
    """number of the front above; -1 where there is no border."""
    places: Ints
    """(b,) where those of the border are in the front above, its pivots first."""


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
    n, graph = pattern.n_dofs, _graph(pattern, coupled)
    width = np.tile([POSITION, DOFS - POSITION], graph.shape[0] // 2)
    parts = dissect(graph, width, pattern.position.repeat(2, axis=0))
    begin, later = _borders(graph, parts)
    tops, front_of_turn = _merge(begin, later, width[parts])

    # Parts by their fronts, then their unknowns: the order of elimination.
    by_front = np.argsort(front_of_turn, kind="stable")
    parts, turn = parts[by_front], np.argsort(by_front)
    width = width[parts]
    order = ranges(DOFS * (parts // 2) + POSITION * (parts % 2), width)
    place, front_of = np.argsort(order), np.repeat(front_of_turn[by_front], width)
    p = np.bincount(front_of)
    first = np.cumsum(p) - p

    # Borders, one after another in the order of the fronts.
    owner = np.repeat(np.arange(len(tops)), begin[tops + 1] - begin[tops])
    bordering = turn[later[ranges(begin[tops], begin[tops + 1] - begin[tops])]]
    sort = np.lexsort((bordering, owner))
    owner, bordering = owner[sort], bordering[sort]
    border = ranges((np.cumsum(width) - width)[bordering], width[bordering])
    owner = np.repeat(owner, width[bordering])
    b = np.bincount(owner, minlength=len(p))
    cut = np.concatenate([[0], np.cumsum(b)])
    above = np.full(len(p), -1)
    above[b > 0] = front_of[border[cut[:-1][b > 0]]]
    places = np.empty(len(border), dtype=np.int64)
    _find(above[owner], border, first, p, cut, border, places)
    size = p * (p + b)
    start = np.cumsum(size) - size
    fronts = tuple(
        Front(
            first=int(first[k]),
            pivots=int(p[k]),
            border=border[cut[k] : cut[k + 1]],
            start=int(start[k]),
            above=int(above[k]),
            places=places[cut[k] : cut[k + 1]],
        )
        for k in range(len(p))
    )

    entries = np.flatnonzero(np.append(coupled, True)[pair])  # pair -1 takes the last: True
    i = place[np.repeat(np.arange(n), np.diff(pattern.indptr))[entries]]
    j = place[pattern.indices[entries]]
    row, column = np.minimum(i, j), np.maximum(i, j)
    front = front_of[row]
    target = np.empty(len(entries), dtype=np.int64)
    _find(front, column, first, p, cut, border, target)
    row, triangle = row - first[front], p[front]
    inside = np.where(target < triangle, row * triangle + target, triangle**2 + row * b[front] + target - triangle)
    return Analysis(order=order, fronts=fronts, entries=entries, target=start[front] + inside, size=int(size.sum()))


@compiled
def _find(front: Any, unknown: Any, first: Any, pivots: Any, cut: Any, border: Any, found: Any) -> None:
    """Fill found with where unknowns are in fronts: among the pivots, or in the border behind them."""
    for k in range(front.shape[0]):
        f = front[k]
        found[k] = unknown[k] - first[f]
        if found[k] >= pivots[f]:
            found[k] = pivots[f] + np.searchsorted(border[cut[f] : cut[f + 1]], unknown[k])


def _graph(pattern: Pattern, coupled: NDArray[np.bool_]) -> sp.csr_array:
    """Ones where two different parts are coupled."""
    n = pattern.n_dofs // DOFS
    node = np.arange(n)
    a, b = np.repeat(node, np.diff(pattern.neighbour_start))[coupled], pattern.neighbour[coupled]
    full = pattern.full_offset[coupled] >= 0
    c, d = a[full], b[full]
    i = np.concatenate([2 * node, 2 * a, 2 * c, 2 * c + 1, 2 * c + 1])
    j = np.concatenate([2 * node + 1, 2 * b, 2 * d + 1, 2 * d, 2 * d + 1])
    ends = np.concatenate([i, j]), np.concatenate([j, i])
    return sp.csr_array((np.ones(2 * len(i)), ends), shape=(2 * n, 2 * n))


def _borders(graph: sp.csr_array, order: Ints) -> tuple[Ints, Ints]:
    """For each part the later ones to which it is coupled when its turn comes; parts are numbered by their turns.

    Returns where those of each part begin, and all of them.
    """
    turned = graph[order][:, order]
    begin = np.zeros(len(order) + 1, dtype=np.int64)
    later = _eliminate(turned.indptr.astype(np.int64), turned.indices.astype(np.int64), begin)
    return begin, later


@compiled
def _eliminate(indptr: Any, indices: Any, begin: Any) -> Any:
    """Eliminate part after part: what is coupled to one comes to be coupled to the next of these."""
    n = len(indptr) - 1
    later, seen = np.empty(4 * len(indices), np.int64), np.full(n, -1)
    below, sibling = np.full(n, -1), np.full(n, -1)  # the parts whose next one is this: a linked list
    end = 0
    for k in range(n):
        if end + n > len(later):
            longer = np.empty(2 * (end + n), np.int64)
            longer[:end] = later[:end]
            later = longer
        seen[k], nearest = k, n
        for at in range(indptr[k], indptr[k + 1]):
            j = indices[at]
            if j > k and seen[j] != k:
                seen[j], later[end], nearest, end = k, j, min(nearest, j), end + 1
        child = below[k]
        while child >= 0:
            for at in range(begin[child], begin[child + 1]):
                j = later[at]
                if seen[j] != k:
                    seen[j], later[end], nearest, end = k, j, min(nearest, j), end + 1
            child = sibling[child]
        begin[k + 1] = end
        if nearest < n:
            sibling[k], below[nearest] = below[nearest], k
    return later[:end]


def _merge(begin: Ints, later: Ints, width: Ints) -> tuple[Ints, Ints]:
    """The part that gives each front its border, and the front of each part.

    At first every part is a front. Each takes in those below it while that saves time, the largest first, and those
    below a front come just before it, which keeps few of them waiting.
    """
    n = len(width)
    some = np.diff(begin) > 0
    above = np.full(n, -1)
    above[some] = np.minimum.reduceat(later, begin[:-1][some])
    total = np.concatenate([[0], np.cumsum(width[later])])
    p, b = width.tolist(), np.diff(total[begin]).tolist()
    below: list[list[int]] = [[] for _ in range(n)]
    taken = list(range(n))
    for k, up in enumerate(above.tolist()):
        kept = []
        for c in sorted(below[k], key=lambda c: -b[c]):
            if _work(p[k] + p[c], b[k]) < _work(p[k], b[k]) + _work(p[c], b[c]) + FRONT:
                p[k] += p[c]
                taken[c] = k
                kept += below[c]
            else:
                kept.append(c)
        below[k] = kept
        if up >= 0:
            below[up].append(k)
    backwards: list[int] = []
    waiting = np.flatnonzero(~some).tolist()
    waiting = [k for k in waiting if taken[k] == k]
    while waiting:
        k = waiting.pop()
        backwards.append(k)
        waiting += below[k]
    tops = np.array(backwards[::-1])
    front = np.empty(n, dtype=np.int64)
    front[tops] = np.arange(len(tops))
    for c in range(n - 1, -1, -1):  # what takes a part in comes after it
        front[c] = front[taken[c]]
    return tops, front


def _work(p: int, b: int) -> float:
    """Operations that eliminate p unknowns of p + b: one multiplication and addition for each entry and pivot."""
    return ((p + b) ** 3 - b**3) / 3
