"""The elimination tree of a sparse matrix: what each of its blocks is coupled to when its turn comes (Liu, SIAM Journal
on Matrix Analysis and Applications 11, 1990), and which blocks are best eliminated together, as one front.

Blocks are numbered by their turns here. A front takes in those below it as long as that saves time: dense matrices that
are a little larger than they need be cost less than many small ones.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled

SHARE = 1 / 16
"""Share of the operations that threads take at a time: enough for several threads, and few of them to share out."""
FRONT, ADDITION = 1e6, 10.0
"""What a front costs besides its elimination, in floating-point operations: in any case, and for each value that it
hands to the front above. Two become one where that adds fewer."""


class EliminationTree(NamedTuple):
    """Fronts as sets of blocks, the latter numbered by their turns."""

    blocks: Ints
    """the block of each turn."""
    begin: Ints
    """where in `later` those of each block begin."""
    later: NDArray[np.int32]
    """the later blocks to which each is coupled when its turn comes."""
    tops: Ints
    """the block that gives each front its border."""
    front: Ints
    """the front of each block."""
    operations: float
    """floating-point operations of a factorisation."""


def elimination_tree(graph: sp.csr_array, width: Ints, blocks: Ints) -> EliminationTree:
    """The fronts that make the least work of the blocks in this order."""
    turned = graph[blocks][:, blocks]
    n, width = len(blocks), width[blocks]
    begin = np.zeros(n + 1, dtype=np.int64)
    later = _eliminate(turned.indptr.astype(np.int64), turned.indices.astype(np.int64), begin)
    border = np.empty(n)
    _widths(begin, later, width, border)
    some = np.diff(begin) > 0
    above = np.full(n, -1)
    above[some] = np.minimum.reduceat(later, begin[:-1][some])
    p = width.astype(float)
    taken, tops = _take_in(above, p, border, FRONT, ADDITION)
    front = np.empty(n, dtype=np.int64)
    front[tops] = np.arange(len(tops))
    for c in np.flatnonzero(taken != np.arange(n))[::-1]:  # what takes a block in comes after it
        front[c] = front[taken[c]]
    return EliminationTree(blocks, begin, later, tops, front, float(operations_of(p[tops], border[tops]).sum()))


@compiled
def _eliminate(indptr: Any, indices: Any, begin: Any) -> Any:
    """Eliminate block after block: what is coupled to one comes to be coupled to the next of these."""
    n = len(indptr) - 1
    later, seen = np.empty(4 * len(indices), np.int32), np.full(n, -1)
    below, sibling = np.full(n, -1), np.full(n, -1)  # the blocks whose next one is this: a linked list
    end = 0
    for k in range(n):
        if end + n > len(later):
            longer = np.empty(2 * (end + n), np.int32)
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


@compiled
def _widths(begin: Any, later: Any, width: Any, border: Any) -> None:
    """Fill border (n,) with the unknowns of the later blocks to which each is coupled."""
    for k in range(border.shape[0]):
        border[k] = 0.0
        for at in range(begin[k], begin[k + 1]):
            border[k] += width[later[at]]


@compiled
def _append(head: Any, tail: Any, sibling: Any, k: int, first: int, last: int) -> None:
    """Append the blocks from first to last, a linked list, to that of block k."""
    if head[k] < 0:
        head[k] = first
    else:
        sibling[tail[k]] = first
    tail[k] = last


@compiled
def _take_in(above: Any, p: Any, b: Any, front: float, addition: float) -> Any:
    """Which block takes each block in, itself where none does, and all those in an order of elimination.

    At first every block is a front of p pivots and b unknowns in its border. Each takes in those below it while that
    saves time, the largest first, and its p grows by theirs. Those below a front come just before it, which keeps few
    of them waiting.
    """
    n = above.shape[0]
    taken, below = np.arange(n), np.empty(n, np.int64)
    head, tail, sibling = np.full(n, -1), np.full(n, -1), np.full(n, -1)  # lists of those below
    for k in range(n):
        count, c = 0, head[k]
        while c >= 0:
            at = count
            while at > 0 and b[below[at - 1]] < b[c]:
                below[at] = below[at - 1]
                at -= 1
            below[at], count, c = c, count + 1, sibling[c]
        head[k] = tail[k] = -1
        for m in range(count):
            c = below[m]
            first, last, sibling[c] = c, c, -1
            apart = operations_of(p[k], b[k]) + operations_of(p[c], b[c]) + front + addition * b[c] ** 2
            if operations_of(p[k] + p[c], b[k]) < apart:
                taken[c], first, last = k, head[c], tail[c]
                p[k] += p[c]
            if first >= 0:
                _append(head, tail, sibling, k, first, last)
        if above[k] >= 0:
            _append(head, tail, sibling, above[k], k, k)
    permutation, end, waiting = np.empty(n, np.int64), n, 0
    for k in range(n):
        if above[k] < 0:
            below[waiting], waiting = k, waiting + 1
    while waiting > 0:
        waiting -= 1
        k = below[waiting]
        end -= 1
        permutation[end], c = k, head[k]
        while c >= 0:
            below[waiting], waiting, c = c, waiting + 1, sibling[c]
    return taken, permutation[end:]


@compiled
def operations_of(p: Any, b: Any) -> Any:
    """Operations that eliminate p unknowns of p + b: one multiplication and addition for each entry and pivot."""
    return ((p + b) ** 3 - b**3) / 3


def subtrees(above: Ints, operations: Floats) -> tuple[range, ...]:
    """The largest subtrees that hold at most `SHARE` of the operations each, and single fronts that hold more and have
    none below. Fronts below one another are numbered one after another."""
    total, count = operations.copy(), np.ones(len(above), dtype=np.int64)
    for k in range(len(above)):
        if above[k] >= 0:
            total[above[k]] += total[k]
            count[above[k]] += count[k]
    small = total <= SHARE * operations.sum()
    top = small & ~np.where(above >= 0, small[above], False)
    top |= ~small & (count == 1)
    return tuple(range(int(k - count[k] + 1), int(k + 1)) for k in np.flatnonzero(top))
