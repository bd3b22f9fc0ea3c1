"""Intel MKL's PARDISO through pypardiso, of the extra `pardiso`: another program, to check circuittex's own solver by.

On one core it is the slower one, on two no faster (`benchmarks/newton.py`); it can use more.
"""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any

import numpy as np
import scipy.sparse as sp

from circuittex.base.arrays import Floats
from circuittex.mech.coupled import Coupled
from circuittex.mech.linear import Solve
from circuittex.mech.pattern import Pattern


class PardisoSolver:
    """Cholesky by PARDISO, its symbolic analysis kept while the same pairs are coupled.

    Raises `ImportError` where pypardiso is not installed, `OSError` where a library of its own is missing.
    """

    name = "pardiso"
    _CHOLESKY, _ANALYSE, _FACTOR, _SOLVE, _RELEASE = 2, 11, 22, 33, -1
    _NOT_POSITIVE = -4
    _SETTINGS = ((1, 1), (2, 2), (34, 2))
    """Places and values of iparm: own settings, METIS ordering, no refinement; and the work divided as for two threads
    whatever their number, so that the result has the same bits on any number."""

    def __init__(self) -> None:
        self._coupled = Coupled()
        self._matrix: Any = None
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # pypardiso warns about its own optional dependencies
            import pypardiso

        self._error = pypardiso.pardiso_wrapper.PyPardisoError
        self._pardiso = pypardiso.PyPardisoSolver(mtype=self._CHOLESKY)
        # What took a search of the whole environment is found at once the next time, by worker processes as well.
        os.environ.setdefault("PYPARDISO_MKL_RT", self._pardiso.libmkl._name)
        for place, value in self._SETTINGS:
            self._pardiso.set_iparm(place, value)

    def _call(self, phase: int, b: Floats) -> Floats:
        self._pardiso.set_phase(phase)
        return np.asarray(self._pardiso._call_pardiso(self._matrix, b))

    def factor(self, pattern: Pattern, data: Floats, *, rough: bool = False) -> Solve | None:
        """A function that solves with the matrix (until the next call), or None if it is not positive definite; in
        double precision, `rough` or not."""
        nothing = np.zeros(pattern.n_dofs)
        if self._coupled.renew(pattern, data):
            self._release()
            entries = self._coupled.entries
            rows = data[entries], pattern.indices[entries], self._coupled.start()
            self._matrix = sp.csr_matrix(rows, shape=(pattern.n_dofs, pattern.n_dofs))
            self._call(self._ANALYSE, nothing)
        self._matrix.data = data[self._coupled.entries]
        try:
            self._call(self._FACTOR, nothing)
        except self._error as error:
            if error.value == self._NOT_POSITIVE:
                return None
            raise
        return lambda b: self._call(self._SOLVE, b)

    def forget(self) -> None:
        """The next matrix is analysed as by a new solver."""
        self._coupled = Coupled()

    def _release(self) -> None:
        if self._matrix is not None:
            self._call(self._RELEASE, np.zeros(self._matrix.shape[0]))
            self._matrix = None

    def __del__(self) -> None:
        if not sys.is_finalizing():  # at exit the system takes the memory back
            self._release()
