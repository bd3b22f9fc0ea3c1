"""The fronts of random patterns against an elimination on a dense table, and the fill that the ordering leaves."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from beams import dense
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import circuittex.solvers.elimination_tree as elimination_tree
import circuittex.solvers.fronts as fronts
from circuittex.base.arrays import Ints
from circuittex.design import plain_weave
from circuittex.geometry.weave import build_mesh
from circuittex.mech.coupled import entries_of, pair_of_entry
from circuittex.mech.multifrontal import blocks
from circuittex.mech.pattern import Pattern, build_pattern
from circuittex.solvers.dissection import minimum_degree
from circuittex.solvers.fronts import Analysis, Entries, Front

NOTHING = np.empty((0, 2), dtype=np.int64)


@st.composite
def patterns(draw: st.DrawFn) -> Pattern:
    """One node to ten with full and point pairs between any of them, so often in several unconnected pieces."""
    n = draw(st.integers(1, 10))
    pairs = st.lists(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)), max_size=14)
    full, point = (np.array(draw(pairs), dtype=np.int64).reshape(-1, 2) for _ in range(2))
    position = np.array(draw(st.lists(st.integers(0, 3), min_size=3 * n, max_size=3 * n)), dtype=float)
    return build_pattern(n, full, point, position.reshape(n, 3))


def analyse(pattern: Pattern) -> Analysis:
    """The fronts with all pairs of the pattern coupled."""
    return some_pairs(pattern, np.ones(len(pattern.neighbour), dtype=bool), np.arange(pattern.nnz))


def some_pairs(pattern: Pattern, coupled: NDArray[np.bool_], entries: Ints) -> Analysis:
    """The fronts with some pairs coupled, of which these entries are."""
    return fronts.analyse(blocks(pattern, coupled), Entries(pattern.indptr, pattern.indices, entries))


def merge_nothing(patch: pytest.MonkeyPatch) -> None:
    """Fronts cost nothing, so that merging two of them never pays."""
    patch.setattr(elimination_tree, "FRONT", 0.0)
    patch.setattr(elimination_tree, "ADDITION", 0.0)


def filled(pattern: Pattern, order: Ints) -> NDArray[np.bool_]:
    """Where the factor of the matrix in this order can differ from zero, by elimination in a dense table."""
    table = dense(pattern, np.ones(pattern.nnz))[np.ix_(order, order)] > 0
    for k in range(len(order)):
        later = np.flatnonzero(table[k, k + 1 :]) + k + 1
        table[np.ix_(later, later)] = True
    return np.asarray(np.triu(table))


def pivots(front: Front) -> Ints:
    return np.arange(front.first, front.first + front.pivots)


def held(analysis: Analysis) -> NDArray[np.bool_]:
    """Where the fronts have room."""
    table = np.zeros(2 * (len(analysis.permutation),), dtype=bool)
    for front in analysis.fronts:
        table[np.ix_(pivots(front), np.append(pivots(front), front.border))] = True
    return np.asarray(np.triu(table))


@settings(deadline=None, max_examples=60)
@given(patterns())
def test_unmerged_fronts_hold_the_fill_and_nothing_else(pattern: Pattern) -> None:
    with pytest.MonkeyPatch.context() as patch:
        merge_nothing(patch)
        analysis = analyse(pattern)
    assert np.array_equal(held(analysis), filled(pattern, analysis.permutation))


@settings(deadline=None, max_examples=60)
@given(patterns(), st.sampled_from([0.0, 300.0, 3e4, elimination_tree.FRONT]), st.sampled_from([0.0, 0.1, 0.5, 1.0]))
def test_fronts_fit_together(pattern: Pattern, cost: float, share: float) -> None:
    """Each unknown is eliminated once, each border lies in the front above, each entry has a place of its own, and
    subtrees hold all that is below their fronts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elimination_tree, "FRONT", cost)
        patch.setattr(elimination_tree, "SHARE", share)
        analysis = analyse(pattern)
    n = pattern.n_dofs
    assert np.array_equal(np.sort(analysis.permutation), np.arange(n))
    assert np.array_equal(np.concatenate([pivots(front) for front in analysis.fronts]), np.arange(n))
    values, at = np.zeros(analysis.size), 0
    values[analysis.target] = np.arange(1, pattern.nnz + 1)
    table = np.zeros((n, n))
    for k, front in enumerate(analysis.fronts):
        own, border = pivots(front), front.border
        assert np.all(np.diff(np.append(own, border)) > 0)
        for begin, end in pairwise(front.runs):
            run = front.places[begin:end]
            assert np.array_equal(run, run[0] + np.arange(end - begin))
            inside = run < analysis.fronts[front.above].pivots
            assert inside.all() or not inside.any()
        assert [front.runs[0], front.runs[-1]] == ([0, len(border)] if len(border) else [0, 0])
        assert front.start == at
        for columns in (own, border):
            size = len(own) * len(columns)
            table[np.ix_(own, columns)] = values[at : at + size].reshape(len(own), -1)
            at += size
        if len(border):
            assert front.above > k
            above = analysis.fronts[front.above]
            assert np.array_equal(np.append(pivots(above), above.border)[front.places], border)
            assert front.places[0] < above.pivots
        else:
            assert front.above == -1
    assert at == analysis.size
    alone = sorted(k for subtree in analysis.subtrees for k in subtree)
    assert len(set(alone)) == len(alone)
    for k, front in enumerate(analysis.fronts):
        assert front.below == tuple(c for c, other in enumerate(analysis.fronts) if other.above == k)
        if k not in alone:  # it comes after those below it, of which there are some
            assert front.below
        elif front.below:
            (subtree,) = [subtree for subtree in analysis.subtrees if k in subtree]
            assert subtree.start <= front.below[0]
    expected = dense(pattern, np.arange(1.0, pattern.nnz + 1))[np.ix_(analysis.permutation, analysis.permutation)]
    assert np.array_equal(table + np.triu(table, 1).T, expected)


