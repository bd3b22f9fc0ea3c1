"""Conductances between the states of a grid of two strains: bicubic patches of their logarithm.

On the lines of the grid they are the monotone cubics of `interpolation`, along either axis. Inside a patch slopes and
twists of its corners join these lines, and its inner control points are held between the logarithms at its four
corners: a Bézier patch stays in the hull of its control points, so that no conductance is ever beyond those of the four
states around it, and each is positive by construction. Where nothing had to be held the patches join smoothly.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import PchipInterpolator

from circuittex.base.arrays import Floats, Ints
from circuittex.base.frozen import frozen

HERMITE = np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 1 / 3, 0.0], [0.0, 1.0, 0.0, -1 / 3], [0.0, 1.0, 0.0, 0.0]])
"""Values and slopes times the width at both ends, (f_0, f_1, w f'_0, w f'_1) -> four control points."""
POWERS = np.array([[1.0, 0.0, 0.0, 0.0], [-3.0, 3.0, 0.0, 0.0], [3.0, -6.0, 3.0, 0.0], [-1.0, 3.0, -3.0, 1.0]])
"""Four control points -> the coefficients of the powers of the place from 0 to 1."""


@frozen
class Patches:
    """log g = sum over k, l of c_kl (a - start)^k (b - start)^l on each patch, for R resistors on n x m patches."""

    first: Floats
    """(n + 1,) sampled strains along the first axis, rising."""
    second: Floats
    """(m + 1,) along the second."""
    coefficients: Floats
    """(4, 4, n, m, R) c_kl; c_00 is the logarithm of g in S at the lowest strains of the patch."""
    bounds: Floats
    """(2, R) smallest and largest log g of all states."""


def patches(first: Floats, second: Floats, conductance: Floats) -> Patches:
    """The patches of conductances (n, m, R) in S on a grid of n >= 2 and m >= 2 rising strains.

    >>> g = np.exp([[[0.0], [1.0]], [[2.0], [5.0]]])
    >>> patches(np.array([0.0, 1.0]), np.array([0.0, 1.0]), g).coefficients[:2, :2, 0, 0, 0].round(12).tolist()
    [[0.0, 1.0], [2.0, 2.0]]
    """
    f = np.log(conductance)
    along, across = _slopes(first, f, 0), _slopes(second, f, 1)
    twist = (_slopes(second, along, 1) + _slopes(first, across, 0)) / 2.0
    w, h = (np.diff(axis)[:, None] for axis in (first, second))

    def ends(values: Floats, slopes: Floats) -> Floats:
        """(4, n, m + 1, R) values and slopes at both ends of the patches along the first axis."""
        return np.array([values[:-1], values[1:], w[..., None] * slopes[:-1], w[..., None] * slopes[1:]])

    def both(lines: Floats, crossed: Floats) -> Floats:
        """(4, 4, n, m, R) the same along both axes."""
        return np.stack([lines[:, :, :-1], lines[:, :, 1:], h * crossed[:, :, :-1], h * crossed[:, :, 1:]], axis=1)

    corners = both(ends(f, along), ends(across, twist))
    points = np.einsum("pa,qb,abnmr->pqnmr", HERMITE, HERMITE, corners)
    four = corners[:2, :2]
    points[1:3, 1:3] = np.clip(points[1:3, 1:3], four.min(axis=(0, 1)), four.max(axis=(0, 1)))
    powers = np.einsum("kp,lq,pqnmr->klnmr", POWERS, POWERS, points)
    k = np.arange(4.0)[:, None]
    scale = (w.T**-k)[:, None, :, None, None] * (h.T**-k)[None, :, None, :, None]
    return Patches(first, second, scale * powers, np.array([f.min(axis=(0, 1)), f.max(axis=(0, 1))]))


def value_at(found: Patches, a: float, b: float) -> Floats:
    """(R,) conductances in S at two strains; beyond the grid those at its border."""
    (i, t), (j, u) = _place(found.first, a), _place(found.second, b)
    c = found.coefficients[:, :, i, j]
    return np.asarray(np.exp(np.einsum("klr,k,l->r", c, t ** np.arange(4), u ** np.arange(4))))


def left_out(first: Floats, second: Floats, conductance: Floats, i: int, j: int) -> Floats | None:
    """(R,) conductances in S at the state (i, j) from the grid without those of its lines that are no border.

    None for a corner: nothing is known on all sides of it.
    """
    keep_i, keep_j = (_others(len(axis), k) for axis, k in ((first, i), (second, j)))
    if len(keep_i) == len(first) and len(keep_j) == len(second):
        return None
    rest = patches(first[keep_i], second[keep_j], conductance[np.ix_(keep_i, keep_j)])
    return value_at(rest, float(first[i]), float(second[j]))


def _others(count: int, k: int) -> Ints:
    """Numbers below `count`, without `k` where it is an inner one."""
    numbers = np.arange(count)
    return numbers if k in (0, count - 1) else numbers[numbers != k]


def _slopes(strain: Floats, values: Floats, axis: int) -> Floats:
    """Monotone slopes of values at the strains along an axis."""
    return np.asarray(PchipInterpolator(strain, values, axis=axis).derivative()(strain))


def _place(knots: Floats, strain: float) -> tuple[int, float]:
    """The piece in which a strain lies, held within the knots, and how far it is in there."""
    x = float(np.clip(strain, knots[0], knots[-1]))
    k = min(int(np.searchsorted(knots, x, side="right")) - 1, len(knots) - 2)
    return k, x - float(knots[k])
