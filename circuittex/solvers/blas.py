"""The dense parts of Cholesky's factorisation by LAPACK and BLAS, free to run beside other threads.

SciPy's own wrappers hold Python's lock. Below them are the Fortran routines that SciPy offers to compiled programs; to
these, all arguments are addresses. Matrices here are C-ordered arrays with their values in the upper triangle: to
Fortran, which goes by columns, they are transposed, with their values in the lower one.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable
from ctypes import byref, c_char, c_double, c_float, c_int, c_void_p
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import LowLevelCallable
from scipy.linalg import cython_blas, cython_lapack

Reals = NDArray[np.float64] | NDArray[np.float32]


def _routine(module: ModuleType, name: str, arguments: str) -> Callable[..., None]:
    """The Fortran routine of that name; `arguments` are its types: letter c, integer i, double d or float s.

    Raises `ImportError` where SciPy has it with others, integers of another size for example.
    """
    found = LowLevelCallable.from_cython(module, name)
    types = {"c": "char", "i": "int", "d": r"(double|\w+_d)", "s": r"(float|\w+_s)"}
    known = ", ".join(rf"{types[kind]} \*" for kind in arguments)
    if not re.fullmatch(rf"void \({known}\)", found.signature):
        raise ImportError(f"{name} of this version of SciPy takes other arguments than are known: {found.signature}")
    api, capsule = ctypes.pythonapi, ctypes.py_object
    name_of = ctypes.PYFUNCTYPE(ctypes.c_char_p, capsule)(("PyCapsule_GetName", api))
    address_of = ctypes.PYFUNCTYPE(c_void_p, capsule, ctypes.c_char_p)(("PyCapsule_GetPointer", api))
    address = address_of(found.function, name_of(found.function))
    routine: Callable[..., None] = ctypes.CFUNCTYPE(None, *[c_void_p] * len(arguments))(address)
    return routine


_POTRF = {8: _routine(cython_lapack, "dpotrf", "cidii"), 4: _routine(cython_lapack, "spotrf", "cisii")}
_TRSM = {8: _routine(cython_blas, "dtrsm", "cccciiddidi"), 4: _routine(cython_blas, "strsm", "cccciissisi")}
_SYRK = {8: _routine(cython_blas, "dsyrk", "cciiddiddi"), 4: _routine(cython_blas, "ssyrk", "cciississi")}
"""By the bytes of a number."""
_LOWER, _RIGHT, _TRANSPOSED, _PLAIN = (byref(c_char(letter)) for letter in (b"L", b"R", b"T", b"N"))
_ONE: dict[int, Any] = {8: byref(c_double(1.0)), 4: byref(c_float(1.0))}
_MINUS: dict[int, Any] = {8: byref(c_double(-1.0)), 4: byref(c_float(-1.0))}


def cholesky(triangle: Reals) -> bool:
    """Replace the upper triangle of a matrix (p, p) by its factor U, K = U^T U; False where a pivot is not positive."""
    p, info = byref(c_int(len(triangle))), c_int()
    _POTRF[triangle.itemsize](_LOWER, p, triangle.ctypes.data, p, byref(info))
    return info.value == 0 and bool(triangle[-1, -1] > 0.0)  # what is not a number spreads to the last pivot


def solve_border(triangle: Reals, border: Reals) -> None:
    """Replace border (p, b) by U^-T border, U the upper triangle (p, p)."""
    (p, b), size = (byref(c_int(n)) for n in border.shape), border.itemsize
    at = triangle.ctypes.data, p, border.ctypes.data, b
    _TRSM[size](_RIGHT, _LOWER, _TRANSPOSED, _PLAIN, b, p, _ONE[size], *at)


def subtract_products(border: Reals, update: Reals) -> None:
    """Subtract border^T border from the upper triangle of update (b, b); border (p, b)."""
    (p, b), size = (byref(c_int(n)) for n in border.shape), border.itemsize
    _SYRK[size](_LOWER, _PLAIN, b, p, _MINUS[size], border.ctypes.data, b, _ONE[size], update.ctypes.data, b)
