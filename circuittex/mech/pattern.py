"""The sparsity pattern of the tangent, in node blocks: upper triangle, compressed rows.

Two kinds of node pairs are coupled: *full* pairs (the nodes of an element; all 9 x 9 unknowns) and
*point* pairs (contact; only the 3 x 3 positions). Within a row the unknowns of one node are contiguous, so
a block is located by one search among the neighbours of its node.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.base.frozen import frozen

DOFS = 9
"""Unknowns of a node: a position, and two directors that couple along a fibril only."""


@frozen
class Pattern:
    """Upper triangular CSR pattern over n nodes of nine unknowns each."""

    indptr: Ints
    """(9 n + 1,) row starts."""
    indices: NDArray[np.int32]
    """(nnz,) column numbers, sorted in each row; the diagonal comes first. In half of the memory."""
    neighbour_start: Ints
    """(n + 1,) offsets into `neighbour`."""
    neighbour: Ints
    """neighbours b > a of each node a, sorted."""
    point_offset: Ints
    """per neighbour: where its columns start in the rows of a's position, after a's own diagonal block."""
    full_offset: Ints
    """per neighbour: the same in the rows of a's directors; -1 for a point pair."""
    position: Floats
    """(n, 3) where the nodes are, mm, by and large: a hint for orders of elimination."""

    @property
    def n_dofs(self) -> int:
        return len(self.indptr) - 1

    @property
    def nnz(self) -> int:
        return len(self.indices)


def build_pattern(n: int, full: Ints, point: Ints, position: Floats | None = None) -> Pattern:
    """The pattern of `n` nodes with `full` (P, 2) and `point` (P', 2) node pairs, in any order, repeats allowed.

    `position` (n, 3) tells where the nodes are, mm; without it they are all in one place.
    """
    full_key = _keys(n, full)
    key = distinct(np.concatenate([full_key, _keys(n, point)]))
    full_pair = np.zeros(len(key), dtype=bool)
    full_pair[np.searchsorted(key, full_key)] = True
    a, b = key // n, key % n
    start = np.searchsorted(a, np.arange(n + 1))
    point_offset = _offsets(np.where(full_pair, DOFS, 3), start)
    full_offset = np.where(full_pair, _offsets(np.where(full_pair, DOFS, 0), start), -1)

    own = np.arange(DOFS, 0, -1)
    point_width = np.add.reduceat(np.append(np.where(full_pair, DOFS, 3), 0), start[:-1]) * (np.diff(start) > 0)
    full_width = np.add.reduceat(np.append(np.where(full_pair, DOFS, 0), 0), start[:-1]) * (np.diff(start) > 0)
    length = own[None, :] + np.where(np.arange(DOFS)[None, :] < 3, point_width[:, None], full_width[:, None])
    indptr = np.concatenate([[0], np.cumsum(length.ravel())])
    indices = np.empty(indptr[-1], dtype=np.int32)
    _fill_indices(indptr, start, b, full_pair, indices)
    return Pattern(
        indptr=indptr,
        indices=indices,
        neighbour_start=start,
        neighbour=b,
        point_offset=point_offset,
        full_offset=full_offset,
        position=np.zeros((n, 3)) if position is None else position,
    )


def count_entries(n: int, full: Ints, point: Ints) -> int:
    """How many entries `build_pattern` would make of the same pairs.

    >>> n, full, point = 3, np.array([[0, 1], [1, 0]]), np.array([[1, 0], [1, 2]])
    >>> count_entries(n, full, point), build_pattern(n, full, point).nnz
    (225, 225)
    """
    full_key = distinct(_keys(n, full))
    of_points = len(distinct(np.concatenate([full_key, _keys(n, point)]))) - len(full_key)
    return DOFS * (DOFS + 1) // 2 * n + DOFS * DOFS * len(full_key) + 9 * of_points


def distinct(keys: Ints) -> Ints:
    """The different ones among numbers of at least 0, rising: sorted ten times faster than np.unique hashes them.

    >>> distinct(np.array([3, 0, 3, 1, 0])).tolist()
    [0, 1, 3]
    """
    rising = np.sort(keys)
    return rising[np.diff(rising, prepend=-1) > 0]


def _keys(n: int, pairs: Ints) -> Ints:
    """One number for each pair of different nodes, the lower node first."""
    low, high = np.minimum(pairs[:, 0], pairs[:, 1]), np.maximum(pairs[:, 0], pairs[:, 1])
    return (low * n + high)[low < high]


def _offsets(width: Ints, start: Ints) -> Ints:
    """Exclusive running sum of `width`, restarted at each node."""
    total = np.concatenate([[0], np.cumsum(width)])
    return total[:-1] - np.repeat(total[start[:-1]], np.diff(start))


@compiled
def _fill_indices(indptr: Any, start: Any, neighbour: Any, full: Any, indices: Any) -> None:
    for a in range(start.shape[0] - 1):
        for k in range(9):
            at = indptr[9 * a + k]
            for col in range(9 * a + k, 9 * a + 9):
                indices[at] = col
                at += 1
            for i in range(start[a], start[a + 1]):
                width = 9 if full[i] else (3 if k < 3 else 0)
                for col in range(9 * neighbour[i], 9 * neighbour[i] + width):
                    indices[at] = col
                    at += 1


@compiled
def find_neighbour(start: Any, neighbour: Any, a: int, b: int) -> int:
    """Index of node b among the neighbours of node a < b, by bisection."""
    low, high = start[a], start[a + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if neighbour[middle] <= b:
            low = middle
        else:
            high = middle
    return low


@compiled
def add_elements(
    nodes: Any,
    matrix: Any,
    indptr: Any,
    start: Any,
    neighbour: Any,
    point_offset: Any,
    full_offset: Any,
    data: Any,
) -> None:
    """Add symmetric element matrices (M, n, 9, n, 9) to the matrix values."""
    for e in range(nodes.shape[0]):
        for i in range(nodes.shape[1]):
            a = nodes[e, i]
            for k in range(9):
                at = indptr[9 * a + k]
                for m in range(k, 9):
                    data[at + m - k] += matrix[e, i, k, i, m]
            for j in range(i + 1, nodes.shape[1]):
                b = nodes[e, j]
                low, high = min(a, b), max(a, b)
                n = find_neighbour(start, neighbour, low, high)
                for k in range(9):
                    offset = point_offset[n] if k < 3 else full_offset[n]
                    at = indptr[9 * low + k] + 9 - k + offset
                    for m in range(9):
                        data[at + m] += matrix[e, i, k, j, m] if a < b else matrix[e, i, m, j, k]


def diagonal(pattern: Pattern) -> Ints:
    """Positions of the diagonal entries."""
    return pattern.indptr[:-1]


def multiply(pattern: Pattern, data: Floats, x: Floats) -> Floats:
    """The symmetric matrix with upper triangle `data` times x."""
    import scipy.sparse as sp

    upper = sp.csr_array((data, pattern.indices, pattern.indptr), shape=(pattern.n_dofs, pattern.n_dofs))
    product: Floats = upper @ x + upper.T @ x - data[diagonal(pattern)] * x
    return product
