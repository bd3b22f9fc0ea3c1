"""The linear solvers against dense ones on random block patterns, and whether they know what is positive definite."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable

import numpy as np
import pytest
from beams import dense

from circuittex.base.arrays import Floats
from circuittex.mech.coupled import Coupled, pair_of_entry
from circuittex.mech.linear import LinearSolver
from circuittex.mech.multifrontal import MultifrontalSolver
from circuittex.mech.pardiso import PardisoSolver
from circuittex.mech.pattern import Pattern, build_pattern, diagonal


def has(module: str) -> bool:
    """Whether an optional package is installed."""
    return importlib.util.find_spec(module) is not None


SOLVERS: list[Callable[[], LinearSolver]] = [
    MultifrontalSolver,
    *([PardisoSolver] if has("pypardiso") else []),
]
NODES = 12

every_solver = pytest.mark.parametrize("make", SOLVERS)


def random_pattern(seed: int, nodes: int = NODES) -> Pattern:
    """A chain of full node pairs with random point pairs, and a few repeats and reversals."""
    rng = np.random.default_rng(seed)
    chain = np.stack([np.arange(nodes - 1), np.arange(1, nodes)], axis=1)
    full = np.concatenate([chain, chain[:2, ::-1], rng.integers(0, nodes, (3, 2))])
    return build_pattern(nodes, full, rng.integers(0, nodes, (10, 2)))


def random_values(pattern: Pattern, seed: int) -> Floats:
    """Symmetric values with eigenvalues of both signs."""
    return np.asarray(np.random.default_rng(seed).uniform(-1, 1, pattern.nnz))


def shifted(pattern: Pattern, data: Floats, least: float) -> Floats:
    """The same matrix plus a multiple of the identity such that its least eigenvalue is `least`."""
    values = data.copy()
    values[diagonal(pattern)] += least - np.linalg.eigvalsh(dense(pattern, data))[0]
    return values


def assert_solves(solver: LinearSolver, pattern: Pattern, data: Floats, seed: int) -> None:
    """Agreement to round-off: the least eigenvalue is 0.1 or more, the largest some 20."""
    b = np.random.default_rng(seed).normal(size=pattern.n_dofs)
    solve = solver.factor(pattern, data)
    assert solve is not None
    before = b.copy()
    expected = np.linalg.solve(dense(pattern, data), b)
    assert np.abs(solve(b) - expected).max() < 1e-11 * np.abs(expected).max()
    assert np.array_equal(b, before)


@pytest.mark.parametrize("seed", range(5))
def test_pattern_holds_exactly_the_asked_for_blocks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    full, point = rng.integers(0, NODES, (6, 2)), rng.integers(0, NODES, (9, 2))
    expected = np.kron(np.eye(NODES), np.ones((9, 9)))
    blocks = expected.reshape(NODES, 9, NODES, 9)
    for a, b in point:
        blocks[a, :3, b, :3] = blocks[b, :3, a, :3] = 1
    for a, b in full:
        blocks[a, :, b, :] = blocks[b, :, a, :] = 1
    pattern = build_pattern(NODES, full, point)
    assert np.array_equal(dense(pattern, np.ones(pattern.nnz)), blocks.reshape(9 * NODES, 9 * NODES))
    for row in range(pattern.n_dofs):
        columns = pattern.indices[pattern.indptr[row] : pattern.indptr[row + 1]]
        assert columns[0] == row
        assert np.all(np.diff(columns) > 0)


@every_solver
@pytest.mark.parametrize("seed", range(3))
def test_solution_is_that_of_a_dense_solver(make: Callable[[], LinearSolver], seed: int) -> None:
    pattern = random_pattern(seed)
    assert_solves(make(), pattern, shifted(pattern, random_values(pattern, seed), 0.1), seed)


@every_solver
def test_pattern_is_used_again_and_replaced(make: Callable[[], LinearSolver]) -> None:
    solver = make()
    for seed, nodes in ((0, NODES), (1, NODES + 5), (2, NODES - 4)):
        pattern = random_pattern(seed, nodes)
        for again in range(3):
            data = shifted(pattern, random_values(pattern, 10 * seed + again), 0.1 + again)
            assert_solves(solver, pattern, data, again)


@every_solver
@pytest.mark.parametrize("least", [-1e-3, -1.0, -100.0])
def test_indefinite_matrix_is_none(make: Callable[[], LinearSolver], least: float) -> None:
    """Negative eigenvalues from one of a thousandth to all of them; afterwards the solver works on."""
    solver, pattern = make(), random_pattern(3)
    data = random_values(pattern, 3)
    for _ in range(2):
        assert solver.factor(pattern, shifted(pattern, data, least)) is None
        assert_solves(solver, pattern, shifted(pattern, data, 0.1), 3)


@every_solver
def test_saddle_point_with_zero_diagonal_is_none(make: Callable[[], LinearSolver]) -> None:
    pattern = random_pattern(4)
    data = shifted(pattern, random_values(pattern, 4), 0.1)
    data[diagonal(pattern)[::2]] = 0.0
    assert make().factor(pattern, data) is None


@every_solver
def test_singular_matrix_is_none(make: Callable[[], LinearSolver]) -> None:
    """An unknown without any stiffness, and springs between two free nodes: pivots that are zero without round-off."""
    solver, pattern = make(), random_pattern(5)
    data = shifted(pattern, random_values(pattern, 5), 0.1)
    rows = np.repeat(np.arange(pattern.n_dofs), np.diff(pattern.indptr))
    loose = data.copy()
    loose[(rows == 31) | (pattern.indices == 31)] = 0.0

    two = build_pattern(2, np.array([[0, 1]]), np.empty((0, 2), dtype=np.int64))
    springs = np.zeros(two.nnz)
    springs[two.indices == np.repeat(np.arange(two.n_dofs), np.diff(two.indptr)) + 9] = -1.0
    springs[diagonal(two)] = 1.0

    for _ in range(2):
        assert solver.factor(pattern, loose) is None
        assert solver.factor(two, springs) is None
        assert_solves(solver, pattern, data, 5)


def test_pardiso_that_is_not_installed_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pypardiso", None)  # makes its import raise ImportError
    with pytest.raises(ImportError, match="pypardiso"):
        PardisoSolver()


@pytest.mark.parametrize("make", SOLVERS)
@pytest.mark.parametrize("seed", [0, 1])
def test_pairs_without_values_may_gain_and_lose_them(make: Callable[[], LinearSolver], seed: int) -> None:
    """Fibrils that part leave zeros in a pattern that holds, and those that meet fill them again."""
    pattern, solver = random_pattern(seed), make()
    pair, values = pair_of_entry(pattern), random_values(pattern, seed)
    some = values * ~np.isin(pair, np.arange(0, len(pattern.neighbour), 2))
    assert 0 < np.count_nonzero(some) < np.count_nonzero(values)
    for data in (some, values, some):
        assert_solves(solver, pattern, shifted(pattern, data, 0.1), seed)
        assert solver.factor(pattern, shifted(pattern, data, -0.1)) is None


def test_pairs_count_from_when_they_are_coupled() -> None:
    pattern = random_pattern(0)
    pair, values = pair_of_entry(pattern), random_values(pattern, 0)
    coupled, few = Coupled(), np.where(pair == 0, values, 0.0)
    assert coupled.renew(pattern, few)
    assert np.array_equal(np.flatnonzero(coupled.pairs), [0])
    assert set(pair[coupled.entries]) == {-1, 0}
    rows = np.split(pair, pattern.indptr[1:-1])
    assert np.array_equal(np.diff(coupled.start()), [np.isin(row, (-1, 0)).sum() for row in rows])
    assert not coupled.renew(pattern, np.zeros(pattern.nnz))
    assert coupled.renew(pattern, values)
    assert coupled.pairs.all()
