"""The dense routines against NumPy, and whether they let other threads run meanwhile."""

from __future__ import annotations

import sys
import threading

import numpy as np
import pytest
from scipy.linalg import cython_blas

from circuittex.base.arrays import Floats
from circuittex.solvers.blas import _routine, cholesky, solve_border, subtract_products

ROUND_OFF = 1e-12
"""Relative: a few hundred operations for each value, and condition numbers of some hundred; in single precision as many
units of that."""
SINGLE = float(np.finfo(np.float32).eps / np.finfo(float).eps)


def stiff(p: int) -> Floats:
    """A positive definite matrix (p, p)."""
    A = np.random.default_rng(p).normal(size=(p, p))
    return np.asarray(A @ A.T + p * np.eye(p))


@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize(("p", "b"), [(1, 1), (3, 7), (40, 9), (70, 70)])
def test_parts_of_the_factor(p: int, b: int, single: bool) -> None:
    dtype, close = (np.float32, SINGLE * ROUND_OFF) if single else (np.float64, ROUND_OFF)
    K, rng = stiff(p), np.random.default_rng(b)
    border, update = rng.normal(size=(p, b)), rng.normal(size=(b, b))
    U = np.linalg.cholesky(K).T
    expected = np.linalg.solve(U.T, border)
    products = update - expected.T @ expected
    triangle, border, update = (np.ascontiguousarray(each, dtype=dtype) for each in (K, border, update))
    below = np.tril(update, -1)
    assert cholesky(triangle)
    solve_border(triangle, border)
    subtract_products(border, update)
    for found, wanted in ((np.triu(triangle), U), (border, expected), (np.triu(update), np.triu(products))):
        assert np.abs(found - wanted).max() <= close * np.abs(wanted).max()
        assert found.dtype == dtype
    assert np.array_equal(np.tril(update, -1), below)


@pytest.mark.parametrize("value", [-1.0, 0.0, np.nan])
@pytest.mark.parametrize("at", [0, 5, 9])
def test_a_pivot_that_is_not_positive(value: float, at: int) -> None:
    K = np.diag(np.arange(1.0, 11.0))
    K[at, at] = value
    assert not cholesky(K)


def test_a_routine_with_other_arguments_is_not_called() -> None:
    """SciPy may come with integers of another size: that must not end in wrong numbers."""
    with pytest.raises(ImportError, match="dsyrk of this version of SciPy"):
        _routine(cython_blas, "dsyrk", "cciiddidd")


def test_other_threads_run_meanwhile() -> None:
    """A call gives Python's lock away: where the interpreter never takes it from a thread, this one runs only then.

    Counted, not timed: the worker sees how far this thread has counted before and after its call.
    """
    K, counted, seen = stiff(2000), [0], []
    begun, interval = threading.Event(), sys.getswitchinterval()

    def factorise() -> None:
        seen.append(counted[0])
        begun.set()
        cholesky(K)
        seen.append(counted[0])

    thread = threading.Thread(target=factorise)
    sys.setswitchinterval(1e6)
    try:
        thread.start()
        begun.wait()
        for _ in range(1000):
            counted[0] += 1
        thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert seen == [0, 1000]
