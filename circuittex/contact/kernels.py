"""Compiled loops over contacts: gradient and exact tangent of the contact potential.

With u = x_a - x_b(s), c the weights of the eight nodes in u, c' their derivative in s and
w = c u_s + c' u, eliminating the position s of the smallest or largest distance from 1/2 P o^2 gives, for
nodes i and j,

    gradient_i  = -P w_q o c_i n
    tangent_ij  =  P w_q (c_i c_j n n^T - o/d (c_i c_j (I - n n^T) - w_i w_j^T / m_ss)),  m_ss = u_s.u_s + u.u_ss

where the last term stands only while s is not a fibril's end. At a maximum of the distance w_q and m_ss are negative.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from circuittex.base.arrays import Floats, Ints
from circuittex.base.compiled import compiled
from circuittex.contact.curve import weights
from circuittex.mech.pattern import find_neighbour

LEAST_CURVATURE = 1e-8
"""Of m_ss, in parts of u_s.u_s: where a minimum and a maximum meet m_ss vanishes and the tangent grows beyond bounds;
that much of it leaves the digits of all the rest."""


class Touches(NamedTuple):
    """The C contact points, as compiled functions take them."""

    interval_a: Ints
    """(C,) interval that carries the contact point."""
    t_a: Floats
    """(C,) its local coordinate."""
    interval_b: Ints
    """(C,) interval of the other place."""
    t_b: Floats
    """(C,) its local coordinate."""
    at_end: Any
    """(C,) whether that is a fibril's end."""
    overlap: Floats
    """(C,) o, mm."""
    stiffness: Floats
    """(C,) P* times quadrature weight, N/mm; negative at a maximum of the distance."""


class Rows(NamedTuple):
    """Where the entries of a `Pattern` are."""

    indptr: Ints
    start: Ints
    neighbour: Ints
    point_offset: Ints


class Sums(NamedTuple):
    """What contacts are added to."""

    gradient: Floats
    """(n_dofs,), N."""
    data: Floats
    """(nnz,) tangent, N/mm."""
    softening: Floats
    """(nnz,) the part of it by which the contact force turns as fibrils slide."""


class _Pair(NamedTuple):
    c: Floats
    """(8,) weights of the nodes in u: those of the lower window, then those of the higher that it does not hold."""
    cs: Floats
    """(8,) their derivatives."""
    w: Floats
    """(8, 3)."""
    n: Floats
    """(3,)."""
    spread: Floats
    """(3, 3) P w_q n n^T."""
    turned: Floats
    """(3, 3) -P w_q o/d (I - n n^T)."""
    scratch: Floats
    """(6, 4) weights in either window and their derivatives."""


@compiled
def _couple(curve: Any, touches: Any, q: int, apart: int, pair: Any) -> tuple[float, float]:
    """Fill c, cs, w and n of one contact, whose windows begin `apart` nodes apart; the distance and 1 / m_ss.

    The latter is 0 at a fibril's end; windows with common nodes have `apart` < 4.
    """
    a, b, r, scratch = touches.interval_a[q], touches.interval_b[q], curve.r, pair.scratch
    weights(curve.basis[curve.kind[a]], touches.t_a[q], 0, scratch[0])
    for derivative in range(3):
        weights(curve.basis[curve.kind[b]], touches.t_b[q], derivative, scratch[1 + derivative])
    wa, wb = curve.window[a], curve.window[b]
    square, speed, m = 0.0, 0.0, 0.0
    u, us = scratch[4], scratch[5]
    for k in range(3):
        u[k], us[k], uss = 0.0, 0.0, 0.0
        for i in range(4):
            u[k] += scratch[0, i] * r[wa + i, k]
        for i in range(4):
            u[k] -= scratch[1, i] * r[wb + i, k]
            us[k] -= scratch[2, i] * r[wb + i, k]
            uss -= scratch[3, i] * r[wb + i, k]
        square += u[k] * u[k]
        speed += us[k] * us[k]
        m += us[k] * us[k] + u[k] * uss
    d = np.sqrt(square)
    first, second = (0, apart) if wa <= wb else (apart, 0)
    pair.c[:], pair.cs[:] = 0.0, 0.0
    for i in range(4):
        pair.c[first + i] += scratch[0, i]
    for i in range(4):
        pair.c[second + i] -= scratch[1, i]
        pair.cs[second + i] -= scratch[2, i]
    for k in range(3):
        pair.n[k] = u[k] / d
        for i in range(8):
            pair.w[i, k] = pair.c[i] * us[k] + pair.cs[i] * u[k]
    if touches.at_end[q]:
        return d, 0.0
    sign = np.copysign(1.0, touches.stiffness[q])
    return d, sign / max(sign * m, LEAST_CURVATURE * speed)


