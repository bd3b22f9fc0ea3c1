"""The order in which the unknowns of a sparse matrix are eliminated: nested dissection in space.

A *separator* is a set of blocks (`circuittex.solvers.fronts`) without which the others fall into two halves that are
not coupled (George, SIAM Journal on Numerical Analysis 10, 1973). Eliminated after both, it keeps the fill of one out
of the other. In a woven cell the cuts that cross the fewest fibrils run between yarns: where the nodes are tells where
to look for them. Of all separators close to such a cut the narrowest is the minimum cut of a network (Menger; Ford &
Fulkerson), which leaves a third less to do. Halves are dissected again; what is small enough is left to minimum
degree.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import breadth_first_order, maximum_flow
from scipy.sparse.linalg import splu

from circuittex.base.arrays import Floats, Ints

SMALL = 3000
"""Unknowns that are not dissected any more."""
CUTS = (0.5, 0.45, 0.55, 0.4, 0.6)
"""Where cuts are tried along an axis: the fraction of the blocks that lies before them. The first of equals counts."""


def dissect(graph: sp.csr_array, width: Ints, position: Floats) -> Ints:
    """The blocks (n,) in the order of elimination.

    `graph` (n, n) has ones where two different blocks are coupled; `width` (n,) counts the unknowns of each, `position`
    (n, 3) tells where they are, mm.

    >>> chain = sp.diags_array([np.ones(4), np.ones(4)], offsets=[-1, 1]).tocsr()
    >>> dissect(chain, np.full(5, SMALL), np.outer(np.arange(5.0), [1, 0, 0])).tolist()
    [0, 4, 2, 3, 1]
    """
    if width.sum() <= SMALL:
        return minimum_degree(graph)
    cut = _best_cut(graph, width, position)
    if cut is None:
        return minimum_degree(graph)
    cut = narrowed(graph, width, cut)
    permutations = []
    for block in cut:
        chosen = np.flatnonzero(block)
        within = graph[chosen][:, chosen]
        permutation = minimum_degree(within) if block is cut[-1] else dissect(within, width[chosen], position[chosen])
        permutations.append(chosen[permutation])
    return np.concatenate(permutations)


def _best_cut(graph: sp.csr_array, width: Ints, position: Floats) -> list[NDArray[np.bool_]] | None:
    """Two halves and their separator, (n,) each, for the cut with the narrowest separator; None where there is none.

    Of each cut that side is the separator, the blocks at its edge, which is narrower.
    """
    i, j = np.repeat(np.arange(len(width)), np.diff(graph.indptr)), graph.indices
    best, narrowest = None, width.sum() / 4  # where no cut is narrower, minimum degree does better
    for axis in np.argsort(-np.ptp(position, axis=0))[:2]:  # a fabric is flat
        for place in np.quantile(position[:, axis], CUTS):
            before = position[:, axis] < place
            crossing = before[i] & ~before[j]
            for edge in (i[crossing], j[crossing]):
                separator = np.zeros(len(width), dtype=bool)
                separator[edge] = True
                halves = before & ~separator, ~before & ~separator
                if width[separator].sum() < narrowest and all(half.any() for half in halves):
                    best, narrowest = [*halves, separator], width[separator].sum()
    return best


def narrowed(graph: sp.csr_array, width: Ints, cut: Sequence[NDArray[np.bool_]]) -> list[NDArray[np.bool_]]:
    """Two halves and their separator, (n,) each, with the narrowest separator among that of `cut` and its neighbours.

    Each block of this band is an edge of the capacity of its width, from entry to exit. Coupled blocks are joined
    without limit, exit to entry, and so is the band with the halves beside it, source and sink. The edges that a
    maximum flow from one half to the other fills, the first on every way, are the separator.
    """
    halves, separator = cut[:2], cut[2]
    band = separator | (graph @ separator > 0)
    first, last = (half & ~band for half in halves)
    if not first.any() or not last.any():
        return [*halves, separator]
    chosen = np.flatnonzero(band)
    k, inside = len(chosen), graph[chosen][:, chosen].tocoo()
    entry, leave, source, sink = np.arange(k), np.arange(k) + k, 2 * k, 2 * k + 1
    begin, end = (np.flatnonzero(graph[chosen] @ half > 0) for half in (first, last))
    tail = np.concatenate([entry, leave[inside.row], np.full(len(begin), source), leave[end]])
    head = np.concatenate([leave, entry[inside.col], entry[begin], np.full(len(end), sink)])
    capacity = np.full(len(tail), int(width.sum()), dtype=np.int32)
    capacity[:k] = width[chosen]
    network = sp.csr_array((capacity, (tail, head)), shape=(sink + 1, sink + 1))
    left = network - maximum_flow(network, source, sink).flow
    left.eliminate_zeros()
    reached = np.zeros(sink + 1, dtype=bool)
    reached[breadth_first_order(left, source, return_predecessors=False)] = True
    first[chosen] = reached[leave]
    separator = np.zeros_like(separator)
    separator[chosen] = reached[entry] & ~reached[leave]
    return [first, ~first & ~separator, separator]


def minimum_degree(graph: sp.csr_array) -> Ints:
    """The blocks in SuperLU's order of minimum degree, which SciPy gives away with a factorisation only."""
    laplacian = sp.diags_array(graph.sum(axis=0) + 1.0) - graph
    options = {"SymmetricMode": True, "Equil": False}
    lu = splu(laplacian.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    return np.argsort(lu.perm_c)
