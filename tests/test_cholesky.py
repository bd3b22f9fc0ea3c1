"""The generic factorisation: any sparse symmetric matrix, without knowledge of beams."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import circuittex.solvers.cholesky as cholesky
from circuittex.base.arrays import Floats
from circuittex.solvers.cholesky import Cholesky, analysed, factorise
from circuittex.solvers.levels import levels

EPSILON = float(np.finfo(float).eps)


def laplacian(rows: int, columns: int) -> sp.csr_array:
    """Of a grid of unit resistors, its first node on one more to ground."""
    along, across = (sp.diags_array([[-1.0] * (n - 1)] * 2, offsets=[-1, 1]) for n in (rows, columns))
    graph = sp.kron(along, sp.eye_array(columns)) + sp.kron(sp.eye_array(rows), across)
    held = np.zeros(rows * columns)
    held[0] = 1.0
    return sp.csr_array(graph - sp.diags_array(graph.sum(axis=1) - held))


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 30), st.integers(0, 2**32 - 1), st.floats(0.0, 0.5), st.booleans())
def test_random_matrices_against_dense_algebra(n: int, seed: int, density: float, placed: bool) -> None:
    """Connected or in pieces, with places or without; a factor in floating point solves to n eps of |A| |x|."""
    rng = np.random.default_rng(seed)
    half = np.where(rng.random((n, n)) < density, rng.normal(size=(n, n)), 0.0)
    A = half @ half.T + 0.1 * np.eye(n)
    b = rng.normal(size=n)
    solve = factorise(sp.csr_array(A), rng.normal(size=(n, 3)) if placed else None)
    assert solve is not None
    x = solve(b)
    assert np.all(np.abs(A @ x - b) <= 4 * n * EPSILON * (np.abs(A) @ np.abs(x)).max())


@pytest.mark.parametrize("placed", [True, False])
def test_a_grid_against_the_resistance_between_its_corners(placed: bool) -> None:
    """Unit resistors in a square of three by three nodes: 1.5 ohm from corner to corner, and 1 ohm to ground."""
    solve = factorise(laplacian(3, 3))
    assert solve is not None
    assert solve(np.eye(9)[8])[8] == pytest.approx(1.5 + 1.0, rel=1e-13)
    A, place = laplacian(60, 60), np.stack([*np.divmod(np.arange(3600.0), 60), np.zeros(3600)], axis=1)
    solve = factorise(A, place if placed else None)
    assert solve is not None
    b = np.random.default_rng(1).normal(size=3600)
    expected = sp.linalg.spsolve(A.tocsc(), b)
    assert np.abs(solve(b) - expected).max() < 1e-10 * np.abs(expected).max()  # condition some 1e5


@pytest.mark.parametrize("at", [0, 17, 99])
def test_a_matrix_that_is_not_positive_definite(at: int) -> None:
    A = laplacian(10, 10).tolil()
    A[at, at] = -1.0
    assert factorise(sp.csr_array(A)) is None
    A[at, at] = np.nan
    assert factorise(sp.csr_array(A)) is None


@pytest.mark.parametrize("single", [False, True])
def test_the_same_bits_on_any_number_of_threads(monkeypatch: pytest.MonkeyPatch, single: bool) -> None:
    A, b = laplacian(80, 80), np.random.default_rng(2).normal(size=6400)
    analysis, values = analysed(A)
    monkeypatch.setattr(cholesky, "WORTH_SHARING", 1)

    def solution(threads: int) -> Floats:
        monkeypatch.setattr(cholesky, "cores", lambda: threads)
        solve = Cholesky(analysis, single=single).factor(values)
        assert solve is not None
        return solve(b)

    one = solution(1)
    assert all(np.array_equal(solution(count), one) for count in (2, 5))


@pytest.mark.parametrize("size", [1.0, 1e-60, 1e60])
def test_single_precision_is_good_to_its_digits(size: float) -> None:
    """A solution errs by as many times the precision as the matrix is ill conditioned, here some 5e3; forces outside
    the range of single precision are no trouble. In double precision, in the same memory, it errs by 1e-9 of that."""
    A, b = laplacian(40, 40), size * np.random.default_rng(3).normal(size=1600)
    analysis, values = analysed(A)
    rough = Cholesky(analysis, single=True)
    solve, expected = rough.factor(values), sp.linalg.spsolve(A.tocsc(), b)
    assert solve is not None
    condition = np.linalg.cond(A.toarray())
    error = np.abs(solve(b) - expected).max() / np.abs(expected).max()
    assert 1e-9 < error < condition * np.finfo(np.float32).eps
    assert not solve(np.zeros(1600)).any()
    assert rough.factor(np.where(np.arange(len(values)) == 0, -1.0, values)) is None
    exact = Cholesky(analysis, rough).factor(values)
    assert exact is not None
    assert np.abs(exact(b) - expected).max() < 1e-6 * error * np.abs(expected).max()


def test_levels_are_steps_between_far_nodes() -> None:
    """In a grid the first two run from corner to corner; a part by itself has levels of its own."""
    graph = sp.csr_array(abs(laplacian(4, 4)))
    graph.setdiag(0.0)
    graph.eliminate_zeros()
    graph.data[:] = 1.0
    steps = levels(graph)
    assert steps[:, 0].max() == 6.0
    assert np.array_equal(steps[:, 0] + steps[:, 1], np.full(16, 6.0))
    both = levels(sp.csr_array(sp.block_diag([graph, graph])))
    assert np.array_equal(both[:16], both[16:])
