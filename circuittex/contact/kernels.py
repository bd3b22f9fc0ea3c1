"""Compiled loops over contacts: gradient and exact tangent of the contact potential.

With u = x_a - x_b(s), c the weights of the eight nodes in u, c' their derivative in s and
w = c u_s + c' u, eliminating the closest position s from 1/2 P o^2 gives, for nodes i and j,

    gradient_i  = -P w_q o c_i n
    tangent_ij  =  P w_q (c_i c_j n n^T - o/d (c_i c_j (I - n n^T) - w_i w_j^T / m_ss)),  m_ss = u_s.u_s + u.u_ss

where the last term stands only while the closest point is not a fibril's end.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from circuittex.base.compiled import compiled
from circuittex.contact.curve import weights
from circuittex.mech.pattern import find_neighbour


@compiled
def _couple(r: Any, wa: int, wb: int, c: Any, cs: Any, css: Any, w: Any, n: Any, at_end: bool) -> tuple[float, float]:
    """Fill n (3,) and w (8, 3) of one contact; return the distance and 1 / m_ss (0 at a fibril's end)."""
    u, us, uss = np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(8):
        node = wa + i if i < 4 else wb + i - 4
        for k in range(3):
            u[k] += c[i] * r[node, k]
            us[k] += cs[i] * r[node, k]
            uss[k] += css[i] * r[node, k]
    d = np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    m = 0.0
    for k in range(3):
        n[k] = u[k] / d
        m += us[k] * us[k] + u[k] * uss[k]
        for i in range(8):
            w[i, k] = c[i] * us[k] + cs[i] * u[k]
    return d, 0.0 if at_end or m <= 0.0 else 1.0 / m


@compiled
def add_contacts(
    first_node: int,
    last_node: int,
    r: Any,
    basis: Any,
    window_a: Any,
    kind_a: Any,
    t_a: Any,
    window_b: Any,
    kind_b: Any,
    t_b: Any,
    at_end: Any,
    overlap: Any,
    stiffness: Any,
    indptr: Any,
    start: Any,
    neighbour: Any,
    point_offset: Any,
    total: Any,
    data: Any,
    softening: Any,
) -> None:
    """Add the gradient and the tangent's upper triangle of every contact (C) in place, in the rows of some nodes.

    These are first_node to last_node, the latter not included: threads that share out the nodes share no row.

    The tangent's first part, P w_q c_i c_j n n^T, goes to data; the rest, by which the contact force turns as
    fibrils slide, goes to softening.

    stiffness (C,): P* times quadrature weight, N/mm; the matrix arguments are those of `Pattern`.
    """
    c, cs, css = np.zeros(8), np.zeros(8), np.zeros(8)
    w, n, spread, turned = np.empty((8, 3)), np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    for q in range(overlap.shape[0]):
        # The lower window first: so the second node of each pair is the higher, a column right of the diagonal.
        low, high = min(window_a[q], window_b[q]), max(window_a[q], window_b[q])
        if (low + 4 <= first_node or low >= last_node) and (high + 4 <= first_node or high >= last_node):
            continue
        weights(basis[kind_a[q]], t_a[q], 0, c[:4])
        for order, out in ((0, c), (1, cs), (2, css)):
            weights(basis[kind_b[q]], t_b[q], order, out[4:])
            for i in range(4, 8):
                out[i] = -out[i]
        d, over_m = _couple(r, window_a[q], window_b[q], c, cs, css, w, n, at_end[q])
        stiff, lean = stiffness[q], stiffness[q] * overlap[q] / d
        for k in range(3):
            for m in range(3):
                spread[k, m] = stiff * n[k] * n[m]
                turned[k, m] = lean * (n[k] * n[m] - (k == m))
        over_m *= lean
        first, second = (0, 4) if low == window_a[q] else (4, 0)
        for i in range(8):
            mine, node = (first + i, low + i) if i < 4 else (second + i - 4, high + i - 4)
            if not first_node <= node < last_node or (c[mine] == 0.0 and cs[mine] == 0.0):
                continue
            across = find_neighbour(start, neighbour, node, high) if i < 4 else 0
            for k in range(3):
                total[9 * node + k] -= stiff * overlap[q] * c[mine] * n[k]
                at = indptr[9 * node + k]
                for m in range(k, 3):
                    cc = c[mine] * c[mine]
                    data[at + m - k] += cc * spread[k, m]
                    softening[at + m - k] += cc * turned[k, m] + over_m * w[mine, k] * w[mine, m]
            for j in range(i + 1, 8):
                other = first + j if j < 4 else second + j - 4
                if c[other] == 0.0 and cs[other] == 0.0:
                    continue
                # Neighbours rise: those in the same window come first, and those in the other lie side by side.
                there = point_offset[across + j - 4 if i < 4 <= j else start[node] + j - i - 1]
                cc = c[mine] * c[other]
                for k in range(3):
                    row, wk = indptr[9 * node + k] + 9 - k + there, over_m * w[mine, k]
                    for m in range(3):
                        data[row + m] += cc * spread[k, m]
                        softening[row + m] += cc * turned[k, m] + wk * w[other, m]