@compiled
def add_contacts(first_node: int, last_node: int, curve: Any, touches: Any, rows: Any, sums: Any) -> None:
    """Add the gradient and the tangent's upper triangle of every contact (C) in place, in the rows of some nodes.

    These are first_node to last_node, the latter not included: threads that share out the nodes share no row.

    At a minimum of the distance the tangent's first part, P w_q c_i c_j n n^T, goes to data; the rest, by which the
    contact force turns as fibrils slide, goes to softening, and so does all of it at a maximum.
    """
    pair = _Pair(
        np.empty(8), np.empty(8), np.empty((8, 3)), np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty((6, 4))
    )
    for q in range(touches.overlap.shape[0]):
        # The lower window first: so the second node of each pair is the higher, a column right of the diagonal.
        wa, wb = curve.window[touches.interval_a[q]], curve.window[touches.interval_b[q]]
        low, high = min(wa, wb), max(wa, wb)
        if (low + 4 <= first_node or low >= last_node) and (high + 4 <= first_node or high >= last_node):
            continue
        d, over_m = _couple(curve, touches, q, min(4, high - low), pair)
        stiff, lean = touches.stiffness[q], touches.stiffness[q] * touches.overlap[q] / d
        for k in range(3):
            for m in range(3):
                spread, turned = stiff * pair.n[k] * pair.n[m], lean * (pair.n[k] * pair.n[m] - (k == m))
                pair.spread[k, m] = spread if stiff > 0.0 else 0.0
                pair.turned[k, m] = turned if stiff > 0.0 else turned + spread
        _add(first_node, last_node, low, high, stiff * touches.overlap[q], over_m * lean, pair, rows, sums)


@compiled
def _add(
    first_node: int, last_node: int, low: int, high: int, force: float, pull: float, pair: Any, rows: Any, sums: Any
) -> None:
    """Add one contact between the windows that begin at low and high: P w_q o and P w_q o / (d m_ss) as given."""
    c, cs, w, n, apart = pair.c, pair.cs, pair.w, pair.n, min(4, high - low)
    for i in range(4 + apart):
        node = low + i if i < 4 else high + i - apart
        if not first_node <= node < last_node or (c[i] == 0.0 and cs[i] == 0.0):
            continue
        across = find_neighbour(rows.start, rows.neighbour, node, high) if i < 4 == apart else 0
        for k in range(3):
            sums.gradient[9 * node + k] -= force * c[i] * n[k]
            at = rows.indptr[9 * node + k]
            for m in range(k, 3):
                cc = c[i] * c[i]
                sums.data[at + m - k] += cc * pair.spread[k, m]
                sums.softening[at + m - k] += cc * pair.turned[k, m] + pull * w[i, k] * w[i, m]
        for j in range(i + 1, 4 + apart):
            if c[j] == 0.0 and cs[j] == 0.0:
                continue
            # Neighbours rise: those in the same window come first, and those in the other lie side by side.
            there = rows.point_offset[across + j - 4 if i < 4 <= j and apart == 4 else rows.start[node] + j - i - 1]
            cc = c[i] * c[j]
            for k in range(3):
                row, wk = rows.indptr[9 * node + k] + 9 - k + there, pull * w[i, k]
                for m in range(3):
                    sums.data[row + m] += cc * pair.spread[k, m]
                    sums.softening[row + m] += cc * pair.turned[k, m] + wk * w[j, m]


@compiled
def add_forces(curve: Any, touches: Any, gradient: Any) -> None:
    """Add the contacts' gradient alone, -P w_q o c_i n, to gradient (n_dofs,), in their order."""
    r, mine, other, u = curve.r, np.empty(4), np.empty(4), np.empty(3)
    for q in range(touches.overlap.shape[0]):
        a, b = touches.interval_a[q], touches.interval_b[q]
        weights(curve.basis[curve.kind[a]], touches.t_a[q], 0, mine)
        weights(curve.basis[curve.kind[b]], touches.t_b[q], 0, other)
        wa, wb, square = curve.window[a], curve.window[b], 0.0
        for k in range(3):
            u[k] = 0.0
            for i in range(4):
                u[k] += mine[i] * r[wa + i, k]
            for i in range(4):
                u[k] -= other[i] * r[wb + i, k]
            square += u[k] * u[k]
        force = touches.stiffness[q] * touches.overlap[q] / np.sqrt(square)
        for i in range(4):
            for k in range(3):
                gradient[9 * (wa + i) + k] -= force * mine[i] * u[k]
                gradient[9 * (wb + i) + k] += force * other[i] * u[k]