@settings(deadline=None, max_examples=60)
@given(patterns(), st.integers(0, 2**32 - 1))
def test_pairs_that_are_not_coupled_are_left_out(pattern: Pattern, seed: int) -> None:
    """The fronts are those of the pattern that holds the coupled pairs alone."""
    coupled = np.random.default_rng(seed).random(len(pattern.neighbour)) < 0.5
    pairs = np.stack(
        [np.repeat(np.arange(pattern.n_dofs // 9), np.diff(pattern.neighbour_start)), pattern.neighbour], 1
    )
    full = pattern.full_offset >= 0
    smaller = build_pattern(pattern.n_dofs // 9, pairs[coupled & full], pairs[coupled & ~full])
    entries = entries_of(pair_of_entry(pattern), coupled)
    found, expected = some_pairs(pattern, coupled, entries), analyse(smaller)
    assert np.array_equal(found.permutation, expected.permutation)
    assert np.array_equal(found.target, expected.target)
    assert np.array_equal(pattern.indices[entries], smaller.indices)


def test_a_fibril_has_no_fill(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chain can be eliminated from its ends without fill, and minimum degree finds such an order."""
    merge_nothing(monkeypatch)
    chain = np.stack([np.arange(39), np.arange(1, 40)], axis=1)
    pattern = build_pattern(40, chain, NOTHING)
    assert held(analyse(pattern)).sum() == pattern.nnz


def test_the_order_spares_fill(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten fibrils that touch the next at all nodes: less fill than in the natural order, which goes fibril by fibril.

    And less than with whole nodes coupled across: directors couple along the fibril alone, and the parts show it.
    """
    merge_nothing(monkeypatch)
    node = np.arange(200).reshape(10, 20)
    along = np.stack([node[:, :-1].ravel(), node[:, 1:].ravel()], axis=1)
    pairs = [(node[:-1], node[1:]), (node[:-1, 1:], node[1:, :-1])]
    across = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in pairs])
    pattern, whole = build_pattern(200, along, across), build_pattern(200, np.concatenate([along, across]), NOTHING)
    fill = held(analyse(pattern)).sum()
    assert fill < 0.7 * filled(pattern, np.arange(pattern.n_dofs)).sum()
    assert fill < 0.6 * held(analyse(whole)).sum()


def test_dissection_saves_operations_in_a_weave(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eighty fibrils in which nodes up to two diameters apart touch: half of what minimum degree needs, at most."""
    mesh = build_mesh(plain_weave())
    fibril = np.repeat(np.arange(mesh.n_fibrils), np.diff(mesh.first_node))
    touching = cKDTree(mesh.position).query_pairs(0.6, output_type="ndarray")
    touching = touching[fibril[touching[:, 0]] != fibril[touching[:, 1]]]
    full = np.concatenate([mesh.elements[:, [0, 1]], mesh.elements[:, [1, 2]], mesh.elements[:, [0, 2]]])
    pattern = build_pattern(len(mesh.position), full, touching, mesh.position)

    def operations() -> float:
        sizes = np.array([(front.pivots, len(front.border)) for front in analyse(pattern).fronts], dtype=float)
        return float((sizes.sum(axis=1) ** 3 - sizes[:, 1] ** 3).sum())

    dissected = operations()
    monkeypatch.setattr(fronts, "dissect", lambda graph, *_: minimum_degree(graph))
    assert dissected < 0.5 * operations()
