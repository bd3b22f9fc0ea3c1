"""Which node pairs of a pattern a matrix really couples: only these need be analysed and factorised.

The pattern has room for all fibrils that may touch. Those that do not have zeros there, and to leave these out saves
half of the operations of a factorisation and more.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from circuittex.base.arrays import Ints
from circuittex.base.compiled import compiled
from circuittex.mech.pattern import Pattern


class Coupled:
    """The pairs that count, kept while they hold: until the pattern is another, or a matrix couples one more."""

    def __init__(self) -> None:
        self._pattern: Pattern | None = None
        self.pair: NDArray[np.int32]
        """(nnz,) pair of each entry of the pattern (`pair_of_entry`)."""
        self.pairs: NDArray[np.bool_]
        """whether each pair of the pattern counts."""
        self.entries: NDArray[np.int32]
        """places of the entries that count: those within a node, and those of pairs that do."""

    def renew(self, pattern: Pattern, data: NDArray[np.float64]) -> bool:
        """Whether the pairs had to be determined anew for the matrix with these values (nnz,)."""
        new = pattern is not self._pattern
        if new:
            self._pattern, self.pair = pattern, np.empty(0, dtype=np.int32)  # the old pairs go first
            self.pair = pair_of_entry(pattern)
        pairs = np.zeros(len(pattern.neighbour), dtype=bool)
        _mark_pairs(self.pair, data, pairs)
        if not new and not np.any(pairs & ~self.pairs):
            return False
        self.pairs = pairs
        self.entries = entries_of(self.pair, pairs)
        return True

    def start(self) -> Ints:
        """(n_dofs + 1,) where the rows begin among `entries`."""
        assert self._pattern is not None, "renew comes first"
        return np.searchsorted(self.entries, self._pattern.indptr)


def pair_of_entry(pattern: Pattern) -> NDArray[np.int32]:
    """(nnz,) which of the pattern's node pairs each entry belongs to; -1 within a node."""
    pair = np.empty(pattern.nnz, dtype=np.int32)
    _fill_pairs(pattern.indptr, pattern.neighbour_start, pattern.full_offset >= 0, pair)
    return pair


def entries_of(pair: NDArray[np.int32], pairs: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Places of the entries of these pairs, and of those within a node; `pair` (nnz,) as `pair_of_entry` gives it."""
    return np.flatnonzero(np.append(pairs, True)[pair]).astype(np.int32)


@compiled
def _mark_pairs(pair: Any, data: Any, pairs: Any) -> None:
    for k in range(pair.shape[0]):
        if data[k] != 0.0 and pair[k] >= 0:
            pairs[pair[k]] = True


@compiled
def _fill_pairs(indptr: Any, start: Any, full: Any, pair: Any) -> None:
    for a in range(start.shape[0] - 1):
        for k in range(9):
            at = indptr[9 * a + k]
            pair[at : at + 9 - k] = -1
            at += 9 - k
            for i in range(start[a], start[a + 1]):
                width = 9 if full[i] else (3 if k < 3 else 0)
                pair[at : at + width] = i
                at += width
