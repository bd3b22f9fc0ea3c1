"""The factorisation by fronts against dense linear algebra, on patterns of many fronts and of few."""

from __future__ import annotations

import numpy as np
import pytest
from beams import dense
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from test_fronts import patterns

import circuittex.mech.multifrontal as multifrontal
import circuittex.solvers.cholesky as cholesky
import circuittex.solvers.elimination_tree as elimination_tree
import circuittex.solvers.fronts as fronts
from circuittex.base.arrays import Floats
from circuittex.mech.coupled import pair_of_entry
from circuittex.mech.multifrontal import MultifrontalSolver, blocks
from circuittex.mech.pattern import Pattern, build_pattern, diagonal

costs = st.sampled_from([0.0, 300.0, 3e4, elimination_tree.FRONT])
"""From one part a front to one front for all that is connected."""
seeds = st.integers(0, 2**32 - 1)
EPSILON = float(np.finfo(float).eps)


def grid(side: int) -> Pattern:
    """Nodes in a square, coupled along one direction as in a fibril and across as by contact."""
    node = np.arange(side * side).reshape(side, side)
    along = np.stack([node[:, :-1].ravel(), node[:, 1:].ravel()], axis=1)
    across = np.stack([node[:-1].ravel(), node[1:].ravel()], axis=1)
    place = np.stack([node.ravel() // side, node.ravel() % side, 0 * node.ravel()], axis=1)
    return build_pattern(side * side, along, across, place.astype(float))


def random_values(pattern: Pattern, seed: int, least: float) -> Floats:
    """Random values with this least eigenvalue; the largest is some 20."""
    values = np.random.default_rng(seed).uniform(-1, 1, pattern.nnz)
    values[diagonal(pattern)] += least - np.linalg.eigvalsh(dense(pattern, values))[0]
    return np.asarray(values)


def solver_for(pattern: Pattern, cost: float) -> MultifrontalSolver:
    """A solver that has the fronts of the pattern which this `FRONT` makes."""
    solver, unit = MultifrontalSolver(), np.full(pattern.nnz, 1e-9)
    unit[diagonal(pattern)] = 1.0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elimination_tree, "FRONT", cost)
        assert solver.factor(pattern, unit) is not None
    return solver


@settings(deadline=None, max_examples=100)
@given(patterns(), costs, seeds)
def test_solution_is_that_of_a_dense_solver(pattern: Pattern, cost: float, seed: int) -> None:
    """To round-off: the condition number is at most some 200."""
    data = random_values(pattern, seed, 0.1)
    b = np.random.default_rng(seed).normal(size=pattern.n_dofs)
    solve = solver_for(pattern, cost).factor(pattern, data)
    assert solve is not None
    expected = np.linalg.solve(dense(pattern, data), b)
    assert np.abs(solve(b) - expected).max() < 1e-12 * np.abs(expected).max()


@settings(deadline=None, max_examples=60)
@given(patterns(), costs, seeds, st.sampled_from([-1e-6, -0.1, -10.0]))
def test_one_negative_eigenvalue_is_enough(pattern: Pattern, cost: float, seed: int, least: float) -> None:
    """A lone one of a millionth among them: Cholesky's backward error is some 1e-14."""
    solver, data = solver_for(pattern, cost), random_values(pattern, seed, least)
    assert solver.factor(pattern, data) is None
    data[diagonal(pattern)] += 2 * abs(least)
    assert solver.factor(pattern, data) is not None


@settings(deadline=None, max_examples=30)
@given(patterns(), costs, seeds)
def test_an_unknown_without_stiffness_or_not_a_number_is_refused(pattern: Pattern, cost: float, seed: int) -> None:
    solver, data = solver_for(pattern, cost), random_values(pattern, seed, 0.1)
    unknown = seed % pattern.n_dofs
    rows = np.repeat(np.arange(pattern.n_dofs), np.diff(pattern.indptr))
    loose = np.where((rows == unknown) | (pattern.indices == unknown), 0.0, data)
    assert solver.factor(pattern, loose) is None
    data[diagonal(pattern)[unknown]] = np.nan
    assert solver.factor(pattern, data) is None


@pytest.mark.parametrize("cost", [0.0, 3e4, elimination_tree.FRONT, np.inf])
@pytest.mark.parametrize("graded", [False, True])
def test_backward_error_is_round_off_whatever_the_scales(cost: float, graded: bool) -> None:
    """900 unknowns, alike or in units that differ by up to 1e12: |Ax - b| is within round-off of |A||x| row by row.

    Cholesky's x solves a system with each entry a_ij wrong by at most 4 n eps (a_ii a_jj)^(1/2) to first order
    (Higham, Accuracy and Stability of Numerical Algorithms, theorem 10.3); a twentieth of that is asked for, since
    errors do not all add up.
    """
    pattern = grid(10)
    n = pattern.n_dofs
    rows = np.repeat(np.arange(n), np.diff(pattern.indptr))
    unit = 10.0 ** np.random.default_rng(0).uniform(-6, 6, n) if graded else np.ones(n)
    data = random_values(pattern, 1, 1e-3) * unit[rows] * unit[pattern.indices]
    b = np.random.default_rng(2).normal(size=n) * unit
    solve = solver_for(pattern, cost).factor(pattern, data)
    assert solve is not None
    A, x = dense(pattern, data), solve(b)
    scale = np.sqrt(np.diag(A))
    assert np.all(np.abs(A @ x - b) <= 0.2 * n * EPSILON * scale * (scale @ np.abs(x)))


def test_fronts_follow_the_coupled_pairs_and_are_kept_while_they_hold_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Contacts of one pattern that open, close again and multiply: every solution is right, few need new fronts."""
    analysed = []

    def counting(pattern: Pattern, coupled: NDArray[np.bool_]) -> fronts.Blocks:
        analysed.append(int(coupled.sum()))
        return blocks(pattern, coupled)

    monkeypatch.setattr(multifrontal, "blocks", counting)
    pattern, solver = grid(6), MultifrontalSolver()
    pair, whole = pair_of_entry(pattern), random_values(grid(6), 6, 0.1)
    point = np.flatnonzero(pattern.full_offset < 0)
    b = np.random.default_rng(6).normal(size=pattern.n_dofs)
    for closed in (10, 4, 10, 30, 0, 30):
        data = np.where(np.isin(pair, point[closed:]), 0.0, whole)
        data[diagonal(pattern)] += 20.0  # positive definite without some of the pairs as well
        solve = solver.factor(pattern, data)
        assert solve is not None
        expected = np.linalg.solve(dense(pattern, data), b)
        assert np.abs(solve(b) - expected).max() < 1e-12 * np.abs(expected).max()
    assert analysed == [30 + 10, 30 + 30]  # thirty pairs along the fibrils


def test_the_order_is_kept_while_it_serves() -> None:
    """One pair more changes little; contact everywhere, where a third of it was, asks for another order."""
    pattern, solver = grid(8), MultifrontalSolver()
    pair, point = pair_of_entry(pattern), np.flatnonzero(pattern.full_offset < 0)
    found = []
    for closed in (20, 21, len(point)):
        data = np.where(np.isin(pair, point[closed:]), 0.0, 1e-9)
        data[diagonal(pattern)] = 1.0
        assert solver.factor(pattern, data) is not None
        assert solver._cholesky is not None
        found.append(solver._cholesky.analysis)
    assert np.array_equal(found[1].blocks, found[0].blocks)
    assert found[1].least == found[0].least
    assert not np.array_equal(found[2].blocks, found[0].blocks)
    assert found[2].least > fronts.WORTHWHILE * found[0].least


def test_one_front_is_the_dense_factor() -> None:
    """Everything in one front, against NumPy's Cholesky of the same matrix."""
    pattern = build_pattern(24, np.argwhere(np.triu(np.ones((24, 24)), 1)), np.empty((0, 2), dtype=np.int64))
    data = random_values(pattern, 3, 0.5)
    solver = solver_for(pattern, np.inf)
    assert solver.factor(pattern, data) is not None
    assert solver._cholesky is not None
    ((_, triangle, border),) = solver._cholesky._dense
    order = solver._cholesky.analysis.permutation
    expected = np.linalg.cholesky(dense(pattern, data)[np.ix_(order, order)]).T
    assert np.abs(np.triu(triangle) - expected).max() < 1e-12 * np.abs(expected).max()
    assert border.size == 0


@pytest.mark.parametrize("threads", [2, 5])
def test_threads_change_no_bit(threads: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many fronts and subtrees of one or two of them, again and again: whoever is first, sums keep their order."""
    monkeypatch.setattr(elimination_tree, "SHARE", 1e-3)
    pattern = grid(10)
    good, b = random_values(pattern, 7, 0.1), np.ones(pattern.n_dofs)
    bad = good.copy()
    bad[diagonal(pattern)[450]] = -1.0
    found = []
    for count in (1, *[threads] * 20):
        monkeypatch.setattr(cholesky, "cores", lambda count=count: count)
        solver = solver_for(pattern, 300.0)
        assert solver._cholesky is not None
        assert len(solver._cholesky.analysis.subtrees) > 10
        assert solver.factor(pattern, bad) is None
        solve = solver.factor(pattern, good)
        assert solve is not None
        found.append(solve(b).tobytes())
    assert len(set(found)) == 1


@pytest.mark.parametrize("error", [MemoryError, IndexError])
def test_an_error_in_a_thread_comes_out(error: type[Exception], monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise error

    solver, pattern = MultifrontalSolver(), grid(8)
    monkeypatch.setattr(elimination_tree, "SHARE", 1e-3)
    monkeypatch.setattr(elimination_tree, "FRONT", 0.0)
    monkeypatch.setattr(cholesky, "cores", lambda: 2)
    monkeypatch.setattr(cholesky, "_add", fail)
    with pytest.raises(error):
        solver.factor(pattern, random_values(pattern, 8, 0.1))


def test_the_same_matrix_gives_the_same_bits() -> None:
    """Also after another matrix and another pattern, and in another solver."""
    pattern, other = grid(8), grid(5)
    data, b = random_values(pattern, 4, 0.1), np.ones(pattern.n_dofs)
    solver, found = MultifrontalSolver(), []
    for _ in range(2):
        for used in (solver, MultifrontalSolver()):
            solve = used.factor(pattern, data)
            assert solve is not None
            found.append(solve(b).tobytes())
        assert solver.factor(pattern, -data) is None
        assert solver.factor(other, random_values(other, 5, 0.1)) is not None
    assert len(set(found)) == 1
