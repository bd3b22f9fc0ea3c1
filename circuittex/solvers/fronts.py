"""The fronts of a sparse matrix: in what order its unknowns are eliminated, and which of them together.

The multifrontal method (Duff & Reid, ACM TOMS 9, 1983; Liu, SIAM Review 34, 1992) makes some hundred dense matrices
of one sparse matrix. A *front* is a dense symmetric matrix of m unknowns. The first p of them, its *pivots*, are
eliminated there; what that adds to the others, its *border*, goes to the front *above*, the one that has the
border's first unknown among its pivots.

Ordering and elimination are followed in *blocks* of unknowns that have the same neighbours.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.base.frozen import frozen
from circuittex.solvers.dissection import dissect
from circuittex.solvers.elimination_tree import EliminationTree, elimination_tree, operations_of, subtrees
from circuittex.solvers.ranges import ranges

WORTHWHILE = 1.2
"""Blocks are dissected anew where their last order takes this times the operations that it took when it was made, since
pairs have come to be coupled across its separators."""


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
    below: tuple[int, ...]
    """numbers of the fronts right below, rising."""
    places: Ints
    """(b,) where those of the border are in the front above, its pivots first."""
    runs: Ints
    """where in `places` runs of successive ones begin, none of them of pivots and others; and, last, b."""


class Tables(NamedTuple):
    """Where fronts begin and end, as compiled functions take them."""

    first: Ints
    """(K + 1,) first pivot of each; and, last, the number of unknowns."""
    start: Ints
    """(K,) where in the factor its values begin."""
    cut: Ints
    """(K + 1,) where its border begins in `border` and `places`."""
    border: Ints
    """the unknowns of all borders."""
    places: Ints
    """where those are in the front above."""
    eldest: Ints
    """(K + 1,) where those right below it begin in `below`."""
    below: Ints
    """numbers of those right below each, rising."""


@frozen
class Analysis:
    """What a factorisation needs to know besides the values."""

    permutation: Ints
    """(n_dofs,) unknowns in the order of elimination."""
    fronts: tuple[Front, ...]
    """in the order of elimination: each comes after those below it."""
    target: Ints
    """where in the factor each of the entries belongs."""
    size: int
    """values in the factor."""
    blocks: Ints
    """the blocks by their turns, as dissection gave them."""
    least: float
    """floating-point operations that a factorisation took when the blocks were dissected."""
    subtrees: tuple[range, ...]
    """fronts to eliminate one after another, side by side with those of other ranges."""
    top: Ints
    """fronts that are above those of all ranges, rising."""
    tables: Tables
    """the fronts, for compiled functions."""


@frozen
class Blocks:
    """Unknowns in n blocks, each of successive unknowns with the same neighbours, and which blocks are coupled."""

    graph: sp.csr_array
    """(n, n) with ones where two different blocks are coupled."""
    first: Ints
    """(n,) the first unknown of each."""
    width: Ints
    """(n,) how many it has."""
    position: Floats
    """(n, 3) where it is, in any unit and by and large: tells where to look for separators."""


@frozen
class Entries:
    """The entries of a symmetric matrix that are not zero by its structure, in compressed rows."""

    indptr: Ints
    """(n_dofs + 1,) where rows begin."""
    indices: NDArray[np.int32]
    """column of each place; of the two places of a pair of unknowns one is used."""
    used: NDArray[np.int32]
    """the places that count, rising."""


class Layout(NamedTuple):
    """Where fronts begin and end, as compiled functions take them."""

    first: Ints
    """(K,) first pivot of each front."""
    pivots: Ints
    """(K,) how many pivots it has."""
    cut: Ints
    """(K + 1,) where its border begins in `border`."""
    border: Ints
    """the unknowns of all borders."""


def analyse(blocks: Blocks, entries: Entries, last: Analysis | None = None) -> Analysis:
    """The order of elimination and the fronts of a matrix.

    Blocks take turns as in the `last` analysis, if there is one, while that serves; else they are dissected anew.
    """
    width = blocks.width
    tree, least = _ordered(blocks, last)
    taken, begin, later, tops, front_of_turn = tree.blocks, tree.begin, tree.later, tree.tops, tree.front

    # Blocks by their fronts, then their unknowns: the order of elimination.
    by_front = np.argsort(front_of_turn, kind="stable")
    taken, turn = taken[by_front], np.argsort(by_front)
    width = width[taken]
    permutation = ranges(blocks.first[taken], width)
    place, front_of = np.argsort(permutation), np.repeat(front_of_turn[by_front], width)
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
    layout = Layout(first, p, cut, border)
    _find(above[owner], border, layout, places)
    breaks = (np.diff(places, prepend=-2) != 1) | (places == p[above[owner]])
    breaks[cut[:-1][b > 0]] = True
    runs = np.flatnonzero(breaks)
    run_cut = np.searchsorted(runs, cut)
    under = np.flatnonzero(above >= 0)
    under = under[np.argsort(above[under], kind="stable")]
    eldest = np.searchsorted(above[under], np.arange(len(p) + 1))
    size = p * (p + b)
    start = np.cumsum(size) - size
    fronts = tuple(
        Front(
            first=int(first[k]),
            pivots=int(p[k]),
            border=border[cut[k] : cut[k + 1]],
            start=int(start[k]),
            above=int(above[k]),
            below=tuple(under[eldest[k] : eldest[k + 1]].tolist()),
            places=places[cut[k] : cut[k + 1]],
            runs=np.append(runs[run_cut[k] : run_cut[k + 1]], cut[k + 1]) - cut[k],
        )
        for k in range(len(p))
    )
    target = np.empty(len(entries.used), dtype=np.int64)
    _locate(entries.used, entries.indptr, entries.indices, place, front_of, layout, start, target)
    parts = subtrees(above, operations_of(p.astype(float), b.astype(float)))
    inside = np.concatenate([np.arange(part.start, part.stop) for part in parts])
    return Analysis(
        permutation=permutation,
        fronts=fronts,
        target=target,
        size=int(size.sum()),
        blocks=tree.blocks,
        least=least,
        subtrees=parts,
        top=np.setdiff1d(np.arange(len(p)), inside),
        tables=Tables(np.append(first, len(permutation)), start, cut, border, places, eldest, under),
    )


def _ordered(blocks: Blocks, last: Analysis | None) -> tuple[EliminationTree, float]:
    """The elimination tree in the last order or else a new one, and the operations when that order was made."""
    graph, width = blocks.graph, blocks.width
    if last is not None and len(last.blocks) == len(width):
        tree = elimination_tree(graph, width, last.blocks)
        if tree.operations <= WORTHWHILE * last.least:
            return tree, last.least
        del tree  # a bad order has many couplings
    tree = elimination_tree(graph, width, dissect(graph, width, blocks.position))
    return tree, tree.operations


@compiled
def _find(front: Any, unknown: Any, layout: Any, found: Any) -> None:
    """Fill found with where unknowns are in fronts: among the pivots, or in the border behind them."""
    first, pivots, cut, border = layout
    for k in range(front.shape[0]):
        f = front[k]
        found[k] = unknown[k] - first[f]
        if found[k] >= pivots[f]:
            found[k] = pivots[f] + np.searchsorted(border[cut[f] : cut[f + 1]], unknown[k])


@compiled
def _locate(
    entries: Any, indptr: Any, indices: Any, place: Any, front_of: Any, layout: Any, start: Any, target: Any
) -> None:
    """Fill target with where the entries of the matrix belong in the factor.

    What comes next in a row is mostly the next unknown in the same front, or of the same unknown.
    """
    first, pivots, cut, border = layout
    row, f, column, at = 0, -1, -1, -1
    for k in range(entries.shape[0]):
        while entries[k] >= indptr[row + 1]:
            row += 1
        i, j = place[row], place[indices[entries[k]]]
        i, j = min(i, j), max(i, j)
        if front_of[i] != f or j != column:
            next_one = front_of[i] == f and j == column + 1 and at + 1 >= pivots[f]
            f, column = front_of[i], j
            own = cut[f] - pivots[f]  # where in `border` the first pivot would be
            if j - first[f] < pivots[f]:
                at = j - first[f]
            elif next_one and own + at + 1 < cut[f + 1] and border[own + at + 1] == j:
                at += 1
            else:
                at = pivots[f] + np.searchsorted(border[cut[f] : cut[f + 1]], j)
        p, r = pivots[f], i - first[f]
        wide = cut[f + 1] - cut[f]
        target[k] = start[f] + (r * p + at if at < p else p * p + r * wide + at - p)
