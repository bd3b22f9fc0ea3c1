"""The order of elimination: complete, without coupling between halves, and sparing fill where it is known to."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import circuittex.solvers.dissection as dissection
from circuittex.base.arrays import Floats, Ints
from circuittex.solvers.dissection import dissect, narrowed


def lattice(side: int) -> tuple[sp.csr_array, Floats]:
    """A square lattice of side * side parts, each coupled to its neighbours in both directions."""
    path = sp.diags_array([np.ones(side - 1), np.ones(side - 1)], offsets=[-1, 1])
    graph = sp.csr_array(sp.kron(path, sp.eye_array(side)) + sp.kron(sp.eye_array(side), path))
    x, y = np.divmod(np.arange(side * side), side)
    return graph, np.stack([x, y, 0 * x], axis=1).astype(float)


def fill(graph: sp.csr_array, order: Ints) -> int:
    """Entries of the factor's upper triangle, by elimination in a dense table."""
    table = graph.toarray()[np.ix_(order, order)] > 0
    np.fill_diagonal(table, True)
    for k in range(len(order)):
        later = np.flatnonzero(table[k, k + 1 :]) + k + 1
        table[np.ix_(later, later)] = True
    return int(np.triu(table).sum())


@settings(deadline=None, max_examples=100)
@given(st.integers(1, 12), st.integers(0, 2**32 - 1), st.sampled_from([1, 5, 20]))
def test_every_part_has_one_turn(n: int, seed: int, small: int) -> None:
    """Whatever the graph, and wherever its parts are, in one place for example."""
    rng = np.random.default_rng(seed)
    some = np.triu(rng.random((n, n)) < 0.3, 1)
    position = rng.integers(0, 3, (n, 3)).astype(float)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dissection, "SMALL", small)
        order = dissect(sp.csr_array((some | some.T).astype(float)), rng.integers(1, 7, n), position)
    assert np.array_equal(np.sort(order), np.arange(n))


@settings(deadline=None, max_examples=100)
@given(st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_the_narrowed_separator_is_the_narrowest_nearby(n: int, seed: int) -> None:
    """Against all divisions of the separator and its neighbours, tried one after another."""
    rng = np.random.default_rng(seed)
    some = np.triu(rng.random((n, n)) < 0.4, 1)
    graph, width = sp.csr_array((some | some.T).astype(float)), rng.integers(1, 7, n)
    side = rng.integers(0, 2, n).astype(bool)
    edge = side & ((some | some.T) @ ~side)
    cut = [side & ~edge, ~side, edge]
    first, last, separator = narrowed(graph, width, cut)
    assert np.array_equal(first.astype(int) + last + separator, np.ones(n))
    assert not (graph.toarray()[np.ix_(first, last)] > 0).any()
    band = edge | (graph @ edge > 0)
    kept = [half & ~band for half in cut[:2]]
    if not all(half.any() for half in kept):
        assert np.array_equal(separator, edge)
        return
    narrowest = width.sum()
    for choice in product((0, 1, 2), repeat=int(band.sum())):
        sides = [half.copy() for half in (*kept, np.zeros(n, dtype=bool))]
        for k, half in enumerate(sides):
            half[np.flatnonzero(band)[np.array(choice) == k]] = True
        if not (graph.toarray()[np.ix_(sides[0], sides[1])] > 0).any():
            narrowest = min(narrowest, width[sides[2]].sum())
    assert width[separator].sum() == narrowest


def test_a_separator_comes_last_and_parts_the_halves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a strip twice as long as wide: one row across, with nothing that crosses it."""
    graph, position = lattice(10)
    keep = np.flatnonzero(position[:, 1] < 5)
    strip = graph[keep][:, keep]
    monkeypatch.setattr(dissection, "SMALL", 49)
    order = dissect(strip, np.ones(50, dtype=np.int64), position[keep])
    row = position[keep][order[-5:], 0]
    assert len(set(row)) == 1
    rest = np.setdiff1d(np.arange(50), order[-5:])
    pieces, label = sp.csgraph.connected_components(strip[rest][:, rest])
    assert pieces == 2
    assert np.bincount(label).min() >= 15


def test_fill_of_a_lattice_grows_like_n_log_n(monkeypatch: pytest.MonkeyPatch) -> None:
    """George's order: from a side of 16 to one of 32 by 4 log 32 / log 16 = 5, and somewhat more while lower orders
    count; row after row it would be by 8."""
    monkeypatch.setattr(dissection, "SMALL", 16)
    found = []
    for side in (16, 32):
        graph, position = lattice(side)
        found.append(fill(graph, dissect(graph, np.ones(side * side, dtype=np.int64), position)))
    assert found[1] / found[0] < 6.5


def test_the_scale_of_the_positions_does_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    graph, position = lattice(12)
    width = np.ones(144, dtype=np.int64)
    monkeypatch.setattr(dissection, "SMALL", 20)
    assert np.array_equal(dissect(graph, width, position), dissect(graph, width, 1024 * position))
