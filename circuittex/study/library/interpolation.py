"""Conductances between the sampled strains: monotone cubic pieces of their logarithm, and what they miss.

PCHIP (Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5, 1984): each piece runs from sample to sample without a turn of
its own, so that every conductance stays between those of its two samples, positive by construction.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from circuittex.base.arrays import Floats
from circuittex.base.frozen import frozen


@frozen
class Pieces:
    """log g = sum over k of c_k (strain - start)^k on each piece, for R resistors on n pieces."""

    knots: Floats
    """(n + 1,) sampled strains, rising."""
    coefficients: Floats
    """(4, n, R) c_0 to c_3; c_0 is the logarithm of g in S at the beginning of the piece."""
    bounds: Floats
    """(2, R) smallest and largest log g of all samples."""


def pieces(strain: Floats, conductance: Floats) -> Pieces:
    """The pieces of conductances (K, R) in S at K >= 2 rising strains (K,).

    >>> found = pieces(np.array([0.0, 0.5]), np.exp([[1.0], [2.0]]))
    >>> found.coefficients[:, 0, 0].tolist()
    [1.0, 2.0, 0.0, 0.0]
    """
    logs = np.log(conductance)
    found = PchipInterpolator(strain, logs).c[::-1]
    return Pieces(strain, found, np.array([logs.min(axis=0), logs.max(axis=0)]))


def value(found: Pieces, strain: float) -> Floats:
    """(R,) conductances in S at a strain; beyond the samples those of the last one."""
    x = float(np.clip(strain, found.knots[0], found.knots[-1]))
    k = min(int(np.searchsorted(found.knots, x, side="right")) - 1, len(found.knots) - 2)
    t = x - found.knots[k]
    c = found.coefficients[:, k]
    return np.asarray(np.exp(c[0] + t * (c[1] + t * (c[2] + t * c[3]))))


def without(strain: Floats, conductance: Floats, left_out: int) -> Floats:
    """(R,) conductances in S at the sample `left_out` from all the others."""
    kept = np.arange(len(strain)) != left_out
    return value(pieces(strain[kept], conductance[kept]), float(strain[left_out]))
